"""Detects palms in a whole frame, with MediaPipe's ``palm_detection`` models.

The model is a single-shot detector: for each of 2016 anchors (positions in the picture) it gives a score, a box and
seven keypoints. Anchors, decoding and suppression follow MediaPipe 0.10.21's graph ``palm_detection_cpu``.
"""

from dataclasses import dataclass
from math import inf, log
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.landmark_models import PictureModel
from handsteer.recognition.roi import Roi, from_palm, whole_frame

_ANCHOR_GRIDS: Final = ((8, 2), (16, 6))
"""Side of a grid's cells in pixels of the model's input, and number of anchors at each cell's centre."""

_WRIST: Final = 0
_MIDDLE_BASE: Final = 2
_SAME_PALM_OVERLAP: Final = 0.3

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Palm:
    """One palm in a frame.

    Attributes:
        corners: (2, 2) top left and bottom right of its box, x and y in pixels.
        keypoints: (7, 2) in pixels: wrist, bases of index, middle, ring and little finger, two joints of the thumb.
        score: 0 to 1.
    """

    corners: Array
    keypoints: Array
    score: float

    @property
    def roi(self) -> Roi:
        """The region of its hand for the landmark model."""
        return from_palm(self.corners, self.keypoints[_WRIST], self.keypoints[_MIDDLE_BASE])


class PalmDetector:
    """A palm detection model.

    Args:
        path: The model file.
        threads: CPU threads to run it on.
        min_score: Minimum score of a palm, 0 to 1.

    Raises:
        ModelCorrupt: The file is not a model that can be run.
    """

    def __init__(self, path: Path, threads: int, min_score: float) -> None:
        self._model = PictureModel(path, threads)
        self._min_logit = _logit(min_score)
        self._anchors = _anchors(self._model.side)

    def detect(self, image: NDArray[np.uint8], limit: int, *, widened: float = 1.0) -> list[Palm]:
        """Return at most ``limit`` palms in ``image``, (height, width, 3) uint8 BGR, by descending score.

        ``widened`` enlarges the frame by this factor with a black border, so that hands appear smaller.
        """
        height, width = image.shape[:2]
        square = whole_frame(width, height, widened)
        values, logits = self._model.run(square.crop(image, self._model.side, cv2.BORDER_CONSTANT))
        logits = logits[:, 0]
        found = np.flatnonzero(logits >= self._min_logit)
        found = found[np.argsort(-logits[found], kind="stable")]
        points = _decoded(values[found] / self._model.side, self._anchors[found])
        merged = _merged(points, _sigmoid(logits[found]), limit)
        return [Palm(square.to_frame(each[:2]), square.to_frame(each[2:]), score) for each, score in merged]


def _anchors(side: int) -> Array:
    """Return the (n, 2) centres of the anchors, x and y from 0 to 1 across the picture, row by row in each grid."""
    grids = []
    for cell, per_cell in _ANCHOR_GRIDS:
        along = (np.arange(side // cell, dtype=np.float32) + 0.5) * (cell / side)
        x, y = np.meshgrid(along, along)
        centers = np.stack([x.ravel(), y.ravel()], axis=1)
        grids.append(np.repeat(centers, per_cell, axis=0))
    return np.concatenate(grids)


def _decoded(values: Array, anchors: Array) -> Array:
    """Return the boxes and keypoints of n candidates, 0 to 1 across the picture.

    Args:
        values: (n, 18) relative to the anchor: x and y of the box's centre, its width and height, 7 keypoints.
        anchors: (n, 2).

    Returns:
        (n, 9, 2): top left and bottom right of the box, then the keypoints.
    """
    points = values.reshape(-1, 9, 2)
    center, half_size = points[:, 0], points[:, 1] / 2
    corners = np.stack([center - half_size, center + half_size], axis=1)
    return np.concatenate([corners, points[:, 2:]], axis=1) + anchors[:, None]


def _merged(points: Array, scores: Array, limit: int) -> list[tuple[Array, float]]:
    """Return one candidate for each group that overlaps, the mean of the group weighted by score.

    This is MediaPipe's weighted non-maximum suppression. A candidate without an area overlaps nothing and is dropped.

    Args:
        points: (n, 9, 2) boxes and keypoints, by descending score.
        scores: (n,).
        limit: Maximum number of results.

    Returns:
        At most ``limit`` pairs of (9, 2) points and the best score of the group.
    """
    merged: list[tuple[Array, float]] = []
    while len(scores) and len(merged) < limit:
        same = _overlap(points[0, :2], points[:, :2]) > _SAME_PALM_OVERLAP
        if same[0]:
            merged.append((np.average(points[same], axis=0, weights=scores[same]), float(scores[0])))
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
