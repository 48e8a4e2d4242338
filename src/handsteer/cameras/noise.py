"""Sensor noise for pictures without it, so that a still picture does not look like a frozen camera."""

import cv2
import numpy as np
from numpy.typing import NDArray

_SHIFTS = 256
_TICKS_PER_S = 10_000


class SensorNoise:
    """Adds 0 to 2 grey levels to each pixel; the noise depends on the seed and the time only."""

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed
        self._grain = np.zeros((0, 0, 3), np.uint8)

    def on(self, image: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Return a copy of ``image``, (height, width, 3) uint8, with the noise of ``time_s``; white stays white."""
        height, width = image.shape[:2]
        if self._grain.shape[:2] != (height + _SHIFTS, width + _SHIFTS):
            shape = (height + _SHIFTS, width + _SHIFTS, 3)
            self._grain = np.random.default_rng(self._seed).integers(0, 3, shape, dtype=np.uint8)
        top, left = np.random.default_rng(round(time_s * _TICKS_PER_S)).integers(0, _SHIFTS, 2)
        grain = self._grain[top : top + height, left : left + width]
        return np.asarray(cv2.add(image, grain), np.uint8)
