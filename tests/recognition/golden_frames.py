"""The pictures behind the golden landmarks: which they are and how they are read.

Both the tests and ``make_golden.py`` read them here, so that both see the same pixels.
"""

import csv
from pathlib import Path

import cv2
import numpy as np

DATA = Path(__file__).parents[3] / "shared" / "data"
VIDEO = DATA / "videos" / "dex-retargeting_human_hand_video_1280x720.mp4"
FIXTURE = Path(__file__).with_name("golden.npz")

PHOTOS_PER_SET = 24
VIDEO_FRAMES = 60
VIDEO_SIZE = (640, 360)


def photo_paths() -> list[str]:
    """Return photos of every kind from both sets of people, relative to the folder of photos."""
    with (DATA / "photos" / "index.csv").open(encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: row["path"])
    chosen = []
    for people in ("emre", "sld"):
        paths = [row["path"] for row in rows if row["person_set"] == people]
        chosen += paths[:: len(paths) // PHOTOS_PER_SET][:PHOTOS_PER_SET]
    return chosen


def read_photo(path: str) -> np.ndarray:
    """Return a photo as BGR; one below 400 px as a camera would frame it (see the README of the data)."""
    photo = cv2.imread(str(DATA / "photos" / path))
    assert photo is not None, path
    height, width = photo.shape[:2]
    if max(height, width) >= 400:
        return photo
    y, x = round(0.3 * height), round(0.3 * width)
    padded = cv2.copyMakeBorder(photo, y, y, x, x, cv2.BORDER_REPLICATE)
    return cv2.resize(padded, (480, 480), interpolation=cv2.INTER_LINEAR)


def read_video() -> list[np.ndarray]:
    """Return consecutive frames of a clip of one moving hand, made smaller, as BGR."""
    capture = cv2.VideoCapture(str(VIDEO))
    frames = [capture.read()[1] for _ in range(VIDEO_FRAMES)]
    capture.release()
    return [cv2.resize(frame, VIDEO_SIZE, interpolation=cv2.INTER_AREA) for frame in frames]
