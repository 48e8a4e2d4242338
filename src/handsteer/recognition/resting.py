"""Recognises hands at rest by where they are on the person: low at the body, in the lap, clasped in front of it.

The shape of a hand cannot tell rest from a sign: loosely closed fingers look like a fist, and a hanging hand points
down. So MediaPipe's model of people finds the shoulders and hips; a hand that hangs is at the height of the hips, and
seen as large as a hand at the distance of the body is. A hand that is shown is higher, or nearer to the camera.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.features import PALM
from handsteer.recognition.filters import HandPosition
from handsteer.recognition.hand import Hand
from handsteer.recognition.landmark_models import PictureModel, find_model
from handsteer.recognition.regions import Detector

Array = NDArray[np.floating]

MODEL: Final = "pose_detection.tflite"
"""MediaPipe's model of people; of its two stages this is the first, which finds a person."""

_GRIDS: Final = ((8, 2), (16, 2), (32, 6))
_HIPS, _SHOULDERS = 2, 4
_PEOPLE: Final = 4
"""Largest number of people in a frame."""
_MIN_SCORE: Final = 0.85
"""People with a face in view score above 0.95, arms and hands that are mistaken for a person mostly below 0.8."""

_LOW: Final = 0.65
"""Height below which a hand is at rest, from 0 at the shoulders to 1 at the hips.

Of three people, hands that hang are at 0.9 to 1.3, those that are shown at -0.5 to 0.5.
"""
_LOW_DRIVING: Final = 0.85
"""Likewise for a hand whose sign counts already: a fist that is a joystick is moved down on purpose."""
_ASIDE: Final = 1.0
"""Largest distance of a resting hand from the line from shoulders to hips, in lengths of that line; 0.2 to 0.6 seen."""
_LARGE: Final = 0.55
"""Longer side of a hand from which it is nearer to the camera than the body, in lengths of that line; 0.2 to 0.4 seen
for hands that hang."""
_ABOVE: Final = _LOW / _LARGE
"""Smallest distance of a resting hand from the upper edge of the frame in longer sides of the hand: its person's
shoulders are in the frame."""

_MOVED: Final = 0.5
"""Movement of a hand after which its person is searched for again, in hand sizes."""
_AGAIN_S: Final = 0.5
"""Time after which that of a hand that does not drive is."""


@dataclass(frozen=True)
class Person:
    """One person in a frame.

    Attributes:
        shoulders: (2,) the middle between the shoulders, in pixels.
        hips: (2,) the middle between the hips, in pixels; it may be outside the frame.
    """

    shoulders: Array
    hips: Array

    def has_at_rest(self, hand: Hand, *, drives: bool = False) -> bool:
        """Return whether ``hand``, whose sign counts already if it ``drives``, is at rest, if it is this person's."""
        down, aside = self.place(hand)
        return (
            down > (_LOW_DRIVING if drives else _LOW) and aside < _ASIDE and hand.longer_side_px < _LARGE * self.length
        )

    @property
    def length(self) -> float:
        """The distance from shoulders to hips in pixels, at least 1."""
        return max(1.0, float(np.hypot(*(self.hips - self.shoulders))))

    def place(self, hand: Hand) -> tuple[float, float]:
        """Return how far down the middle of the palm is, and how far from the line from shoulders to hips.

        Both in lengths of that line: (0, 0) is at the shoulders, (1, 0) at the hips.
        """
        line = (self.hips - self.shoulders) / self.length
        away = (hand.pixels[PALM, :2].mean(axis=0) - self.shoulders) / self.length
        return float(away @ line), float(abs(away[0] * line[1] - away[1] * line[0]))


class PersonDetector:
    """Detects people; not thread-safe.

    Args:
        path: The model file.
        threads: CPU threads to run it on.

    Raises:
        ModelCorrupt: The file is not a model that can be run.
    """

    def __init__(self, path: Path, threads: int) -> None:
        self._detector = Detector(PictureModel(path, threads, darkest=-1.0), _GRIDS, _MIN_SCORE)

    def detect(self, image: NDArray[np.uint8]) -> list[Person]:
        """Return the people in ``image``, (height, width, 3) uint8 BGR, by descending score."""
        return [Person(points[_SHOULDERS], points[_HIPS]) for points, _ in self._detector.find(image, _PEOPLE)]


@dataclass
class _Verdict:
    place: HandPosition
    resting: bool
    age_s: float = 0.0


class RestingHands:
    """Decides which hands are at rest, and remembers it while they stay where they are; not thread-safe.

    Args:
        threads: CPU threads of the model of people, which is loaded when it is first needed.

    Raises:
        ModelMissing: The model file is missing.
        ModelCorrupt: The model file has unexpected content.
    """

    def __init__(self, threads: int) -> None:
        self._path = find_model(MODEL)
        self._threads = threads
        self._detector: PersonDetector | None = None
        self._verdicts: list[_Verdict] = []
        self._people: list[Person] | None = None

    def next_frame(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, >= 0, to the next frame."""
        self._people = None
        for verdict in self._verdicts:
            verdict.age_s += dt_s

    def reset(self) -> None:
        """Forget all hands."""
        self._verdicts = []
        self._people = None

    def is_resting(self, image: NDArray[np.uint8], hand: Hand, *, search: bool = True, drives: bool = False) -> bool:
        """Return whether ``hand`` is at rest.

        Args:
            image: The frame, (height, width, 3) uint8, BGR; the same until :meth:`next_frame`.
            hand: A hand in it.
            search: Whether to search for people; otherwise only what was found before is known.
            drives: Whether its sign counts already: it may be lower, and people are searched for only when it moves.
        """
        place = HandPosition.of_palm(hand)
        if place.y < _ABOVE * place.size:
            return False
        near = next((each for each in self._verdicts if place.distance(each.place) <= _MOVED), None)
        if near is not None and (drives or not search or near.age_s <= _AGAIN_S):
            return near.resting
        if not search:
            return False
        self._verdicts = [each for each in self._verdicts if each is not near and each.age_s <= _AGAIN_S]
        self._verdicts.append(_Verdict(place, self._has_at_rest(image, hand, drives=drives)))
        return self._verdicts[-1].resting

    def _has_at_rest(self, image: NDArray[np.uint8], hand: Hand, *, drives: bool) -> bool:
        if self._people is None:
            if self._detector is None:
                self._detector = PersonDetector(self._path, self._threads)
            self._people = self._detector.detect(image)
        nearest = min(self._people, key=lambda person: person.place(hand)[1], default=None)
        return nearest is not None and nearest.has_at_rest(hand, drives=drives)
