"""Our reimplementation of the course's processing of a frame: mirror, landmarks, dense net, drawing.

It needs MediaPipe, and is independent of handsteer. It avoids detours that the course's own code makes, and a dense net
of the same size in NumPy with random weights replaces the course's TensorFlow model, which is slower to load.
"""

import itertools
from typing import Any

import cv2
import mediapipe as mp
import numpy as np

LABELS = ("Stop", "Go", "Forward", "Backward", "Turn Right", "Turn Left")
_SIZES = (42, 20, 10, len(LABELS))
_FINGERS = ((2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16), (17, 18, 19, 20))
_PALM = (0, 1, 2, 5, 9, 13, 17, 0)
_CHAINS = (*_FINGERS, _PALM)
_TIPS = (4, 8, 12, 16, 20)
_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)


class TutorialPipeline:
    """MediaPipe's hand landmarks, one hand, both confidences 0.7, and the tutorial's classifier and drawing."""

    def __init__(self) -> None:
        self._hands = mp.solutions.hands.Hands(
            max_num_hands=1, min_detection_confidence=0.7, min_tracking_confidence=0.7
        )
        random = np.random.default_rng(0)
        sizes = itertools.pairwise(_SIZES)
        self._layers = [(random.normal(size=size).astype(np.float32), np.zeros(size[1], np.float32)) for size in sizes]

    def step(self, image: np.ndarray, _dt_s: float) -> bool:
        """Process the next frame, BGR and not mirrored; return whether it contains a hand."""
        mirrored = cv2.flip(image, 1)
        picture = mirrored.copy()
        rgb = cv2.cvtColor(mirrored, cv2.COLOR_BGR2RGB)
        rgb.flags.writeable = False
        found = self._hands.process(rgb)
        if found.multi_hand_landmarks is None:
            return False
        for landmarks, handedness in zip(found.multi_hand_landmarks, found.multi_handedness, strict=True):
            points = _pixels(landmarks, picture.shape)
            label = f"{handedness.classification[0].label}:{LABELS[self._classify(points)]}"
            _draw(picture, points, label)
        return True

    def _classify(self, points: list[tuple[int, int]]) -> int:
        relative = (np.array(points, np.float32) - points[0]).ravel()
        values = relative / max(1.0, float(np.abs(relative).max()))
        for weights, biases in self._layers[:-1]:
            values = np.maximum(values @ weights + biases, 0)
        weights, biases = self._layers[-1]
        return int((values @ weights + biases).argmax())


def _pixels(landmarks: Any, shape: tuple[int, ...]) -> list[tuple[int, int]]:
    height, width = shape[:2]
    return [(min(int(each.x * width), width - 1), min(int(each.y * height), height - 1)) for each in landmarks.landmark]


def _draw(picture: np.ndarray, points: list[tuple[int, int]], label: str) -> None:
    """Draw box, bones, joints and text as the tutorial does: bones white on black, joints as rings."""
    left, top, width, height = cv2.boundingRect(np.array(points))
    cv2.rectangle(picture, (left, top), (left + width, top + height), _BLACK, 1)
    for chain in _CHAINS:
        for begin, end in itertools.pairwise(chain):
            cv2.line(picture, points[begin], points[end], _BLACK, 6)
            cv2.line(picture, points[begin], points[end], _WHITE, 2)
    for index, point in enumerate(points):
        radius = 8 if index in _TIPS else 5
        cv2.circle(picture, point, radius, _WHITE, -1)
        cv2.circle(picture, point, radius, _BLACK, 1)
    cv2.rectangle(picture, (left, top), (left + width, top - 22), _BLACK, -1)
    cv2.putText(picture, label, (left + 5, top - 4), cv2.FONT_HERSHEY_SIMPLEX, 0.6, _WHITE, 1, cv2.LINE_AA)
