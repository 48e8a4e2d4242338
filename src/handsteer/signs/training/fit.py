"""Fits the statistics of real people's hands to labelled photos: ``python -m handsteer.signs.training.fit FOLDER...``.

Each folder has an ``index.csv`` (docs/signs-evaluate.md). Only photos of the part to tune on are looked at
(:mod:`handsteer.signs.training.split`). What is written holds means and spreads, no picture and no row of a person.
"""

import csv
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from tqdm import tqdm

from handsteer.cameras.files import read_photo
from handsteer.config import LandmarksConfig
from handsteer.hand.kinematics import Array
from handsteer.landmarks.mediapipe import MediaPipeLandmarker
from handsteer.landmarks.protocol import Hand
from handsteer.signs.labelled import INDEX
from handsteer.signs.training.people import COORDINATES, FILE, LEAST_HANDS, Distribution, save_people, to_canonical
from handsteer.signs.training.split import part_of
from handsteer.signs.training.truth import FIST, OPEN, OTHER, SHAPES, THUMB
from handsteer.signs.training.truth import INDEX as POINTING
from handsteer.signs.views import View
from handsteer.signs.vocabulary import NONE

_SHAPES: Final = {"Stop": OPEN, "Forward": POINTING, "Go": FIST, "Turn Right": THUMB, "Turn Left": THUMB}
_KINDS: Final = {
    **dict.fromkeys(("like", "dislike", "thumb_up", "thumb_down"), THUMB),
    **dict.fromkeys(("none", "hand_no_sign", "person_no_hand_sign"), "rest"),
    **dict.fromkeys(("rock", "horns"), "horns"),
    **dict.fromkeys(("three", "four", "other_digits"), "digits"),
}
"""Kinds of photos without a sign that are one kind of hand; others are kinds of their own."""
_CLUSTERS: Final = {"rest": 8, THUMB: 6, "digits": 4}
_DIRECTIONS: Final = 12
_RAISED: Final = 0.6
"""Of several hands the highest is the one that shows something, if it is not smaller than this share of the largest."""


def main() -> None:
    """Write the statistics of the photos in the folders named on the command line."""
    hands = defaultdict(list)
    for folder in map(Path, sys.argv[1:]):
        for kind, coordinates in seen_hands(folder):
            hands[kind].append(coordinates)
    fitted = [each for kind in sorted(hands) for each in fit(kind, np.array(hands[kind]))]
    save_people(tuple(fitted), FILE)


def seen_hands(folder: Path) -> Iterator[tuple[str, Array]]:
    """Yield the kind and the (105,) canonical coordinates of the hand in each photo of ``folder`` to tune on."""
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    with (folder / INDEX).open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["sign"]]
    for row in tqdm(rows, desc=folder.name, disable=None):
        if part_of(row["path"], row["person_set"]) != "tune":
            continue
        landmarker.reset()
        hands = landmarker.detect(View().picture(read_photo(folder / row["path"])))
        if hands:
            hand = _raised(hands)
            kind = _KINDS.get(row["kind"], row["kind"]) if row["sign"] == NONE else _SHAPES[row["sign"]]
            yield (
                kind,
                to_canonical(hand.pixels[None, :, :2].astype(np.float64), hand.world[None].astype(np.float64))[0],
            )


def _raised(hands: list[Hand]) -> Hand:
    largest = max(hand.longer_side_px for hand in hands)
    shown = [hand for hand in hands if hand.longer_side_px >= _RAISED * largest]
    return min(shown, key=lambda hand: float(hand.points[:, 1].mean()))


def fit(kind: str, hands: Array) -> list[Distribution]:
    """Return the distributions of (n, 105) hands of one kind; none of fewer than :data:`LEAST_HANDS` hands."""
    shape = SHAPES.index(kind if kind in SHAPES else OTHER)
    return [_normal(kind, shape, part) for part in _clusters(hands, _CLUSTERS.get(kind, 2))]


def _clusters(hands: Array, wanted: int) -> list[Array]:
    """Return ``hands`` in up to ``wanted`` groups of at least :data:`LEAST_HANDS`; all if they are too few."""
    for count in range(wanted, 1, -1):
        cv2.setRNGSeed(0)
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-5)
        labels = cv2.kmeans(hands.astype(np.float32), count, None, stop, 8, cv2.KMEANS_PP_CENTERS)[1][:, 0]  # type: ignore[call-overload]
        groups = [hands[labels == each] for each in range(count)]
        if min(map(len, groups)) >= LEAST_HANDS:
            return groups
    return [hands] if len(hands) >= LEAST_HANDS else []


def _normal(kind: str, shape: int, hands: Array) -> Distribution:
    mean = hands.mean(axis=0)
    _, sizes, axes = np.linalg.svd(hands - mean, full_matrices=False)
    directions = axes[:_DIRECTIONS] * (sizes[:_DIRECTIONS, None] / np.sqrt(len(hands) - 1))
    along = (hands - mean) @ axes[:_DIRECTIONS].T @ axes[:_DIRECTIONS]
    rest = np.sqrt(((hands - mean - along) ** 2).mean(axis=0)).reshape(COORDINATES)
    return Distribution(kind, shape, len(hands), mean, directions, rest)


if __name__ == "__main__":
    main()
