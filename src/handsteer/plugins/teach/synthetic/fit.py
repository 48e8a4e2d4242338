"""Fits the statistics of people's hands to labelled photos.

``python -m handsteer.plugins.teach.synthetic.fit FOLDER...``

Each folder has an ``index.csv`` (docs/signs-evaluate.md). Only photos of the part ``tune`` are used (:func:`part_of`).
The result has means and variances, but no pictures and no person's landmarks.
"""

import hashlib
import itertools
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Final, Literal

import cv2
import numpy as np
from tqdm import tqdm

from handsteer.cameras.files import read_photo
from handsteer.config import LandmarksConfig
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.synthetic.hands import FIST, INDEX_DOWN, OPEN, OTHER, SHAPES, THUMB
from handsteer.plugins.teach.synthetic.hands import INDEX as POINTING
from handsteer.plugins.teach.synthetic.people import (
    COORDINATES,
    FILE,
    LEAST_HANDS,
    REST,
    Distribution,
    save_people,
    to_canonical,
)
from handsteer.plugins.virtual_hand import poses
from handsteer.plugins.virtual_hand.kinematics import ANGLES, Array, angles_of, clamp, pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole, Placement, orientation
from handsteer.plugins.virtual_hand.renderer import SKINS, Look, make_background, render
from handsteer.recognition.hand import Hand
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.types import NONE, SIGNS

Part = Literal["tune", "report", "choose"]

_WHOLE_SETS: Final[dict[str, Part]] = {"emre": "tune", "sld": "report", "arjav": "choose", "sara": "choose"}
"""Sets of few people, or of people who cannot be distinguished: each is in one part as a whole.

Photos of the part ``choose`` are measured, and limits are chosen by them, but no statistics are fitted to them.
"""

_SHAPES: Final = {"Stop": OPEN, "Forward": POINTING, "Go": FIST, "Turn Right": THUMB, "Turn Left": THUMB}
_KINDS: Final = {
    **dict.fromkeys(("like", "dislike", "thumb_up", "thumb_down"), THUMB),
    **dict.fromkeys(("none", "hand_no_sign", "person_no_hand_sign"), REST),
    **dict.fromkeys(("rock", "horns"), "horns"),
    **dict.fromkeys(("three", "four", "other_digits"), "digits"),
}
"""Maps kinds of photos without a sign to a common kind; others are kinds of their own."""
_SIZE: Final = (640, 480)
_SIDES: Final = 8
_DRAWN: Final = 45
_END_ON: Final = 0.85
_THUMB_ANGLES: Final = np.isin(np.arange(len(ANGLES)), range(2, 7))


def _with_thumb(thumb: Array, fingers: Array) -> Array:
    """Return the (23,) angles of ``fingers`` with those of the thumb from ``thumb``."""
    return np.where(_THUMB_ANGLES, thumb, fingers)


_ALONG: Final = angles_of(thumb_spread=20.0, thumb_opposition=14.0, thumb_mcp=6.0, thumb_ip=10.0)


def _bent(degrees: float) -> Array:
    """Return the (23,) angles of an index finger that is bent at its knuckle, as one that points down."""
    others = degrees / 4
    return poses.INDEX + angles_of(index_mcp=degrees, middle_mcp=others, ring_mcp=others, little_mcp=others)


_POSES: Final = (
    ("drawn", OPEN, poses.OPEN),
    ("drawn", POINTING, poses.INDEX),
    ("drawn", THUMB, poses.THUMB),
    ("drawn fist", FIST, poses.FIST),
    ("drawn fist", FIST, _with_thumb(_ALONG, poses.FIST)),
    ("drawn down", POINTING, _bent(45.0)),
    ("drawn down", INDEX_DOWN, _bent(75.0)),
    *(("drawn down", INDEX_DOWN, _with_thumb(poses.THUMB, _bent(bend))) for bend in (0.0, 30.0, 60.0)),
)
"""Kinds, shapes and angles of the virtual hand: among them a fist with its thumb over the fingers, and one with it
along them. Photos hardly show the backs of hands that point down, so their statistics are of drawn ones only."""
_CLUSTERS: Final = {REST: 8, THUMB: 6, "digits": 4}
_DIRECTIONS: Final = 12
_RAISED: Final = 0.6
"""Of several hands the highest is the one with the sign, unless it is smaller than this fraction of the largest."""


def part_of(path: PurePath | str, person_set: str = "") -> Part:
    """Return the part of a photo.

    Args:
        path: The photo; only its file name matters, so that folders may be moved.
        person_set: The column ``person_set`` of an ``index.csv``.
    """
    if person_set in _WHOLE_SETS:
        return _WHOLE_SETS[person_set]
    digest = hashlib.sha256(PurePath(path).name.encode()).digest()
    return "report" if digest[0] % 3 == 0 else "tune"


def main() -> None:
    """Write the statistics of the photos in the folders given on the command line."""
    if len(sys.argv) < 2:
        raise SystemExit("name the folders of labelled photos to fit to")
    hands = defaultdict(list)
    for folder in map(Path, sys.argv[1:]):
        for kind, coordinates in seen_hands(folder):
            hands[kind].append(coordinates)
    fitted = [each for kind in sorted(hands) for each in fit(kind, np.array(hands[kind]))]
    for kind, shape, drawn in drawn_hands():
        fitted += [_normal(kind, SHAPES.index(shape), drawn)]
    save_people(tuple(fitted), FILE)


def seen_hands(folder: Path, part: Part = "tune") -> Iterator[tuple[str, Array]]:
    """Yield the kind and the (105,) canonical coordinates of the hand in each photo of a part of ``folder``.

    Raises:
        LabelError: The folder has no usable labels.
    """
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for photo in tqdm(read_photo_labels(folder, SIGNS), desc=folder.name, disable=None):
        if photo.truth is None or part_of(photo.path, photo.person_set) != part:
            continue
        landmarker.reset()
        hands = landmarker.detect(View().picture(read_photo(photo.path)))
        if hands:
            kind = _KINDS.get(photo.kind, photo.kind) if photo.truth == NONE else _SHAPES[photo.truth]
            yield kind, _coordinates(_raised(hands))


def drawn_hands() -> Iterator[tuple[str, str, Array]]:
    """Yield kind, shape and (n, 105) canonical coordinates of rendered hands, viewed from several sides.

    Photos do not show all sides of a fist; rendered hands show what the landmark model reports for them.
    """
    # One each, so that poses of a new kind change no others.
    randoms = {kind: np.random.default_rng(0) for kind, _, _ in _POSES}
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    camera = Pinhole.webcam(*_SIZE)
    backgrounds = [make_background(kind, *_SIZE, seed) for seed, kind in enumerate(("plain", "cluttered"))]
    for (kind, shape, angles), side in tqdm(list(itertools.product(_POSES, range(_SIDES))), desc="drawn", disable=None):
        seen, random = [], randoms[kind]
        for number in range(_DRAWN):
            yaw = (side + random.uniform(-0.5, 0.5)) * 2 * np.pi / _SIDES
            turn = orientation(yaw=yaw, pitch=random.normal(0, 0.45), roll=random.normal(0, 0.3))
            joints = clamp(angles + random.normal(0, 0.07) + random.normal(0, 0.09, len(angles)))
            skeleton, placement = pose_skeleton(joints), Placement(turn, np.array([0.0, 0.0, random.uniform(0.4, 0.9)]))
            look = Look(skin=list(SKINS)[number % len(SKINS)], sleeve=number % 2 == 0)
            landmarker.reset()
            hands = landmarker.detect(render(skeleton, placement, camera, look, backgrounds[number % 4 // 2]))
            pointing = placement.apply(skeleton.joints[0])
            if hands and (shape == FIST or _is_tilted(pointing, shape)):
                seen.append(_coordinates(_raised(hands)))
        if len(seen) >= LEAST_HANDS:
            yield kind, shape, np.array(seen)


def _is_tilted(joints: Array, shape: str) -> bool:
    """Return whether the pointing part of (21, 3) joints of a shape is seen from the side, not end on."""
    start, end = {THUMB: (2, 4), POINTING: (5, 8), INDEX_DOWN: (5, 8), OPEN: (9, 12)}[shape]
    pointing = joints[end] - joints[start]
    return bool(abs(pointing[2]) <= _END_ON * np.linalg.norm(pointing))


def _coordinates(hand: Hand) -> Array:
    row: Array = to_canonical(hand.pixels[None, :, :2].astype(np.float64), hand.world[None].astype(np.float64))[0]
    return row


def _raised(hands: list[Hand]) -> Hand:
    largest = max(hand.longer_side_px for hand in hands)
    shown = [hand for hand in hands if hand.longer_side_px >= _RAISED * largest]
    return min(shown, key=lambda hand: float(hand.points[:, 1].mean()))


def fit(kind: str, hands: Array) -> list[Distribution]:
    """Return the distributions of (n, 105) hands of one kind; none for fewer than :data:`LEAST_HANDS` hands."""
    shape = SHAPES.index(kind if kind in SHAPES else OTHER)
    return [_normal(kind, shape, part) for part in _clusters(hands, _CLUSTERS.get(kind, 2))]


def _clusters(hands: Array, wanted: int) -> list[Array]:
    """Return ``hands`` in up to ``wanted`` groups of at least :data:`LEAST_HANDS`; none if they are too few."""
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
