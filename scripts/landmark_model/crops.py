"""Crops of hands in photos, as the landmark model gets them, in two halves: for calibration and for evaluation."""

import csv
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from handsteer.config import LandmarksConfig
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.regions import from_landmarks

SIDE = 224
Half = Literal["choose", "judge"]


def photos(folders: list[Path], half: Half) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the name and the picture, BGR, of each photo of one half.

    No person is in both: the few people of the set ``emre`` are for evaluation, the students of ``sld`` for
    calibration; where each photo shows another person, a hash of its name decides.

    Args:
        folders: Each contains an ``index.csv`` with the columns ``path`` and ``person_set``.
        half: The half to yield.
    """
    for folder in folders:
        with (folder / "index.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            odd = hashlib.sha256(row["path"].encode()).digest()[0] % 2
            by_hash: Half = "choose" if odd else "judge"
            if {"emre": "judge", "sld": "choose"}.get(row["person_set"], by_hash) == half:
                photo = cv2.imread(str(folder / row["path"]))
                assert photo is not None, row["path"]
                yield row["path"], View().picture(np.asarray(photo, np.uint8))


def crops(folders: list[Path], half: Half) -> Iterator[np.ndarray]:
    """Yield a (224, 224, 3) uint8 RGB crop of each hand in the photos of one half, as for a tracked hand."""
    landmarker = MediaPipeLandmarker(LandmarksConfig(model="full"))
    for _, photo in photos(folders, half):
        landmarker.reset()
        for hand in landmarker.detect(photo):
            crop = from_landmarks(hand.pixels[:, :2]).crop(photo, SIDE, cv2.BORDER_REPLICATE)
            yield cv2.cvtColor(crop, cv2.COLOR_BGR2RGB)
