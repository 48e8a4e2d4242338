"""The photos of people for ``benchmarks/signs.py``: in which views they are recognised, and the row of each.

A row of a sign has only photos of people who show that sign. How a photo was changed is part of the row's name:
mirrored, tilted, or thumbs up and down turned by a quarter, which are no people's turns and have a row of their own.
"""

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from _sign_table import Row, row_of

from handsteer.cameras.files import read_photo
from handsteer.config import Config
from handsteer.plugins.teach.evaluation.labels import LabelledPhoto, read_photo_labels
from handsteer.plugins.teach.evaluation.sources import evaluate_photos
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.synthetic.fit import part_of
from handsteer.recognition.hand import Classifier, Hand, Landmarker
from handsteer.recognition.recognizer import Recognizer, open_classifier, open_landmarker
from handsteer.types import MOTION_SIGNS, NONE, SIGNS

FOLDERS: Final = ("hagrid-dev", "photos", "index-down", "thumbs-clip")
NO_SIGN, AT_REST, TURNED_THUMB = "no sign", "hand at rest", "turned thumb"
RAW, MIRRORED, TURNED, GREY = "raw", "mirrored", "turned by 90°", "grey"

_THUMBS = ("thumb_up", "thumb_down", "like", "dislike")
_TILTS_DEG = (15.0, 30.0)
_SAMPLED, _SAMPLED_NO_SIGN = 16, 6
"""Photos of the sample: of each set of people, for each sign and side of the hand, and for each kind without a sign."""
_WITH_SECOND_HAND = "emre"
"""The set of people whose other hand often hangs in the picture."""
_HANGS_DEG = 125.0
"""Smallest angle of a hanging hand's palm to upwards."""


@dataclass(frozen=True)
class Eyes:
    """The recognition that is measured, and the parts it consists of."""

    landmarker: Landmarker
    classifier: Classifier
    recognizer: Recognizer

    @classmethod
    def open(cls, classifier: Classifier | None = None) -> "Eyes":
        """Return the recognition with default parameters, with another ``classifier`` if given."""
        config = Config()
        landmarker, classifier = open_landmarker(config), classifier or open_classifier(config.signs)
        return cls(landmarker, classifier, Recognizer(config, landmarker=landmarker, classifier=classifier))


@dataclass(frozen=True)
class Seen:
    """What was recognised: whether it was right, whether it moves the robot by mistake, and a line on it."""

    right: bool
    moved: bool
    line: str


class Look(Protocol):
    """One picture to be recognised."""

    @property
    def row(self) -> Row:
        """Its row of the table."""
        ...

    @property
    def in_sample(self) -> bool:
        """Whether it belongs to the sample."""
        ...

    def take(self, eyes: Eyes) -> Seen:
        """Recognise it."""
        ...


@dataclass(frozen=True)
class PhotoLook:
    """A photo in a view."""

    row: Row
    in_sample: bool
    photo: LabelledPhoto
    view: View

    def take(self, eyes: Eyes) -> Seen:
        """Recognise the photo."""
        (result,) = evaluate_photos([self.photo], eyes.recognizer, self.view)
        right = result.seen == result.truth
        line = f"{result.path}, {self.view.name}: {result.truth} seen as {result.seen} {result.confidence:.2f}"
        return Seen(right, not right and result.seen in MOTION_SIGNS, line)


@dataclass(frozen=True)
class RestLook:
    """The second hand in a photo, if it hangs; it is right if it is found and does not move the robot.

    Of two hands that are found, the lower one hangs if its palm points down: all people of these photos raise the hand
    that shows something. Checked by eye on 140 of them: two are forearms, all others hang at a person's side.
    """

    row: Row
    in_sample: bool
    photo: LabelledPhoto

    def take(self, eyes: Eyes) -> Seen:
        """Recognise the hanging hand alone."""
        eyes.landmarker.reset()
        image = View().picture(read_photo(self.photo.path))
        hands = eyes.landmarker.detect(image)
        hands = sorted(hands, key=lambda hand: float(hand.points[:, 1].mean()))
        if len(hands) < 2 or _from_up_deg(hands[-1]) < _HANGS_DEG:
            return Seen(False, False, f"{self.photo.path}: no hanging hand found")
        guess = eyes.classifier.classify(hands[-1])
        if guess.sign == NONE or guess.confidence < Config().signs.min_confidence:
            guess = eyes.classifier.classify(eyes.landmarker.look_again(image, hands[-1]))
        moved = guess.sign in MOTION_SIGNS and guess.confidence >= Config().signs.min_confidence
        line = f"{self.photo.path}: hanging hand seen as {guess.sign} {guess.confidence:.2f}"
        return Seen(not moved, moved, line)


def _from_up_deg(hand: Hand) -> float:
    x, y = (hand.pixels[[5, 9, 13, 17], :2].mean(axis=0) - hand.pixels[0, :2]).tolist()
    return math.degrees(math.atan2(abs(x), -y))


def read_photos(data: Path) -> list[LabelledPhoto]:
    """Return the photos with a label in all folders of ``data``.

    Raises:
        LabelError: A folder is missing, or has no usable labels.
    """
    return [photo for name in FOLDERS for photo in read_photo_labels(data / name, SIGNS) if photo.truth is not None]


def digest(photos: Iterable[LabelledPhoto]) -> str:
    """Return a text that differs for photos of other names or labels."""
    lines = sorted(f"{photo.path.name},{photo.truth},{photo.kind},{photo.person_set}" for photo in photos)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def photo_looks(photos: list[LabelledPhoto]) -> Iterator[PhotoLook | RestLook]:
    """Yield all views of ``photos`` that are measured."""
    sample = _sample(photos)
    for photo in photos:
        part = part_of(photo.path, photo.person_set)
        for name, view in _views(photo, part):
            shown, _ = view.truth(photo.truth, photo.kind)
            if shown is None:
                continue
            title = TURNED_THUMB if name == TURNED else NO_SIGN if shown == NONE else shown
            row = row_of(part, photo.person_set, title, photo.kind, name)
            yield PhotoLook(row, photo in sample and name in (RAW, MIRRORED), photo, view)
        if photo.person_set == _WITH_SECOND_HAND:
            row = row_of(part, photo.person_set, AT_REST, "", RAW)
            yield RestLook(row, photo in sample and photo.truth != NONE, photo)


def _views(photo: LabelledPhoto, part: str) -> Iterator[tuple[str, View]]:
    """Yield the name and the view of each view of a photo.

    Mirrored photos are not tilted as well. Of the tuning photos, only those of whole scenes are tilted, and in grey:
    the crops are many, and those of the report part show the same. One man's, that limits are chosen on, are grey.
    """
    yield RAW, View()
    yield MIRRORED, View(flip=True)
    if photo.kind in _THUMBS:
        yield from ((TURNED, View(rotate_deg=quarter)) for quarter in (-90.0, 90.0))
    if part != "tune" or photo.person_set == _WITH_SECOND_HAND:
        for tilt in _TILTS_DEG:
            yield from ((f"tilted by {tilt:g}°", View(rotate_deg=side * tilt)) for side in (-1, 1))
    if part == "report" or photo.person_set == _WITH_SECOND_HAND:
        yield GREY, View(grey=True)


def _sample(photos: list[LabelledPhoto]) -> set[LabelledPhoto]:
    """Return the photos whose names have the smallest digests, so many of each set of people, sign and kind."""
    strata = defaultdict(list)
    for photo in photos:
        strata[photo.person_set, photo.truth, photo.kind].append(photo)
    chosen = set()
    for (_, truth, _), members in strata.items():
        members.sort(key=lambda photo: hashlib.sha256(photo.path.name.encode()).digest())
        chosen.update(members[: _SAMPLED_NO_SIGN if truth == NONE else _SAMPLED])
    return chosen
