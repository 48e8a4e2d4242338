"""How surely people's hands engage by the gesture, and whether pictures that are shown in turn do.

The hands are those of ``../shared/data``: a clip in which a hand opens, closes and opens, played at its speed and
faster, in variations of place, size, direction, light and noise; and pairs of photos of a palm and a fist, moved to the
same place and size, changed at once or faded into each other.
"""

import argparse
import csv
import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import SensorNoise, read_photo, video_frames
from handsteer.recognition.engage_gesture import EngageGesture
from handsteer.recognition.features import KNUCKLES, PALM
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import GO, STOP

Picture = NDArray[np.uint8]

_DATA = Path(__file__).resolve().parents[2] / "shared/data"
_CLIP = "videos/dex-retargeting_human_hand_video_1280x720.mp4"
_DT_S = 1 / 30
_NOISE = SensorNoise(5)
# Frames in which its hand opens, closes and opens; and in which it closes, which backwards is an opening.
_GESTURES = {
    "as shown": [*range(236, 292)],
    "backwards": [*range(291, 235, -1)],
    "another fist, and back": [*range(592, 621), *range(620, 591, -1)],
}
_VIEWS = ((1.0, 0.0), (0.6, -15.0), (0.8, 15.0), (0.5, 0.0), (0.7, 10.0))
"""Sizes and directions, in degrees."""


def engages(recognizer: Recognizer, pictures: Iterable[Picture]) -> bool:
    """Return whether the gesture is seen in them."""
    recognizer.reset()
    gesture = EngageGesture()
    return any([gesture.step(recognizer.step(picture, _DT_S), _DT_S) for picture in pictures])


def variations(frames: list[Picture]) -> Iterator[list[Picture]]:
    """Yield ``frames`` in other places, sizes, directions, lights, and with noise."""
    random = np.random.default_rng(0)
    for mirrored, (size, degrees), noise, gain in itertools.product((False, True), _VIEWS, (0.0, 5.0), (1.0, 0.6)):
        height, width = frames[0].shape[:2]
        view = np.asarray(cv2.getRotationMatrix2D((width / 2, height / 2), degrees, size), np.float64)
        view[:, 2] += random.uniform(-60, 60, 2) * (1 - size) + np.array([0.0, 60.0])
        varied = []
        for frame in frames:
            flipped = cv2.flip(frame, 1) if mirrored else frame
            seen = cv2.warpAffine(flipped, view, (640, 480), borderMode=cv2.BORDER_REPLICATE) * gain
            varied.append(np.clip(seen + random.normal(0.0, noise, seen.shape), 0, 255).astype(np.uint8))
        yield varied


def hands_engage(recognizer: Recognizer) -> None:
    """Print how often people's hands engage."""
    frames = [
        cv2.resize(frame.image, (640, 360), interpolation=cv2.INTER_AREA) for frame in video_frames(_DATA / _CLIP)
    ]
    print("| hand | speed | engages |\n|---|---|---|")
    for (name, numbers), speed in itertools.product(_GESTURES.items(), (1.0, 1.5, 2.0)):
        shown = [frames[numbers[int(at)]] for at in np.arange(0, len(numbers), speed)]
        made = [engages(recognizer, pictures) for pictures in variations(shown)]
        print(f"| {name} | {speed:g} | {sum(made)} of {len(made)} |", flush=True)


def placed(picture: Picture, hand: Hand) -> Picture:
    """Return ``picture`` with the palm in the middle, upright and of one size."""
    pixels = hand.pixels[:, :2].astype(np.float64)
    centre, (right, down) = pixels[PALM].mean(axis=0), pixels[list(KNUCKLES)].mean(axis=0) - pixels[0]
    degrees = float(np.degrees(np.arctan2(right, -down)))
    size = 90.0 / float(np.hypot(right, down))
    view = np.asarray(cv2.getRotationMatrix2D(tuple(centre.tolist()), degrees, size), np.float64)
    view[:, 2] += np.array([320.0, 260.0]) - centre
    return np.asarray(cv2.warpAffine(picture, view, (640, 480), borderMode=cv2.BORDER_REPLICATE), np.uint8)


def pairs(recognizer: Recognizer, count: int) -> Iterator[tuple[Picture, Picture]]:
    """Yield pictures of strangers' palms and fists in the same place."""
    with (_DATA / "hagrid-dev/index.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    random = np.random.default_rng(0)

    def some(sign: str) -> Picture:
        paths = [row["path"] for row in rows if row["sign"] == sign]
        while True:
            picture = read_photo(_DATA / "hagrid-dev" / paths[random.integers(len(paths))])
            seen = recognizer.recognize(picture)
            if seen.hand is not None and recognizer.recognize(found := placed(picture, seen.hand)).seen == sign:
                return found

    for _ in range(count):
        yield some(STOP), some(GO)


def pictures_engage(recognizer: Recognizer, count: int) -> None:
    """Print how often pictures in turn engage."""
    shown = list(pairs(recognizer, count))
    print("\n| pictures of a palm and a fist in turn | engage |\n|---|---|")
    for name, held, faded in (("changed at once", 8, 0), ("faded in 0.2 s", 10, 6), ("faded in 0.5 s", 10, 15)):
        made = [engages(recognizer, in_turn(*pair, held=held, faded=faded)) for pair in shown]
        print(f"| {name}, 7 times | {sum(made)} of {len(made)} pairs |", flush=True)


def in_turn(palm: Picture, fist: Picture, *, held: int, faded: int) -> Iterator[Picture]:
    """Yield each for ``held`` frames with noise, and ``faded`` frames between them."""
    index = itertools.count()
    for turn in range(8):
        now, then = (fist, palm) if turn % 2 else (palm, fist)
        for share in [0.0] * held + [step / (faded + 1) for step in range(1, faded + 1)]:
            yield _NOISE.on(np.asarray(cv2.addWeighted(now, 1 - share, then, share, 0), np.uint8), next(index) * _DT_S)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=60, help="how many pairs of pictures")
    arguments = parser.parse_args()
    if not _DATA.is_dir():
        print("there are no hands of people: ../shared/data is absent")
        return
    recognizer = Recognizer()
    hands_engage(recognizer)
    pictures_engage(recognizer, arguments.pairs)


if __name__ == "__main__":
    main()
