"""Faces that take the place of the hand that drives: real models on pictures of people, without nodes."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.config import Config
from handsteer.teleop import Teleop
from tests.faults.stepped import Outcome

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FACES = 12
CLIP = "dex-retargeting_human_hand_video_1280x720.mp4"
"""A hand that closes to a fist after 8.4 s, for a second."""
OPEN_MS, FIST_MS, RISE_PX = 7_400.0, 8_700.0, 6
FPS = 30.0
AFTER_FRAMES = 60
LEAST_MPS = 0.1
FACE = 1.8
"""Width of a face with its hair, in lengths of the palm that it covers: of a person as far away as the hand."""

Picture = NDArray[np.uint8]


@dataclass
class Driver:
    """A robot that is driven by pictures.

    Attributes:
        speeds: What it was told after each of them, in m/s.
    """

    teleop: Teleop
    speeds: list[float]

    @classmethod
    def by(cls, mode: str) -> "Driver":
        config = Config.model_validate({"control": {"mode": mode, "arming": "off", "engage": "off"}})
        return cls(Teleop(config), [])

    def show(self, picture: Picture) -> None:
        noise = np.random.default_rng(len(self.speeds)).integers(-3, 4, picture.shape)
        noisy = np.clip(picture + noise, 0, 255).astype(np.uint8)
        self.speeds.append(self.teleop.step(noisy, 1 / FPS).linear_mps)

    def hand(self) -> tuple[NDArray[Any], float]:
        """Return the middle of the last hand's palm, and its length, in pixels."""
        assert self.teleop.recognition is not None
        assert self.teleop.recognition.hand is not None
        pixels = self.teleop.recognition.hand.pixels[:, :2]
        return pixels[[0, 5, 17]].mean(axis=0), float(np.linalg.norm(pixels[9] - pixels[0]))


def faces() -> list[Picture]:
    """Return faces of the photos of people with a webcam."""
    finder = cv2.CascadeClassifier(str(Path(cv2.__file__).parent / "data" / "haarcascade_frontalface_default.xml"))
    found: list[Picture] = []
    for path in sorted((DATA / "photos").rglob("emre*"))[::7]:
        photo = cv2.imread(str(path))
        if photo is None:
            continue
        for x, y, width, height in finder.detectMultiScale(photo, 1.1, 6, minSize=(50, 50))[:1]:
            edge = width // 4
            face = photo[max(0, y - edge) : y + height + edge, max(0, x - edge) : x + width + edge]
            found.append(np.asarray(face, np.uint8))
        if len(found) == FACES:
            break
    return found


def fists() -> Iterator[Picture]:
    """Yield a hand that is open and closes and, once it is a fist, goes up."""
    video = cv2.VideoCapture(str(DATA / "videos" / CLIP))
    video.set(cv2.CAP_PROP_POS_MSEC, OPEN_MS)
    raised_px = 0
    while (frame := video.read())[0]:
        raised_px += RISE_PX if video.get(cv2.CAP_PROP_POS_MSEC) > FIST_MS else 0
        yield np.asarray(np.roll(frame[1], -raised_px, axis=0), np.uint8)


def pointing() -> Iterator[Picture]:
    """Yield a hand that shows Forward."""
    photo = cv2.imread(str(sorted((DATA / "photos" / "forward").glob("emre*"))[0]))
    assert photo is not None
    while True:
        yield np.asarray(photo, np.uint8)


def outcome_of(mode: str, hand: Iterator[Picture], face: Picture) -> tuple[float, bool, str]:
    """Drive, then show a face in the hand's place; return the time to zero, whether it moved again, and the reason."""
    driver = Driver.by(mode)
    for picture in hand:
        driver.show(picture)
        if driver.speeds[-1] > LEAST_MPS:
            break
    assert driver.speeds[-1] > LEAST_MPS, f"{mode}: it does not drive to begin with: {driver.teleop.reason}"
    (x, y), palm_px = driver.hand()
    side = int(FACE * palm_px)
    left, top = (max(0, int(at - side / 2)) for at in (x, y))
    shown = np.full_like(picture, 120)
    place = shown[top : top + side, left : left + side]
    place[:] = cv2.resize(face, (side, side))[: place.shape[0], : place.shape[1]]
    began = len(driver.speeds)
    for _ in range(AFTER_FRAMES):
        driver.show(shown)
    after = [speed != 0.0 for speed in driver.speeds[began:]]
    until = after.index(False) if False in after else AFTER_FRAMES
    return until / FPS, any(after[until:]), driver.teleop.reason


def outcomes() -> list[Outcome]:
    """Return what becomes of each way to drive, of all faces the worst; needs the photos and clips."""
    found = []
    for words, mode, hand in (
        ("the fist that drives", "joystick", fists),
        ("the hand that shows Forward", "signs", pointing),
    ):
        each = [outcome_of(mode, hand(), face) for face in faces()]
        zero_s, again = max(zero_s for zero_s, _, _ in each), any(again for _, again, _ in each)
        found.append(Outcome("camera", f"a face takes the place of {words}", zero_s, again, True, each[0][2]))
        print(found[-1], file=sys.stderr, flush=True)  # noqa: T201 - it takes minutes
    return found
