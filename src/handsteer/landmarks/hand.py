"""One hand as every landmarker reports it, and what every landmarker offers."""

from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from handsteer.types import Handedness

CONNECTIONS: tuple[tuple[int, int], ...] = (
    *((0, 1), (1, 2), (2, 3), (3, 4)),
    *((0, 5), (5, 6), (6, 7), (7, 8)),
    *((5, 9), (9, 10), (10, 11), (11, 12)),
    *((9, 13), (13, 14), (14, 15), (15, 16)),
    *((0, 17), (13, 17), (17, 18), (18, 19), (19, 20)),
)
"""The bones to draw between landmarks 0 (wrist) to 20 (tip of the little finger)."""


@dataclass(frozen=True)
class Hand:
    """One hand in one frame.

    Attributes:
        points: (21, 3) float32 landmarks, image-normalised: x / width, y / height, and depth z (0 at the wrist,
            towards the camera negative) in the scale of x. Order: wrist, then thumb, index, middle, ring and little
            finger, each from its base to its tip.
        world: (21, 3) float32 landmarks in metres about the hand's centre, axes as ``points``.
        handedness: Which hand of the person it is (the frame is not mirrored).
        handedness_score: 0.5 to 1, how sure that is.
        presence: 0 to 1, how sure it is that there is a hand.
        image_size: Width and height of the frame in pixels.
    """

    points: NDArray[np.float32]
    world: NDArray[np.float32]
    handedness: Handedness
    handedness_score: float
    presence: float
    image_size: tuple[int, int]

    @property
    def pixels(self) -> NDArray[np.float32]:
        """(21, 3) float32 landmarks in pixels; z in the scale of x."""
        width, height = self.image_size
        return self.points * np.array([width, height, width], np.float32)

    @property
    def longer_side_px(self) -> float:
        """The longer side of the box about the landmarks, in pixels."""
        return float(np.ptp(self.pixels[:, :2], axis=0).max())

    @property
    def box_px(self) -> tuple[int, int, int, int]:
        """The box about the landmarks: left, top, right and bottom in pixels; it may reach beyond the frame."""
        (left, top), (right, bottom) = self.pixels[:, :2].min(axis=0), self.pixels[:, :2].max(axis=0)
        return int(left), int(top), int(right) + 1, int(bottom) + 1


class Landmarker(Protocol):
    """Finds hands in frames; follows them from one frame to the next."""

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands in ``image``; an empty list when there is none.

        Hands that are already followed come first and keep their order; new ones after them, the surest first.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored.
            search: Whether to look for further hands while one is followed already, which takes time.
            dt_s: Seconds since the last frame, >= 0, by which less can be looked at where nothing changes.

        Raises:
            FrameError: The image has another shape or type.
        """
        ...

    def follow_only(self, hand: Hand) -> None:
        """Forget all hands of the last frame but ``hand``, which is one of them: the others take time."""
        ...

    def reset(self) -> None:
        """Forget the hands of the last frame."""
        ...
