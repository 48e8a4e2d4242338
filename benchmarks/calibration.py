"""Errors of a person before and after a calibration on five views of each sign, and the motion of other people's hands.

Run ``python benchmarks/calibration.py``. Of each person, five random photos of each sign are shown to the calibration,
as they are and mirrored, and the others are judged in the same way; so it goes for several draws. Hands that are not
found are left out, as no classifier sees them; their number is printed. The hands of all other people count as they
are: those without a sign, and those that show another sign than the one that is read. People are those of photos that
are not part of the repository, and made-up ones: the virtual hand with other bones and joints, seen by the landmark
model.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from handsteer.cameras.files import read_photo
from handsteer.config import LandmarksConfig
from handsteer.errors import ProfileError
from handsteer.plugins.teach.calibration import calibrate, shown_hand
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.virtual_hand.kinematics import ANGLES, BONE_LENGTHS_M, clamp, pose_skeleton
from handsteer.plugins.virtual_hand.poses import HandPose, Pinhole, sign_pose
from handsteer.plugins.virtual_hand.poses import View as Look
from handsteer.plugins.virtual_hand.renderer import Look as Skin
from handsteer.plugins.virtual_hand.renderer import make_background, render
from handsteer.recognition.features import shape_features
from handsteer.recognition.hand import Classifier, Hand
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.profile import FLOOR, ProfiledClassifier, shape_probability
from handsteer.recognition.shipped_signs import SURE, ShippedClassifier, load_model
from handsteer.types import MOTION_SIGNS, NONE, SIGNS

DATA = Path(__file__).parents[2] / "shared" / "data"
SETS = {"index-down": "arjav", "thumbs-clip": "sara", "photos": "emre"}
NAMES = {"arjav": "one man, index fingers", "sara": "one person, thumbs", "emre": "three people together"}
OTHERS = ("photos", "hagrid-dev")
SHOWN, MADE_UP, VIEWS = 5, 6, 12
VIEWED = (View(), View(flip=True))


@dataclass
class Person:
    """The hands of a person, by photo; each photo as it is and mirrored, with the sign it shows then."""

    name: str
    photos: dict[str, list[list[tuple[str, list[Hand]]]]] = field(default_factory=lambda: defaultdict(list))


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure what a calibration changes, by person.")
    parser.add_argument("--data", type=Path, default=DATA, help="folder with the folders of photos")
    parser.add_argument("--draws", type=int, default=8, help="random choices of the five views")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    people = [*read_people(options.data, landmarker), *made_up_people(landmarker)]
    print_table(people, list(others(options.data, landmarker)), options.draws)


def print_table(people: Sequence[Person], others: list[tuple[str, str, Hand]], draws: int) -> None:
    """Print a row for each person; ``others`` are (person, sign, hand)."""
    shipped = ShippedClassifier(load_model())
    motions = {id(hand): moves(shipped, hand) for _, _, hand in others}
    others = [each for each in others if motions[id(each[2])] or could_move(shipped, each[2])]
    print(f"{'person':26}{'judged':>7}{'no hand':>8}{'errors before':>15}{'after':>7}{'ratio':>7}", end="")
    print(f"{'others move: no sign':>22}{'after':>7}{'new':>6}{'other sign':>12}{'after':>7}")
    totals = np.zeros(9)
    for person in people:
        counts = np.mean([draw(person, others, motions, shipped, seed) for seed in range(draws)], axis=0)
        totals += counts
        print_row(person.name, counts)
    print_row("all", totals)


def print_row(name: str, counts: np.ndarray) -> None:
    judged, lost, before, after, none, none_after, new, other, other_after = counts.tolist()
    ratio = f"{after / before:.2f}" if before else "-"
    print(f"{name:26}{judged:7.0f}{lost:8.0f}{before:15.1f}{after:7.1f}{ratio:>7}", end="")
    print(f"{none:22.1f}{none_after:7.1f}{new:6.1f}{other:12.1f}{other_after:7.1f}", flush=True)


def draw(
    person: Person, others: list[tuple[str, str, Hand]], motions: dict[int, str], shipped: ShippedClassifier, seed: int
) -> list[float]:
    """Return the counts of one draw, in the order of the table."""
    random = np.random.default_rng(seed)
    shown, judged = defaultdict(list), []
    for photos in person.photos.values():
        order = random.permutation(len(photos))
        chosen = [at for at in order if photos[at][0][1]][:SHOWN]
        for at in order:
            for sign, hands in photos[at]:
                if at not in chosen:
                    judged.append((sign, hands))
                elif (hand := shown_hand(hands, sign, shipped)) is not None:
                    shown[sign].append(hand)
    try:
        own: Classifier = ProfiledClassifier(shipped, calibrate("someone", shown, shipped).profile)
    except ProfileError:
        own = shipped
    found = [(sign, hands) for sign, hands in judged if hands]
    rows: list[float] = [len(found), len(judged) - len(found)]
    rows += [sum(read(classifier, hands) != sign for sign, hands in found) for classifier in (shipped, own)]
    after = {id(hand): moves(own, hand) for name, _, hand in others if name != person.name}
    for kind in (True, False):
        mine = [(sign, hand) for name, sign, hand in others if name != person.name and (sign == NONE) == kind]
        wrong = [{id(hand) for sign, hand in mine if by[id(hand)] not in ("", sign)} for by in (motions, after)]
        rows += [len(wrong[0]), len(wrong[1])] + ([len(wrong[1] - wrong[0])] if kind else [])
    return rows


def read(classifier: Classifier, hands: Sequence[Hand]) -> str:
    """Return the sign of the hand of a picture that is read with the highest confidence."""
    guesses = [guess for guess in map(classifier.classify, hands) if guess.sign != NONE and guess.confidence >= SURE]
    return max(guesses, key=lambda guess: guess.confidence).sign if guesses else NONE


def moves(classifier: Classifier, hand: Hand) -> str:
    """Return the sign with which ``hand`` moves the robot; empty if it does not."""
    guess = classifier.classify(hand)
    return guess.sign if guess.sign in MOTION_SIGNS and guess.confidence >= SURE else ""


def could_move(shipped: ShippedClassifier, hand: Hand) -> bool:
    """Return whether a profile could let ``hand`` move the robot: all others need not be read again."""
    shapes = shipped.model.probabilities(shape_features(hand.pixels[None, :, :2], hand.world[None])[0])
    return any(shape_probability(shapes, sign) >= FLOOR for sign in MOTION_SIGNS)


def read_people(data: Path, landmarker: MediaPipeLandmarker) -> Iterator[Person]:
    """Yield the people of whom there are several photos of a sign; none where the photos are absent."""
    for folder, person_set in SETS.items():
        if not (data / folder).is_dir():
            print(f"{data / folder} is absent: left out")
            continue
        person = Person(NAMES[person_set])
        for photo in read_photo_labels(data / folder, SIGNS):
            if photo.person_set == person_set and photo.truth not in (None, NONE):
                person.photos[photo.truth].append(seen(photo.path, photo.truth, landmarker))
        yield person


def seen(path: Path, truth: str, landmarker: MediaPipeLandmarker) -> list[tuple[str, list[Hand]]]:
    """Return the sign and the hands of a photo, as it is and mirrored."""
    looks = []
    for view in VIEWED:
        landmarker.reset()
        looks.append((view.truth(truth)[0] or NONE, landmarker.detect(view.picture(read_photo(path)))))
    return looks


def others(data: Path, landmarker: MediaPipeLandmarker) -> Iterator[tuple[str, str, Hand]]:
    """Yield each hand of other people, with its person and its sign."""
    for folder in (*OTHERS, "index-down", "thumbs-clip"):
        if (data / folder).is_dir():
            for photo in read_photo_labels(data / folder, SIGNS):
                if photo.truth is not None:
                    for sign, hands in seen(photo.path, photo.truth, landmarker):
                        yield from ((NAMES.get(photo.person_set, photo.person_set), sign, hand) for hand in hands)


def made_up_people(landmarker: MediaPipeLandmarker) -> Iterator[Person]:
    """Yield people with bones, joints and habits of their own: rendered hands, as the landmark model sees them."""
    for number in range(MADE_UP):
        random = np.random.default_rng(number)
        person = Person(f"made up {number + 1}")
        bones = BONE_LENGTHS_M * random.normal(1.0, 0.12, 20)
        for sign in SIGNS:
            meant = sign_pose(sign)
            bent = np.radians(random.normal(0, 16, len(ANGLES)))
            habit = random.normal(0, 0.25, 3)
            for _ in range(VIEWS):
                angles = clamp((meant.angles + bent + np.radians(random.normal(0, 4, len(ANGLES))))[None])[0]
                yaw, pitch, roll = habit + random.normal(0, 0.12, 3)
                view = meant.view
                pose = HandPose(angles, Look(view.yaw + yaw, view.pitch + pitch, view.roll + 0.5 * roll, view.position))
                person.photos[sign].append(rendered(pose, bones, sign, landmarker, random))
        yield person


def rendered(
    pose: HandPose, bones: np.ndarray, sign: str, landmarker: MediaPipeLandmarker, random: np.random.Generator
) -> list[tuple[str, list[Hand]]]:
    """Return the sign and the hands of a rendered picture, as it is and mirrored."""
    width, height = 320, 240
    image = render(
        pose_skeleton(pose.angles, bones),
        pose.view.placement("Right"),
        Pinhole.webcam(width, height),
        Skin(),
        make_background("cluttered", width, height, int(random.integers(1000))),
    )
    looks = []
    for view in VIEWED:
        landmarker.reset()
        looks.append((view.truth(sign)[0] or NONE, landmarker.detect(view.picture(image))))
    return looks


if __name__ == "__main__":
    main()
