"""What the landmark model says of a region of a frame, and which of several such estimates are of different hands."""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.hand import Hand
from handsteer.recognition.landmark_models import PictureModel
from handsteer.recognition.regions import Roi, from_landmarks

Array = NDArray[np.floating]

_DEPTH_SCALE: Final = 0.4
"""Factor of the model's depth relative to its x and y."""
SECOND_LOOK: Final = 1.15
"""Factor on MediaPipe's region in the second pass: of 57 misread hands of people, it corrects 12 more."""
SAME_HAND_OVERLAP: Final = 0.5
_PART: Final = 0.7


@dataclass(frozen=True)
class Estimate:
    """The model's output for a region.

    Attributes:
        pixels: (21, 3) x and y in pixels of the frame, z in the scale of x.
        world: (21, 3) in metres relative to the hand's centre, with the axes of ``pixels``.
        rightness: Likelihood, 0 to 1, of a person's right hand, rather than the left, in an unmirrored frame.
        presence: Likelihood that there is a hand, 0 to 1.
        is_rough: Whether it is the first of a new hand, whose second is due in the next frame.
    """

    pixels: Array
    world: Array
    rightness: float
    presence: float
    is_rough: bool = False

    @property
    def region(self) -> Roi:
        """The region of the hand for the next run."""
        region = from_landmarks(self.pixels[:, :2])
        return region.grown(SECOND_LOOK) if self.is_rough else region


def estimate_region(model: PictureModel, image: NDArray[np.uint8], roi: Roi, *, mirrored: bool = False) -> Estimate:
    """Return the output of a hand landmark model for the region ``roi`` of ``image``, optionally seen ``mirrored``."""
    seen = roi.crop(image, model.side, cv2.BORDER_REPLICATE)
    picture, presence, rightness, metric = model.run(np.asarray(cv2.flip(seen, 1), np.uint8) if mirrored else seen)
    points = picture.reshape(21, 3) / model.side
    world = metric.reshape(21, 3)
    right = float(rightness[0])
    if mirrored:
        points = points * (-1, 1, 1) + (1, 0, 0)
        world = world * np.array([-1, 1, 1], np.float32)
        right = 1 - right
    return Estimate(
        pixels=np.column_stack([roi.to_frame(points[:, :2]), points[:, 2] * (roi.side / _DEPTH_SCALE)]),
        world=np.column_stack([world[:, :2] @ roi.axes, world[:, 2]]),
        # MediaPipe calls this "Left", because it assumes mirrored pictures.
        rightness=right,
        presence=float(presence[0]),
    )


def distinct(regions: list[Roi]) -> list[Roi]:
    """Return ``regions`` without those of the same hand as an earlier one.

    MediaPipe instead keeps the last of such regions, which is the palm with the lower score.
    """
    kept: list[Roi] = []
    for region in regions:
        if all(region.overlap(other) <= SAME_HAND_OVERLAP for other in kept):
            kept.append(region)
    return kept


def of_different_hands(estimates: list[Estimate]) -> tuple[list[Estimate], list[Roi]]:
    """Return ``estimates`` and their regions, without duplicates of earlier hands and parts mistaken for a hand.

    Two regions may lead to the same hand, and some fingers of a hand to a smaller hand within it.
    """
    whole = [estimate for estimate in estimates if not any(_is_part(estimate, other) for other in estimates)]
    regions = [estimate.region for estimate in whole]
    kept = distinct(regions)
    return [each for each, region in zip(whole, regions, strict=True) if any(region is one for one in kept)], kept


def _is_part(estimate: Estimate, other: Estimate) -> bool:
    """Return whether ``estimate`` is much smaller than ``other`` and has its centre in its box."""
    low, high = estimate.pixels[:, :2].min(axis=0), estimate.pixels[:, :2].max(axis=0)
    other_low, other_high = other.pixels[:, :2].min(axis=0), other.pixels[:, :2].max(axis=0)
    centre = (low + high) / 2
    is_smaller = (high - low).max() < _PART * (other_high - other_low).max()
    return bool(is_smaller and (other_low <= centre).all() and (centre <= other_high).all())


def hand_of(estimate: Estimate, width: int, height: int) -> Hand:
    """Return the hand of ``estimate`` in a frame of that size in pixels."""
    right = estimate.rightness > 0.5
    return Hand(
        points=(estimate.pixels / (width, height, width)).astype(np.float32),
        world=estimate.world.astype(np.float32),
        handedness="Right" if right else "Left",
        handedness_score=max(estimate.rightness, 1 - estimate.rightness),
        presence=estimate.presence,
        image_size=(width, height),
    )
