"""Clips that Chromium takes for a webcam."""

import csv
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

FPS, SECONDS, TURN_S = 30, 120, 1.5
NOISE, QUALITY = 6, (cv2.IMWRITE_JPEG_QUALITY, 75)


def a_person(slideshow: Path, path: Path, signs: tuple[str, ...] = ("Stop", "Forward")) -> Path:
    """Write a clip of a person who shows ``signs`` in turn, as a camera sees it: no two pictures are the same."""
    photos = dict(_photos(slideshow, signs))
    random = np.random.default_rng(1)
    per_turn = int(TURN_S * FPS)
    with path.open("wb") as out:
        for number in range(SECONDS * FPS):
            photo = photos[signs[number // per_turn % len(signs)]]
            noisy = np.clip(photo + random.integers(-NOISE, NOISE + 1, photo.shape, np.int16), 0, 255)
            out.write(cv2.imencode(".jpg", noisy.astype(np.uint8), QUALITY)[1].tobytes())
    return path


def _photos(slideshow: Path, signs: tuple[str, ...]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield each of ``signs`` with the first photo of it."""
    with slideshow.with_suffix(".labels.csv").open() as file:
        sign_of = {int(row["frame"]): row["sign"] for row in csv.DictReader(file)}
    wanted = set(signs)
    video = cv2.VideoCapture(str(slideshow))
    for number in range(max(sign_of) + 1):
        image = video.read()[1]
        if sign_of.get(number) in wanted:
            wanted.remove(sign_of[number])
            yield sign_of[number], cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA)
