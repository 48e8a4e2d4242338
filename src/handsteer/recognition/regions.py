"""Where hands are in a frame: palms, and regions of interest, the rotated squares that are a model's input.

MediaPipe's ``palm_detection`` models are single-shot detectors: for each of 2016 anchors (positions in the picture)
they give a score, a box and seven keypoints. Anchors, decoding and suppression follow MediaPipe 0.10.21's graph
``palm_detection_cpu``; the regions from a palm and from landmarks (points, scale and shift) follow its
``palm_detection_detection_to_roi`` and ``hand_landmark_landmarks_to_roi``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, inf, log, pi, sin
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.landmark_models import PictureModel

Array = NDArray[np.floating]

_BASES_OF_INDEX_MIDDLE_RING: Final = (5, 9, 13)
# Wrist, thumb without its tip, and the two lower joints of each finger: these move least when a finger bends.
_STEADY_LANDMARKS: Final = (0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18)

_PALM_GRIDS: Final = ((8, 2), (16, 6))

_WRIST: Final = 0
_MIDDLE_BASE: Final = 2
_SAME_PALM_OVERLAP: Final = 0.3
_SMOOTHING: Final = 0.6
"""Standard deviation of the blur of a smoothed frame, in pixels of the model's input.

With 0.3, a fifth of the hands that only a smoothed frame shows are not found; without a blur, two thirds.
"""


@dataclass(frozen=True)
class Roi:
    """A rotated square in a frame; all lengths in pixels.

    Attributes:
        center_x: From the left edge of the frame.
        center_y: From the top edge of the frame.
        side: Length of its sides.
        rotation: Angle of its x axis from the frame's, in radians, clockwise as seen.
    """

    center_x: float
    center_y: float
    side: float
    rotation: float = 0.0

    @property
    def axes(self) -> Array:
        """(2, 2) float64 rotation of a row of the square's coordinates ``p`` into the frame's: ``p @ axes``."""
        c, s = cos(self.rotation), sin(self.rotation)
        return np.array([[c, s], [-s, c]])

    def to_frame(self, points: Array) -> Array:
        """Return ``points``, (..., 2) with 0 to 1 across the square, in pixels of the frame."""
        return (points - 0.5) * self.side @ self.axes + (self.center_x, self.center_y)

    def crop(self, image: NDArray[np.uint8], pixels: int, border: int) -> NDArray[np.uint8]:
        """Return the square as a (pixels, pixels, 3) image, bilinearly sampled.

        Args:
            image: (height, width, 3) uint8.
            pixels: Side of the result.
            border: OpenCV's border mode outside the frame, such as ``cv2.BORDER_REPLICATE``.
        """
        scale = self.side / pixels
        c, s = cos(self.rotation) * scale, sin(self.rotation) * scale
        half = pixels / 2
        crop_to_frame = np.array(
            [[c, -s, self.center_x - (c - s) * half], [s, c, self.center_y - (s + c) * half]],
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpAffine(image, crop_to_frame, (pixels, pixels), flags=flags, borderMode=border)  # type: ignore[return-value]

    def grown(self, factor: float) -> "Roi":
        """Return the square scaled by ``factor`` about its centre."""
        return Roi(self.center_x, self.center_y, self.side * factor, self.rotation)

    def overlap(self, other: "Roi") -> float:
        """Return the intersection over union of the two squares as if neither were rotated, 0 to 1."""
        reach = (self.side + other.side) / 2
        smaller = min(self.side, other.side)
        width = min(smaller, reach - abs(self.center_x - other.center_x))
        height = min(smaller, reach - abs(self.center_y - other.center_y))
        if width <= 0 or height <= 0:
            return 0.0
        shared = width * height
        return shared / (self.side**2 + other.side**2 - shared)


def whole_frame(width: int, height: int, widened: float = 1.0) -> Roi:
    """Return the smallest upright square around a frame of that size in pixels, enlarged by the factor ``widened``."""
    return Roi(width / 2, height / 2, max(width, height) * widened)


def from_palm(corners: Array, wrist: Array, middle_base: Array) -> Roi:
    """Return the region of the hand of a detected palm; all arguments in pixels.

    Args:
        corners: (2, 2) top left and bottom right of the palm's box, x and y.
        wrist: (2,).
        middle_base: (2,) base of the middle finger.
    """
    width, height = corners[1] - corners[0]
    return _grown(corners.mean(axis=0), width, height, _upright(wrist, middle_base), shift=0.5, scale=2.6)


def from_landmarks(points: Array) -> Roi:
    """Return the region of the hand for the next frame from (21, 2) landmarks in pixels of this frame."""
    index, middle, ring = points[list(_BASES_OF_INDEX_MIDDLE_RING)]
    rotation = _upright(points[0], ((index + ring) / 2 + middle) / 2)
    steady = points[list(_STEADY_LANDMARKS)]
    axes = Roi(0, 0, 1, rotation).axes
    about = (steady.min(axis=0) + steady.max(axis=0)) / 2
    turned = (steady - about) @ axes.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    width, height = high - low
    return _grown((low + high) / 2 @ axes + about, width, height, rotation, shift=0.1, scale=2.0)


def _upright(wrist: Array, fingers: Array) -> float:
    """Return the rotation of a region in which ``fingers`` is straight above ``wrist``, -pi to pi."""
    x, y = fingers - wrist
    rotation = pi / 2 - atan2(-y, x)
    return rotation - 2 * pi if rotation > pi else rotation


def _grown(center: Array, width: float, height: float, rotation: float, *, shift: float, scale: float) -> Roi:
    """Return a square around a box, shifted by ``shift`` of its height towards the fingers and scaled by ``scale``."""
    x = center[0] + shift * height * sin(rotation)
    y = center[1] - shift * height * cos(rotation)
    return Roi(float(x), float(y), float(max(width, height) * scale), rotation)


@dataclass(frozen=True)
class Palm:
    """One palm in a frame.

    Attributes:
        corners: (2, 2) top left and bottom right of its box, x and y in pixels.
        keypoints: (7, 2) in pixels: wrist, bases of index, middle, ring and little finger, two joints of the thumb.
        score: 0 to 1.
        is_sure: Whether the score is at least the minimum; otherwise the landmark model has to confirm the hand.
    """

    corners: Array
    keypoints: Array
    score: float
    is_sure: bool = True

    @property
    def roi(self) -> Roi:
        """The region of its hand for the landmark model."""
        return from_palm(self.corners, self.keypoints[_WRIST], self.keypoints[_MIDDLE_BASE])


class Detector:
    """A single-shot detection model of MediaPipe: boxes with keypoints, and their scores.

    Args:
        model: Gives the candidates' values and the logits of their scores, in this order.
        grids: Side of each grid's cells in pixels of the model's input, and number of anchors at a cell's centre.
        min_score: Minimum score, 0 to 1.
        doubtful_score: Score from which doubtful detections are returned too, after all others, which they do not
            change; at most ``min_score``, which is used if None.
    """

    def __init__(
        self,
        model: PictureModel,
        grids: Sequence[tuple[int, int]],
        min_score: float,
        doubtful_score: float | None = None,
    ) -> None:
        self._model = model
        self._min_score = min_score
        self._min_logit = _logit(min_score if doubtful_score is None else doubtful_score)
        self._anchors = _anchors(model.side, grids)

    def find(
        self, image: NDArray[np.uint8], limit: int, *, widened: float = 1.0, smoothed: bool = False
    ) -> list[tuple[Array, float]]:
        """Return at most ``limit`` detections in ``image``, (height, width, 3) uint8 BGR, by descending score.

        Args:
            image: The frame.
            limit: Maximum number of detections.
            widened: Factor that enlarges the frame with a black border, so that what is in it appears smaller.
            smoothed: Whether to average the pixels of the frame that become one of the model's input, instead of
                sampling them as MediaPipe does: noise and grain, as of dark pictures, hide hands.

        Returns:
            Pairs of (n, 2) points in pixels of the frame, the top left and the bottom right of the box, then the
            keypoints, and a score, 0 to 1.
        """
        height, width = image.shape[:2]
        square = whole_frame(width, height, widened)
        seen, region = _reduced(image, square, self._model.side) if smoothed else (image, square)
        picture = region.crop(seen, self._model.side, cv2.BORDER_CONSTANT)
        values, logits = self._model.run(picture)
        logits = logits[:, 0]
        found = np.flatnonzero(logits >= self._min_logit)
        found = found[np.argsort(-logits[found], kind="stable")]
        points = _decoded(values[found] / self._model.side, self._anchors[found])
        merged = _merged(points, _sigmoid(logits[found]), limit, self._min_score)
        return [(square.to_frame(each), score) for each, score in merged]


class PalmDetector:
    """A palm detection model.

    Args:
        path: The model file.
        threads: CPU threads to run it on.
        min_score: Minimum score of a palm, 0 to 1.
        doubtful_score: Minimum score of a doubtful palm, 0 to ``min_score``; none are returned if None.

    Raises:
        ModelCorrupt: The file is not a model that can be run.
    """

    def __init__(self, path: Path, threads: int, min_score: float, doubtful_score: float | None = None) -> None:
        self._min_score = min_score
        self._detector = Detector(PictureModel(path, threads), _PALM_GRIDS, min_score, doubtful_score)

    def detect(
        self, image: NDArray[np.uint8], limit: int, *, widened: float = 1.0, smoothed: bool = False
    ) -> list[Palm]:
        """Return at most ``limit`` palms, as :meth:`Detector.find` describes."""
        found = self._detector.find(image, limit, widened=widened, smoothed=smoothed)
        return [Palm(each[:2], each[2:], score, score >= self._min_score) for each, score in found]


def _reduced(image: NDArray[np.uint8], square: Roi, side: int) -> tuple[NDArray[np.uint8], Roi]:
    """Return ``image`` blurred and reduced to the resolution of ``square`` at ``side`` pixels, and the square in it."""
    scale = min(1.0, side / square.side)
    height, width = image.shape[:2]
    if scale < 1.0:
        size = max(1, round(width * scale)), max(1, round(height * scale))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    x, y = image.shape[1] / width, image.shape[0] / height
    # Pixels have their coordinates in their middle.
    moved = Roi((square.center_x + 0.5) * x - 0.5, (square.center_y + 0.5) * y - 0.5, square.side * x)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), _SMOOTHING), np.uint8), moved


def _anchors(side: int, grids: Sequence[tuple[int, int]]) -> Array:
    """Return the (n, 2) centres of the anchors, x and y from 0 to 1 across the picture, row by row in each grid."""
    anchors = []
    for cell, per_cell in grids:
        along = (np.arange(side // cell, dtype=np.float32) + 0.5) * (cell / side)
        x, y = np.meshgrid(along, along)
        centers = np.stack([x.ravel(), y.ravel()], axis=1)
        anchors.append(np.repeat(centers, per_cell, axis=0))
    return np.concatenate(anchors)


def _decoded(values: Array, anchors: Array) -> Array:
    """Return the boxes and keypoints of n candidates, 0 to 1 across the picture.

    Args:
        values: (n, 4 + 2 k) relative to the anchor: x and y of the box's centre, its width and height, k keypoints.
        anchors: (n, 2).

    Returns:
        (n, 2 + k, 2): top left and bottom right of the box, then the keypoints.
    """
    points = values.reshape(len(anchors), values.shape[1] // 2, 2)
    center, half_size = points[:, 0], points[:, 1] / 2
    corners = np.stack([center - half_size, center + half_size], axis=1)
    return np.concatenate([corners, points[:, 2:]], axis=1) + anchors[:, None]


def _merged(points: Array, scores: Array, limit: int, min_score: float) -> list[tuple[Array, float]]:
    """Return one candidate for each group that overlaps, the mean of the group weighted by score.

    This is MediaPipe's weighted non-maximum suppression. A candidate without an area overlaps nothing and is dropped.
    Candidates below ``min_score`` count only in groups without a better one.

    Args:
        points: (n, 2 + k, 2) boxes and keypoints, by descending score.
        scores: (n,).
        limit: Maximum number of results.
        min_score: Minimum score of a candidate that is not doubtful.

    Returns:
        At most ``limit`` pairs of (2 + k, 2) points and the best score of the group.
    """
    merged: list[tuple[Array, float]] = []
    while len(scores) and len(merged) < limit:
        same = _overlap(points[0, :2], points[:, :2]) > _SAME_PALM_OVERLAP
        if same[0]:
            counted = same & (scores >= min(min_score, scores[0]))
            merged.append((np.average(points[counted], axis=0, weights=scores[counted]), float(scores[0])))
        same[0] = True
        points, scores = points[~same], scores[~same]
    return merged


def _overlap(box: Array, boxes: Array) -> Array:
    """Return the (n,) intersection over union of ``box``, (2, 2) corners, with each of ``boxes``, (n, 2, 2)."""
    shared = np.prod(np.clip(np.minimum(box[1], boxes[:, 1]) - np.maximum(box[0], boxes[:, 0]), 0, None), axis=1)
    total = np.prod(box[1] - box[0]) + np.prod(boxes[:, 1] - boxes[:, 0], axis=1) - shared
    overlap: Array = np.divide(shared, total, out=np.zeros_like(shared), where=total > 0)
    return overlap


def _sigmoid(logits: Array) -> Array:
    """Return the sigmoid of ``logits``, which are clipped to 80; beyond, float32 makes no difference."""
    scores: Array = 1 / (1 + np.exp(-np.clip(logits, -80, 80)))
    return scores


def _logit(score: float) -> float:
    """Return the inverse sigmoid of ``score``, 0 to 1."""
    if score in (0, 1):
        return inf if score else -inf
    return log(score / (1 - score))
