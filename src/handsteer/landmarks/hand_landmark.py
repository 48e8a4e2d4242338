"""Finds the 21 landmarks of a hand in a region of a frame: MediaPipe's ``hand_landmark`` models.

The scaling of the outputs is as in MediaPipe 0.10.21's graph ``hand_landmark_cpu``.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.roi import Roi
from handsteer.landmarks.tflite import PictureModel

_DEPTH_SCALE: Final = 0.4
"""The model's depth is this much larger than its x and y."""

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Estimate:
    """What the model sees in a region.

    Attributes:
        pixels: (21, 3) x and y in pixels of the frame, z in the scale of x.
        world: (21, 3) in metres about the hand's centre, axes as ``pixels``.
        rightness: 0 to 1, how much it looks like a person's left (0) or right (1) hand in an unmirrored frame.
        presence: 0 to 1, how sure it is that there is a hand.
    """

    pixels: Array
    world: Array
    rightness: float
    presence: float


class HandLandmarkModel:
    """A hand landmark model.

    Args:
        path: The model file.
        threads: CPU threads to run it on.

    Raises:
        ModelCorrupt: The file is no model that can be run.
    """

    def __init__(self, path: Path, threads: int) -> None:
        self._model = PictureModel(path, threads)

    def estimate(self, image: NDArray[np.uint8], roi: Roi) -> Estimate:
        """Return what is seen in the region ``roi`` of ``image``, (height, width, 3) uint8 BGR."""
        side = self._model.side
        outputs = self._model.run(roi.crop(image, side, cv2.BORDER_REPLICATE))
        picture, presence, rightness, metric = outputs
        points = picture.reshape(21, 3) / side
        world = metric.reshape(21, 3)
        return Estimate(
            pixels=np.column_stack([roi.to_frame(points[:, :2]), points[:, 2] * (roi.side / _DEPTH_SCALE)]),
            world=np.column_stack([world[:, :2] @ roi.axes, world[:, 2]]),
            # MediaPipe calls this "Left", because it takes every picture for mirrored.
            rightness=float(rightness[0]),
            presence=float(presence[0]),
        )
