"""How well signs are told on photos of people that the model never saw, beside what is wanted.

Run ``python benchmarks/signs.py`` (``make bench-signs``). The photos are not part of the repository; see docs/signs.md
for what a folder of them looks like. Each is looked at raw and flipped, as a stream of its own; forward photos turned
by 180 degrees give Backward, thumbs up and down turned by 90 degrees give more of the turns. Misses count as wrong.
"""

import argparse
import csv
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from handsteer.config import Config
from handsteer.graph import open_recognizer
from handsteer.signs.recognizer import Recognition, Recognizer
from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, MOTION_SIGNS, NONE, STOP, TURN_LEFT, TURN_RIGHT

DATA = Path(__file__).parents[2] / "shared" / "data"
# Least recall wanted, and the tutorial's own classifier on photos like these: raw, and with the other hand.
WANTED = {
    STOP: (98, "99"),
    FORWARD: (95, "48, flipped 20"),
    BACKWARD: (90, "29"),
    TURN_RIGHT: (90, "59, flipped 9"),
    TURN_LEFT: (90, "69, flipped 26"),
    GO: (92, "55"),
    "thumb turned": (88, ""),
}
OTHER_HAND = {TURN_RIGHT: TURN_LEFT, TURN_LEFT: TURN_RIGHT}


@dataclass(frozen=True)
class Seen:
    """What was told of one photo.

    Attributes:
        truth: The sign that it shows.
        group: The row of the table that it belongs to: the sign, or the kind of a photo without one.
        variant: ``raw`` or ``flipped``.
        sign: The sign that was told.
        size_px: Longer side of the hand that was looked at, pixels; 0 without one.
        confidence: Of the sign, 0 to 1.
        path: The photo.
    """

    truth: str
    group: str
    variant: str
    sign: str
    size_px: float
    confidence: float
    path: str


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the signs on photos and videos of people.")
    parser.add_argument("--data", type=Path, default=DATA, help="folder with photos/index.csv and videos/")
    parser.add_argument("--mistakes", action="store_true", help="also list each photo that was told wrong")
    options = parser.parse_args()
    if not (options.data / "photos" / "index.csv").exists():
        raise SystemExit(f"{options.data}: no photos/index.csv in it; name a folder with --data")
    cv2.setNumThreads(1)
    recognizer = open_recognizer(Config())
    seen = list(look_at_photos(options.data / "photos", recognizer))
    report_recall(seen)
    report_sizes(seen)
    report_negatives(seen)
    report_confidence(seen)
    for video in sorted((options.data / "videos").glob("*.mp4")):
        report_video(video, recognizer)
    if options.mistakes:
        report_mistakes(seen)


def look_at_photos(folder: Path, recognizer: Recognizer) -> Iterator[Seen]:
    """Yield what is told of each photo in each variant."""
    with (folder / "index.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["sign"]]
    for row in rows:
        image = prepared(cv2.imread(str(folder / row["path"])))
        for group, truth, picture in variants(image, row["sign"], row["kind"]):
            for variant, flipped in (("raw", picture), ("flipped", np.ascontiguousarray(picture[:, ::-1]))):
                expected = OTHER_HAND.get(truth, truth) if variant == "flipped" else truth
                recognizer.reset()
                recognition = recognizer.step(flipped, 0.0)
                size = size_px(recognition)
                name = group if group not in OTHER_HAND else expected
                confidence = recognition.confidence
                yield Seen(expected, name, variant, recognition.seen, size, confidence, row["path"])


def variants(image: np.ndarray, sign: str, kind: str) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield group, sign and picture of a photo and of what turning it gives."""
    yield (kind if sign == NONE else sign), sign, image
    if sign == FORWARD:
        yield BACKWARD, BACKWARD, cv2.rotate(image, cv2.ROTATE_180)
    if kind in ("thumb_up", "thumb_down"):
        # Turned clockwise, up becomes the image's right, which is the user's own left.
        right, left = (TURN_LEFT, TURN_RIGHT) if kind == "thumb_up" else (TURN_RIGHT, TURN_LEFT)
        yield "thumb turned", right, cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE)
        yield "thumb turned", left, cv2.rotate(image, cv2.ROTATE_90_COUNTERCLOCKWISE)


def prepared(image: np.ndarray) -> np.ndarray:
    """Return a photo as a camera would frame it: in small ones the hand fills the picture."""
    longer = max(image.shape[:2])
    if longer >= 400:
        return image
    border = int(0.3 * longer)
    image = cv2.copyMakeBorder(image, border, border, border, border, cv2.BORDER_REPLICATE)
    scale = 480 / max(image.shape[:2])
    return cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)


def size_px(recognition: Recognition) -> float:
    return float(np.ptp(recognition.hand.pixels[:, :2], axis=0).max()) if recognition.hand else 0.0


def report_recall(seen: list[Seen]) -> None:
    print(f"{'recall %':24} {'raw':>14} {'flipped':>14} {'wanted':>8}   tutorial")
    for group, (wanted, tutorial) in WANTED.items():
        cells = [right_share([s for s in seen if s.group == group and s.variant == v]) for v in ("raw", "flipped")]
        print(f"{group:24} {cells[0]:>14} {cells[1]:>14} {wanted:8}   {tutorial}")


def right_share(seen: list[Seen]) -> str:
    right = sum(s.sign == s.truth for s in seen)
    return f"{100 * right / len(seen):.1f} ({right}/{len(seen)})" if seen else "-"


def report_sizes(seen: list[Seen]) -> None:
    print("\nturns, by the longer side of the hand")
    turns = [s for s in seen if s.group in OTHER_HAND]
    for name, low, high in (("no hand", -1, 0), ("< 45 px", 0, 45), ("45 to 80 px", 45, 80), ("> 80 px", 80, 1e9)):
        print(f"{name:24} {right_share([s for s in turns if low < s.size_px <= high]):>14}")


def report_negatives(seen: list[Seen]) -> None:
    print(f"\n{'photos without a sign':24} {'motion raw':>14} {'flipped':>14}   any other sign")
    kinds = sorted({s.group for s in seen if s.truth == NONE})
    for kind in [*kinds, "all"]:
        photos = [s for s in seen if s.truth == NONE and kind in (s.group, "all")]
        cells = [motion_share([s for s in photos if s.variant == v]) for v in ("raw", "flipped")]
        still = Counter(s.sign for s in photos if s.sign not in (NONE, *MOTION_SIGNS))
        print(f"{kind:24} {cells[0]:>14} {cells[1]:>14}   {dict(still) or ''}")
    print("wanted                         <= 0.5 %       <= 0.5 %   tutorial: 4 %")
    fists = [s for s in seen if s.truth == GO]
    print(f"{'fists (Go)':24} {motion_share(fists):>14}   wanted <= 1 %, tutorial: 40 %")


def motion_share(seen: list[Seen]) -> str:
    moving = sum(s.sign in MOTION_SIGNS for s in seen)
    return f"{100 * moving / len(seen):.2f} ({moving}/{len(seen)})" if seen else "-"


def report_confidence(seen: list[Seen]) -> None:
    print("\nhow often a sign that was told is right, by its confidence")
    for low, high in ((0.7, 0.8), (0.8, 0.9), (0.9, 0.97), (0.97, 1.01)):
        print(f"{low:.2f} to {min(high, 1):.2f} {right_share([s for s in seen if low <= s.confidence < high]):>28}")


def report_video(path: Path, recognizer: Recognizer) -> None:
    """Print how often and from when to when each sign counts."""
    capture = cv2.VideoCapture(str(path))
    fps = capture.get(cv2.CAP_PROP_FPS)
    recognizer.reset()
    frames: Counter[str] = Counter()
    begins: dict[str, list[str]] = defaultdict(list)
    before = NONE
    number = 0
    while (image := capture.read()[1]) is not None:
        sign = recognizer.step(image, 1 / fps).sign
        frames[sign] += 1
        if sign not in (before, NONE):
            begins[sign].append(f"{number / fps:.1f}")
        before = sign
        number += 1
    print(f"\n{path.name}: {number} frames at {fps:.1f} a second, {dict(frames)}")
    for sign, times in begins.items():
        print(f"  {sign} begins at {' '.join(times)} s")


def report_mistakes(seen: list[Seen]) -> None:
    print("\nmistakes")
    for s in seen:
        if s.sign != s.truth:
            print(f"{s.path:55} {s.variant:8} {s.truth:11} told {s.sign} {s.confidence:.2f} {s.size_px:.0f} px")


if __name__ == "__main__":
    main()
