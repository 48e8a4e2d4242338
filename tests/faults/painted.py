"""A camera that paints the sign that a hand shows, and what reads it there: the whole chain but the landmark models."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import Frame
from handsteer.clock import Clock
from handsteer.config import Config, SignsConfig
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import NONE
from tests.recognition.hands import show_sign

SIGNS = ("Forward", "Backward", "Turn Left", "Turn Right", "Go", "Stop")
FPS = 30.0
_HEIGHT, _WIDTH = 48, 64
_ROW = 36
"""Where the sign is read; a picture that is torn above has none."""
_STEP = 30
"""Brightness from one sign to the next; more than the noise."""


class PaintedCamera:
    """Paints the brightness that stands for :attr:`sign`, with the noise that every sensor has."""

    name = "painted camera"
    period_s = 1 / FPS

    def __init__(self, clock: Clock, seed: int = 0) -> None:
        self.sign = NONE
        self._clock = clock
        self._random = np.random.default_rng(seed)

    def read(self) -> Frame:
        level = 10 + _STEP * (1 + SIGNS.index(self.sign) if self.sign in SIGNS else 0)
        noise = self._random.integers(0, 5, (_HEIGHT, _WIDTH, 3))
        return Frame((level + noise).astype(np.uint8), self._clock.now())

    def close(self) -> None:
        pass


class PaintedLandmarker:
    """Finds a hand where the picture is bright, with the sign that the brightness stands for."""

    hands = {sign: show_sign(sign) for sign in SIGNS}  # noqa: RUF012

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = math.inf) -> list[Hand]:
        row = image[_ROW]
        index = round((float(row.mean()) - 12) / _STEP) - 1
        # Grey and black, of a torn or dark picture, have no noise.
        return [self.hands[SIGNS[index]]] if row.std() > 0 and 0 <= index < len(SIGNS) else []

    def look_again(self, image: NDArray[np.uint8], hand: Hand) -> Hand:
        return hand

    def second_opinion(self, image: NDArray[np.uint8], hand: Hand, *, mirrored: bool = False) -> Hand:
        """Return ``hand``: it is seen well already."""
        return hand

    def follow_only(self, hand: Hand) -> None:
        pass

    def reset(self) -> None:
        pass


class PaintedClassifier:
    """Knows the painted hands again."""

    signs = SIGNS

    def classify(self, hand: Hand) -> SignGuess:
        sign = next(sign for sign, known in PaintedLandmarker.hands.items() if known is hand)
        return SignGuess(sign, 0.95, {sign: 0.95})

    def confidence(self, sign: str, likelihood: float) -> float:
        return likelihood


def painted_recognizer(config: SignsConfig) -> Recognizer:
    """Return the real recogniser, with the real filter, on painted hands."""
    return Recognizer(Config(signs=config), landmarker=PaintedLandmarker(), classifier=PaintedClassifier())
