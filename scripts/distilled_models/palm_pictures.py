"""Pictures to train the palm model with: hands of people in other surroundings, and what a camera makes of them."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.config import LandmarksConfig
from handsteer.plugins.teach.evaluation.labels import LabelledPhoto, read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.synthetic.fit import part_of
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.types import FORWARD, GO, SIGNS, STOP

Picture = NDArray[Any]
"""(192, 192, 3) float32 BGR, 0 to 255."""
Image = NDArray[Any]
"""(height, width, 3) uint8 BGR."""

SIDE: Final = 192
_SCENES: Final = "emre"
"""The people whose photos are whole scenes; those of all others are crops of hands."""
_WEIGHTS: Final = {FORWARD: 2.5, GO: 2.5, STOP: 0.6, "like": 2.0, "dislike": 2.0}
"""How often a photo is used, by its sign or kind, compared with the others: more of what is missed most."""
_EVERY: Final = 15
"""Of the videos, every 15th frame is used."""


class Pictures:
    """Makes pictures from the photos of the tuning part of ``folders``, and from videos; deterministic.

    Args:
        folders: Folders of photos with an ``index.csv``.
        videos: Videos of people, for what is behind hands.
        seed: Of all that is random.
    """

    def __init__(self, folders: list[Path], videos: list[Path], seed: int) -> None:
        self._random = np.random.default_rng(seed)
        photos = [photo for folder in folders for photo in read_photo_labels(folder, SIGNS)]
        photos = [photo for photo in photos if part_of(photo.path, photo.person_set) == "tune"]
        self._scenes = [_read(photo) for photo in photos if photo.person_set == _SCENES]
        self._hands = list(_hands([photo for photo in photos if photo.person_set != _SCENES]))
        weights = np.array([weight for _, _, weight in self._hands])
        self._weights = weights / weights.sum()
        self._frames = [frame for video in videos for frame in _frames(video)]

    def clean(self) -> Picture:
        """Return a scene, or none to two hands before another background."""
        if self.chance(0.45):
            return np.clip(self._scene(), 0, 255)
        picture = self._background()
        for _ in range(self._random.choice([1, 2, 0], p=[0.65, 0.25, 0.1])):
            picture = self._pasted(picture, (16, 150), may_fill=True)
        return np.clip(picture, 0, 255)

    def spoilt(self, clean: Picture) -> Picture:
        """Return ``clean`` in other light, blurred, with noise or compressed; more than half of them grey."""
        random, chance = self._random, self.chance
        picture: Picture = clean.copy()
        grey = chance(0.55)
        if chance(0.3):
            picture *= random.uniform(0.8, 1.2, 3).astype(np.float32)
        if chance(0.5):
            picture = 255 * np.power(np.clip(picture, 0, 255) / 255, math.exp(random.uniform(-0.8, 0.9)))
        if chance(0.45):
            contrast = random.uniform(0.3, 1.2)
            picture = picture * contrast + random.uniform(0, 255 * max(0, 1 - contrast))
        if chance(0.25):
            light = np.linspace(random.uniform(0.4, 1.2), random.uniform(0.4, 1.2), SIDE, dtype=np.float32)
            picture = picture * (light[None, :, None] if chance(0.5) else light[:, None, None])
        if chance(0.4):
            picture = cv2.GaussianBlur(picture, (0, 0), random.uniform(0.3, 1.3))
        if chance(0.25):
            side = int(random.uniform(80, 180))
            picture = cv2.resize(cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA), (SIDE, SIDE))
        if chance(0.5):
            colours = 1 if grey or chance(0.3) else 3
            picture = picture + random.normal(0, random.uniform(1, 14), (SIDE, SIDE, colours)).astype(np.float32)
        levels: Image = np.clip(picture, 0, 255).astype(np.uint8)
        if chance(0.3):
            quality = int(random.uniform(40, 92))
            compressed = cv2.imencode(".jpg", levels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
            levels = np.asarray(cv2.imdecode(compressed, cv2.IMREAD_COLOR))
        if grey:
            levels = cv2.cvtColor(cv2.cvtColor(levels, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
        return np.asarray(levels, np.float32)

    def cut_off(self, picture: Picture) -> tuple[Picture, NDArray[np.bool_]]:
        """Return ``picture``, sometimes as if the frame ended in it, and which (192, 192) pixels are still seen.

        What is beyond is black, or repeats the last pixels.
        """
        seen = np.ones((SIDE, SIDE), np.bool_)
        if not self.chance(0.3):
            return picture, seen
        picture, width = picture.copy(), int(self._random.uniform(0.05, 0.4) * SIDE)
        beyond, last = (slice(0, width), width) if self.chance(0.5) else (slice(SIDE - width, SIDE), SIDE - width - 1)
        repeats = self.chance(0.5)
        if self.chance(0.5):
            picture[beyond], seen[beyond] = (picture[last : last + 1] if repeats else 0), False
        else:
            picture[:, beyond], seen[:, beyond] = (picture[:, last : last + 1] if repeats else 0), False
        return picture, seen

    def chance(self, share: float) -> bool:
        """Return True in this share, 0 to 1, of all calls."""
        return bool(self._random.random() < share)

    def _log_uniform(self, low: float, high: float) -> float:
        return math.exp(self._random.uniform(math.log(low), math.log(high)))

    def _scene(self) -> Picture:
        image: Image = self._scenes[self._random.integers(len(self._scenes))]
        side = max(image.shape[:2]) * self._log_uniform(0.35, 1.35)
        if self.chance(0.5) and side > SIDE:  # averaged, not sampled
            scale = SIDE / side
            image, side = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), SIDE
        size = np.array(image.shape[1::-1])
        centre = size / 2 + self._random.uniform(-0.5, 0.5, 2) * abs(size - side)
        scale, turn = side / SIDE, self._random.normal(0, 0.2)
        axes = scale * np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        to_image = np.column_stack([axes, centre - axes @ np.full(2, SIDE / 2)])
        border = cv2.BORDER_CONSTANT if self.chance(0.7) else cv2.BORDER_REPLICATE
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        picture: Picture = cv2.warpAffine(image, to_image, (SIDE, SIDE), flags=flags, borderMode=border)
        picture = np.ascontiguousarray(picture[:, :: -1 if self.chance(0.5) else 1], np.float32)
        return self._pasted(picture, (12, 60), may_fill=False) if self.chance(0.25) else picture

    def _background(self) -> Picture:
        kind = self._random.random()
        image: Image
        if kind < 0.35 and self._frames:
            image = self._frames[self._random.integers(len(self._frames))]
        elif kind < 0.8:
            image, _, _ = self._hands[self._random.integers(len(self._hands))]
            third = round(0.35 * len(image))
            image = image[:third] if self.chance(0.5) else image[:, :third]
        else:
            cells = self._random.uniform(0, 255, (*self._random.integers(2, 12, 2), 3)).astype(np.uint8)
            image = cv2.resize(cells, (96, 96), interpolation=int(self._random.integers(3)))
        height, width = image.shape[:2]
        side = max(8, int(min(height, width) * self._log_uniform(0.3, 1.0)))
        x, y = (int(self._random.uniform(0, max(1, length - side))) for length in (width, height))
        part = cv2.resize(image[y : y + side, x : x + side], (SIDE, SIDE), interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(part[:, :: -1 if self.chance(0.5) else 1], np.float32)

    def _pasted(self, picture: Picture, sizes: tuple[float, float], *, may_fill: bool) -> Picture:
        """Return ``picture`` with a hand of a size, in pixels, between ``sizes``; or the hand's whole photo."""
        image: Image
        image, points, _ = self._hands[self._random.choice(len(self._hands), p=self._weights)]
        low, high = points.min(axis=0), points.max(axis=0)
        size = self._log_uniform(*sizes)
        scale = size / float((high - low).max())
        turn = self._random.normal(0, 0.35) if self.chance(0.85) else self._random.uniform(-math.pi, math.pi)
        mirror, place = (-1 if self.chance(0.5) else 1), self._random.uniform(0.12, 0.88, 2) * SIDE
        cos, sin = math.cos(turn), math.sin(turn)
        axes = scale * np.array([[mirror * cos, -sin], [mirror * sin, cos]])
        shift = place - axes @ ((low + high) / 2)
        if scale < 0.5:  # averaged first
            reduced = 1.5 * scale
            image = cv2.resize(image, None, fx=reduced, fy=reduced, interpolation=cv2.INTER_AREA)
            axes = axes / reduced
        to_picture = np.column_stack([axes, shift])
        seen: Picture = cv2.warpAffine(image, to_picture, (SIDE, SIDE), borderMode=cv2.BORDER_REPLICATE)
        if may_fill and self.chance(0.25):
            return np.asarray(seen, np.float32)
        mask: NDArray[Any] = np.zeros((SIDE, SIDE), np.float32)
        radii = ((high - low) * scale * self._random.uniform(0.62, 0.8) + 2).astype(int)
        cv2.ellipse(mask, place.astype(int).tolist(), radii.tolist(), math.degrees(turn), 0, 360, 1, -1)
        mask = cv2.GaussianBlur(mask, (0, 0), max(0.8, 0.06 * size))[..., None]
        return picture * (1 - mask) + seen * mask


def _read(photo: LabelledPhoto) -> Image:
    image = cv2.imread(str(photo.path))
    assert image is not None, photo.path
    return View().picture(np.asarray(image, np.uint8))


def _hands(photos: list[LabelledPhoto]) -> Iterator[tuple[Image, NDArray[np.float64], float]]:
    """Yield the picture of each photo in which a hand is found, (21, 2) its landmarks in pixels, and its weight."""
    landmarker = MediaPipeLandmarker(LandmarksConfig(model="full"))
    for photo in photos:
        image = _read(photo)
        landmarker.reset()
        hands = sorted(landmarker.detect(image), key=lambda hand: -hand.longer_side_px)
        if hands:
            weight = _WEIGHTS.get(photo.truth or "", 1.0) * _WEIGHTS.get(photo.kind, 1.0)
            yield image, hands[0].pixels[:, :2].astype(np.float64), weight


def _frames(path: Path) -> Iterator[Image]:
    video, number = cv2.VideoCapture(str(path)), 0
    while (read := video.read())[0]:
        if number % _EVERY == 0:
            yield np.asarray(cv2.resize(read[1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
        number += 1
