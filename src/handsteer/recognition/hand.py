"""A detected hand and its sign, and the interfaces of landmarkers and classifiers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import FrameError
from handsteer.types import Handedness

CONNECTIONS: tuple[tuple[int, int], ...] = (
    *((0, 1), (1, 2), (2, 3), (3, 4)),
    *((0, 5), (5, 6), (6, 7), (7, 8)),
    *((5, 9), (9, 10), (10, 11), (11, 12)),
    *((9, 13), (13, 14), (14, 15), (15, 16)),
    *((0, 17), (13, 17), (17, 18), (18, 19), (19, 20)),
)
"""The bones to draw between landmarks 0 (wrist) to 20 (tip of the little finger)."""
_MAX_SIDE: Final = 32766
"""Maximum side of a picture that OpenCV can sample, in pixels."""


@dataclass(frozen=True)
class Hand:
    """One hand in one frame.

    Attributes:
        points: (21, 3) float32 landmarks, image-normalised: x / width, y / height, and depth z (0 at the wrist,
            negative towards the camera) in the scale of x. Order: wrist, then thumb, index, middle, ring and little
            finger, each from its base to its tip.
        world: (21, 3) float32 landmarks in metres relative to the hand's centre, with the axes of ``points``.
        handedness: The person's hand (the frame is not mirrored).
        handedness_score: 0.5 to 1.
        presence: Likelihood that there is a hand, 0 to 1.
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
        """The longer side of the landmarks' box, in pixels."""
        return float(np.ptp(self.pixels[:, :2], axis=0).max())

    @property
    def box_px(self) -> tuple[int, int, int, int]:
        """The landmarks' box: left, top, right and bottom in pixels; it may extend beyond the frame."""
        (left, top), (right, bottom) = self.pixels[:, :2].min(axis=0), self.pixels[:, :2].max(axis=0)
        return int(left), int(top), int(right) + 1, int(bottom) + 1


class Landmarker(Protocol):
    """Detects hands in frames, and tracks them from frame to frame."""

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands in ``image``; may be empty.

        Tracked hands come first and keep their order, then new ones by descending score.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored.
            search: Whether to search for further hands while one is tracked, which takes time.
            dt_s: Seconds since the last frame, >= 0, used to process fewer frames while nothing changes.

        Raises:
            FrameError: The image has another shape or type.
        """
        ...

    def look_again(self, image: NDArray[np.uint8], hand: Hand) -> Hand:
        """Return ``hand``, one of the last frame, ``image``, or the same hand located better, if it can be.

        A better one replaces it: it is tracked from then on. It is looked for only where a frame may take long: in
        photos, and in the first frame of a stream.
        """
        ...

    def second_opinion(self, image: NDArray[np.uint8], hand: Hand, *, mirrored: bool = False) -> Hand | None:
        """Return ``hand``, one of the last frame, ``image``, as it is seen in another way, if it surely is one so.

        ``hand`` stays the one that is tracked.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored.
            hand: The hand.
            mirrored: Whether to look at the mirrored image, which may show another shape.

        Returns:
            The hand as it is seen so; ``hand`` if it does not surely show one; None if this frame has no time for that
            and the mirrored look.
        """
        ...

    def follow_only(self, hand: Hand) -> None:
        """Stop tracking all hands of the last frame except ``hand``, to save time."""
        ...

    def reset(self) -> None:
        """Stop tracking all hands."""
        ...


@dataclass(frozen=True)
class SignGuess:
    """The sign of one hand in one frame.

    Attributes:
        sign: The likeliest sign, or ``NONE``.
        confidence: 0 to 1.
        likelihoods: The likelihood of each sign of the classifier, 0 to 1; may be empty.
    """

    sign: str
    confidence: float
    likelihoods: Mapping[str, float] = field(default_factory=dict, compare=False)


class Classifier(Protocol):
    """Recognises the sign from the landmarks of one hand; keeps no state between frames."""

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        ...

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows."""
        ...

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign`` with this ``likelihood``, 0 to 1."""
        ...


def check_picture(image: object) -> None:
    """Raise FrameError unless ``image`` is (height, width, 3) uint8, of 1 to 32766 pixels a side."""
    wanted = "expected a (height, width, 3) uint8 BGR image"
    if not isinstance(image, np.ndarray):
        raise FrameError(f"{wanted}, got {type(image).__name__}")
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        raise FrameError(f"{wanted}, got {image.shape} {image.dtype}")
    if not all(1 <= side <= _MAX_SIDE for side in image.shape[:2]):
        raise FrameError(f"{wanted} of 1 to {_MAX_SIDE} pixels a side, got {image.shape[1]}x{image.shape[0]}")
