"""How good signs are told in photos: recall, false commands, confusion matrix."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from handsteer.signs.vocabulary import NONE

SIZES = ("< 45 px", "45-80 px", "> 80 px", "no hand")
"""The longer side of the hand that was looked at; ``no hand`` where none was found."""


@dataclass(frozen=True)
class PhotoResult:
    """What one photo shows, and what was seen in it.

    Attributes:
        path: The photo.
        kind: What it shows in other words; may be empty.
        truth: The sign that it shows, or ``NONE``.
        seen: The sign that was seen.
        confidence: 0 to 1, how sure that was.
        hand_px: The longer side of the box about the landmarks, in pixels; None when no hand was found.
    """

    path: str
    kind: str
    truth: str
    seen: str
    confidence: float
    hand_px: float | None

    @property
    def size(self) -> str:
        """Which of :data:`SIZES` the hand has."""
        if self.hand_px is None:
            return SIZES[3]
        return SIZES[0] if self.hand_px < 45 else SIZES[1] if self.hand_px <= 80 else SIZES[2]


@dataclass(frozen=True)
class Share:
    """So many of so many."""

    count: int
    of: int

    @property
    def rate(self) -> float | None:
        """0 to 1; None of nothing."""
        return self.count / self.of if self.of else None

    def as_dict(self) -> dict[str, Any]:
        """Return the share as plain values, for JSON."""
        return {"count": self.count, "of": self.of, "rate": self.rate}


@dataclass(frozen=True)
class Confusion:
    """How often each sign was taken for each.

    Attributes:
        labels: The signs, ``NONE`` last.
        counts: A row for each true sign, in it a column for each sign that was seen.
    """

    labels: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, pairs: Iterable[tuple[str, str]], signs: Sequence[str]) -> "Confusion":
        """Count ``pairs`` of a true sign and the one that was seen; ``signs`` gives the order."""
        labels = (*signs, NONE)
        counts = [[0] * len(labels) for _ in labels]
        for truth, seen in pairs:
            counts[labels.index(truth)][labels.index(seen)] += 1
        return cls(labels, tuple(tuple(row) for row in counts))

    def as_dict(self) -> dict[str, Any]:
        """Return the matrix as plain values, for JSON."""
        return {"labels": self.labels, "counts": self.counts}


@dataclass(frozen=True)
class PhotoReport:
    """The figures of a set of labelled photos.

    Attributes:
        results: All scored photos.
        unscored: How many photos were left out, as nobody could say what they show.
        recall: Of the photos of each sign, how many were right; a hand that is not found is wrong.
        recall_by_size: Likewise, for each of :data:`SIZES`.
        wrong_motion: Of the photos of each sign, how many gave another sign that moves the robot.
        false_commands: Of all photos that show no sign, how many gave one that moves the robot.
        false_commands_by_kind: Likewise, for each kind.
        confusion: Which sign was taken for which.
    """

    results: tuple[PhotoResult, ...]
    unscored: int
    recall: dict[str, Share]
    recall_by_size: dict[str, dict[str, Share]]
    wrong_motion: dict[str, Share]
    false_commands: Share
    false_commands_by_kind: dict[str, Share]
    confusion: Confusion

    @property
    def wrong(self) -> list[PhotoResult]:
        """The photos in which another sign was seen than they show."""
        return [result for result in self.results if result.seen != result.truth]

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON; of the single photos those that were wrong."""
        return {
            "photos": len(self.results),
            "unscored": self.unscored,
            "recall": _plain(self.recall),
            "recall_by_size": {sign: _plain(sizes) for sign, sizes in self.recall_by_size.items()},
            "wrong_motion": _plain(self.wrong_motion),
            "false_commands": {**self.false_commands.as_dict(), "kinds": _plain(self.false_commands_by_kind)},
            "confusion": self.confusion.as_dict(),
            "wrong": [{**vars(result)} for result in self.wrong],
        }


def photo_report(
    results: Sequence[PhotoResult], signs: Sequence[str], motion: Collection[str], unscored: int = 0
) -> PhotoReport:
    """Return the figures of ``results``.

    Args:
        results: What was seen in each photo.
        signs: The signs that can occur, without ``NONE``, in the order of the tables.
        motion: Those that can move the robot.
        unscored: How many photos were left out.
    """

    def share(photos: Iterable[PhotoResult], counts: Callable[[PhotoResult], bool]) -> Share:
        verdicts = [counts(photo) for photo in photos]
        return Share(sum(verdicts), len(verdicts))

    def right(photo: PhotoResult) -> bool:
        return photo.seen == photo.truth

    def moves_wrongly(photo: PhotoResult) -> bool:
        return photo.seen in motion and not right(photo)

    of_sign = {sign: [photo for photo in results if photo.truth == sign] for sign in (*signs, NONE)}
    shown = {sign: photos for sign, photos in of_sign.items() if photos}
    negatives = of_sign[NONE]
    kinds = sorted({photo.kind for photo in negatives})
    return PhotoReport(
        results=tuple(results),
        unscored=unscored,
        recall={sign: share(photos, right) for sign, photos in shown.items()},
        recall_by_size={
            sign: {size: share((photo for photo in photos if photo.size == size), right) for size in SIZES}
            for sign, photos in shown.items()
        },
        wrong_motion={sign: share(photos, moves_wrongly) for sign, photos in shown.items()},
        false_commands=share(negatives, moves_wrongly),
        false_commands_by_kind={
            kind: share((photo for photo in negatives if photo.kind == kind), moves_wrongly) for kind in kinds
        },
        confusion=Confusion.of(((photo.truth, photo.seen) for photo in results), signs),
    )


def _plain(shares: dict[str, Share]) -> dict[str, Any]:
    return {name: share.as_dict() for name, share in shares.items()}
