"""Recognition of signs on photos of people, by source, with 95 % intervals.

Run ``python benchmarks/signs.py`` (``make bench-signs``). The photos are not part of the repository; docs/signs.md
describes their folders. By default the report part is used, on which nothing was tuned; use the other part (``--part
tune``) during development. Each photo is evaluated raw and flipped, with ``--tilt`` also rotated; forward photos
rotated by 180 degrees give Backward, thumbs up and down rotated by 90 degrees give turns. Misses count as wrong.
"""

import argparse
import itertools
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import cv2

from handsteer.recognition.recognizer import Recognizer
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.labels import LabelledPhoto, read_photo_labels
from handsteer.training.evaluation.photo_metrics import PhotoResult
from handsteer.training.evaluation.sources import evaluate_photos
from handsteer.training.evaluation.views import View
from handsteer.training.synthetic.fit import part_of
from handsteer.types import FORWARD, MOTION_SIGNS, NONE, SIGNS, TURN_LEFT, TURN_RIGHT

DATA = Path(__file__).parents[2] / "shared" / "data"
FOLDERS = ("hagrid-dev", "photos")
THUMBS = ("thumb_up", "thumb_down", "like", "dislike")
TURNS = (TURN_LEFT, TURN_RIGHT)


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the signs on photos of people.")
    parser.add_argument(
        "--data", type=Path, default=DATA, help="folder that contains the folders hagrid-dev and photos"
    )
    parser.add_argument("--part", choices=("report", "tune"), default="report", help="part of the photos")
    parser.add_argument(
        "--tilt", type=float, nargs="+", default=[0.0], help="degrees to rotate them by, one after the other"
    )
    parser.add_argument("--mistakes", action="store_true", help="also list each wrongly recognised photo")
    options = parser.parse_args()
    photos = [photo for folder in FOLDERS for photo in read_photos(options.data / folder, options.part)]
    if not photos:
        raise SystemExit(f"{options.data} contains none of the folders {', '.join(FOLDERS)}; set another with --data")
    cv2.setNumThreads(1)
    results = list(look_at(photos, options.tilt))
    print(f"the part to {options.part}, {len(photos)} photos, {len(results)} views")
    print(f"{'':36}{'right, %':>24}{'of the hands found':>26}{'moved by mistake':>26}")
    groups = defaultdict(list)
    for group, result in results:
        groups[result.person_set, group].append(result)
        if result.truth == NONE:
            groups["all", "no sign"].append(result)
    for (source, group), members in sorted(groups.items()):
        print_row(f"{source:8} {group}", members)
    if options.mistakes:
        for group, result in results:
            if result.seen != result.truth:
                print(f"{result.path} {group}: {result.truth} seen as {result.seen} {result.confidence:.2f}")


def read_photos(folder: Path, part: str) -> list[LabelledPhoto]:
    """Return the photos of one part of a folder; none if it does not exist."""
    if not folder.is_dir():
        return []
    return [photo for photo in read_photo_labels(folder, SIGNS) if part_of(photo.path, photo.person_set) == part]


def look_at(photos: list[LabelledPhoto], tilts: list[float]) -> Iterator[tuple[str, PhotoResult]]:
    """Yield the row of the table and the result of each photo in each view."""
    recognizer = Recognizer()
    forward = [photo for photo in photos if photo.truth == FORWARD]
    thumbs = [photo for photo in photos if photo.kind in THUMBS]
    turned = [(photos, 0.0), (forward, 180.0), (thumbs, 90.0), (thumbs, -90.0)]
    for (some, turn), tilt, flip in itertools.product(turned, tilts, (False, True)):
        for result in evaluate_photos(some, recognizer, View(flip=flip, rotate_deg=turn + tilt)):
            yield group_of(result, turn), result


def group_of(result: PhotoResult, turn: float) -> str:
    """Return the row of a result in a view that is rotated by ``turn`` degrees."""
    if result.truth == NONE:
        return f"no sign: {result.kind}"
    if result.truth in TURNS:
        return "Turn, thumbs rotated by 90" if turn else "Turn"
    return result.truth


def print_row(name: str, results: list[PhotoResult]) -> None:
    """Print how many were right, of all and of those with a hand, and how many moved the robot wrongly."""
    found = [result for result in results if result.hand_px is not None]
    shares = (right(results), right(found), moved(results))
    print(f"{name:36}{cell(shares[0]):>24}{cell(shares[1]):>26}{cell(shares[2]):>26}")


def right(results: list[PhotoResult]) -> Share:
    return Share(sum(result.seen == result.truth for result in results), len(results))


def moved(results: list[PhotoResult]) -> Share:
    moving = [result for result in results if result.seen != result.truth and result.seen in MOTION_SIGNS]
    return Share(len(moving), len(results))


def cell(share: Share) -> str:
    """Return a share in percent with its 95 % interval (Wilson) and its number."""
    if share.rate is None or share.interval is None:
        return "-"
    low, high = share.interval
    return f"{100 * share.rate:.1f} ({100 * low:.1f}-{100 * high:.1f}) of {share.of}"


if __name__ == "__main__":
    main()
