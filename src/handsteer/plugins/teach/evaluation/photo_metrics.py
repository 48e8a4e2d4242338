"""Figures of sign recognition in photos: recall, false commands, confusion matrix."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.types import NONE

SIZES = ("< 45 px", "45-80 px", "> 80 px", "no hand")
"""Longer side of the selected hand; ``no hand`` if none was found."""


@dataclass(frozen=True)
class PhotoResult:
    """The label of one photo, and its recognition.

    Attributes:
        path: The photo.
        kind: A further description; may be empty.
        truth: The correct sign, or ``NONE``.
        seen: The recognised sign.
        confidence: Of ``seen``, 0 to 1.
        hand_px: The longer side of the landmarks' box, in pixels; None if no hand was found.
        presence: The landmark model's hand presence, 0 to 1; None if no hand was found.
        person_set: The person, or the set of photos; may be empty.
        likelihoods: The likelihood of each sign, 0 to 1; empty if no hand was found.
    """

    path: str
    kind: str
    truth: str
    seen: str
    confidence: float
    hand_px: float | None
    presence: float | None = None
    person_set: str = ""
    likelihoods: Mapping[str, float] = field(default_factory=dict)

    @property
    def size(self) -> str:
        """Which of :data:`SIZES` the hand has."""
        if self.hand_px is None:
            return SIZES[3]
        return SIZES[0] if self.hand_px < 45 else SIZES[1] if self.hand_px <= 80 else SIZES[2]

    @property
    def likeliest(self) -> tuple[str, float]:
        """The likeliest sign, even below its threshold, and its likelihood; ``NONE`` and 0 without a hand."""
        return max(self.likelihoods.items(), key=lambda item: item[1], default=(NONE, 0.0))

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain values, for JSON."""
        return {
            "path": self.path,
            "kind": self.kind,
            "person_set": self.person_set,
            "truth": self.truth,
            "sign": self.seen,
            "confidence": round(self.confidence, 4),
            "likelihoods": {sign: round(value, 6) for sign, value in self.likelihoods.items()},
            "hand_found": self.hand_px is not None,
            "hand_px": None if self.hand_px is None else round(self.hand_px, 1),
            "presence": None if self.presence is None else round(self.presence, 4),
        }


@dataclass(frozen=True)
class Confusion:
    """A confusion matrix.

    Attributes:
        labels: The signs, ``NONE`` last.
        counts: A row for each true sign, with a column for each recognised sign.
    """

    labels: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, pairs: Iterable[tuple[str, str]], signs: Sequence[str]) -> "Confusion":
        """Count ``pairs`` of the true and the recognised sign; ``signs`` gives the order."""
        labels = (*signs, NONE)
        counts = [[0] * len(labels) for _ in labels]
        for truth, seen in pairs:
            counts[labels.index(truth)][labels.index(seen)] += 1
        return cls(labels, tuple(tuple(row) for row in counts))


@dataclass(frozen=True)
class Tally:
    """The counts of a set of labelled photos; signs that none of them shows are left out.

    Attributes:
        photos: Number of photos.
        recall: Of the photos of each sign, how many were right; a hand that is not found is wrong.
        recall_of_found: Likewise, of the photos in which a hand was found.
        wrong_motion: Of the photos of each sign, how many gave another sign that moves the robot.
        false_commands: Of all photos without a sign, how many gave one that moves the robot.
        false_alarms: For each recognised sign, of the photos that do not show it, how many gave it.
    """

    photos: int
    recall: dict[str, Share]
    recall_of_found: dict[str, Share]
    wrong_motion: dict[str, Share]
    false_commands: Share
    false_alarms: dict[str, Share]

    @property
    def false_motion(self) -> Share:
        """Of all photos, how many gave a sign that moves the robot but is not shown."""
        return Share(sum(share.count for share in self.wrong_motion.values()), self.photos)

    @property
    def wrong_motion_of_signs(self) -> Share:
        """Of all photos with a sign, how many gave another one that moves the robot."""
        shares = [share for sign, share in self.wrong_motion.items() if sign != NONE]
        return Share(sum(share.count for share in shares), sum(share.of for share in shares))

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "photos": self.photos,
            "recall": _plain(self.recall),
            "recall_of_found": _plain(self.recall_of_found),
            "wrong_motion": _plain(self.wrong_motion),
            "wrong_motion_of_signs": self.wrong_motion_of_signs.as_dict(),
            "false_commands": self.false_commands.as_dict(),
            "false_motion": self.false_motion.as_dict(),
            "false_alarms": _plain(self.false_alarms),
        }


@dataclass(frozen=True)
class PhotoReport(Tally):
    """The figures of a set of labelled photos.

    Attributes:
        unscored: Number of photos left out because their sign is ambiguous.
        without_depth: Number of hands left out because their landmarks have no depth.
        recall_by_size: ``recall`` for each of :data:`SIZES`.
        false_commands_by_kind: ``false_commands`` for each kind.
        by_person_set: The counts of each set of persons; empty if there is only one.
        confusion: The confusion matrix.
    """

    unscored: int
    without_depth: int
    recall_by_size: dict[str, dict[str, Share]]
    false_commands_by_kind: dict[str, Share]
    by_person_set: dict[str, Tally]
    confusion: Confusion

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            **super().as_dict(),
            "unscored": self.unscored,
            "without_depth": self.without_depth,
            "recall_by_size": {sign: _plain(sizes) for sign, sizes in self.recall_by_size.items()},
            "false_commands": {**self.false_commands.as_dict(), "kinds": _plain(self.false_commands_by_kind)},
            "by_person_set": {name: tally.as_dict() for name, tally in self.by_person_set.items()},
            "confusion": asdict(self.confusion),
        }


def tally(results: Collection[PhotoResult], signs: Sequence[str], motion: Collection[str]) -> Tally:
    """Return the counts of ``results``; the arguments are those of :func:`photo_report`."""
    every: dict[str, list[PhotoResult]] = {sign: [] for sign in (*signs, NONE)}
    for photo in results:
        every[photo.truth].append(photo)
    of_sign = {sign: photos for sign, photos in every.items() if photos}
    wrongly = Counter(photo.seen for photo in results if not _is_right(photo))
    wrong_motion = {
        sign: _share(photos, lambda photo: photo.seen in motion and not _is_right(photo))
        for sign, photos in of_sign.items()
    }
    return Tally(
        photos=len(results),
        recall={sign: _share(photos, _is_right) for sign, photos in of_sign.items()},
        recall_of_found={
            sign: _share((photo for photo in photos if photo.hand_px is not None), _is_right)
            for sign, photos in of_sign.items()
        },
        wrong_motion=wrong_motion,
        false_commands=wrong_motion.get(NONE, Share(0, 0)),
        false_alarms={sign: Share(wrongly[sign], len(results) - len(every[sign])) for sign in signs},
    )


def photo_report(
    results: Sequence[PhotoResult],
    signs: Sequence[str],
    motion: Collection[str],
    unscored: int = 0,
    without_depth: int = 0,
) -> PhotoReport:
    """Return the figures of ``results``.

    Args:
        results: The results of all photos.
        signs: The recognised signs, without ``NONE``, in the order of the tables.
        motion: The signs that move the robot.
        unscored: Number of photos left out.
        without_depth: Number of hands left out for missing depth.
    """
    whole = tally(results, signs, motion)
    sets = sorted({photo.person_set for photo in results})
    kinds = sorted({photo.kind for photo in results if photo.truth == NONE})

    def of(**wanted: str) -> list[PhotoResult]:
        return [photo for photo in results if all(getattr(photo, name) == value for name, value in wanted.items())]

    return PhotoReport(
        **vars(whole),
        unscored=unscored,
        without_depth=without_depth,
        recall_by_size={
            sign: {size: _share(of(truth=sign, size=size), _is_right) for size in SIZES} for sign in whole.recall
        },
        false_commands_by_kind={
            kind: _share(of(truth=NONE, kind=kind), lambda photo: photo.seen in motion) for kind in kinds
        },
        by_person_set={name: tally(of(person_set=name), signs, motion) for name in sets} if len(sets) > 1 else {},
        confusion=Confusion.of(((photo.truth, photo.seen) for photo in results), signs),
    )


def _is_right(photo: PhotoResult) -> bool:
    return photo.seen == photo.truth


def _share(photos: Iterable[PhotoResult], counts: Callable[[PhotoResult], bool]) -> Share:
    verdicts = [counts(photo) for photo in photos]
    return Share(sum(verdicts), len(verdicts))


def _plain(shares: dict[str, Share]) -> dict[str, Any]:
    return {name: share.as_dict() for name, share in shares.items()}
