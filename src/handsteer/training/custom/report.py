"""The results of a training: how well custom signs are distinguished from each other and from all other hands."""

from dataclasses import dataclass
from typing import Any

from handsteer.training.custom.checks import Lookalike
from handsteer.training.custom.dataset import LabelSummary
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import Confusion
from handsteer.types import NONE


@dataclass(frozen=True)
class CustomSignFigures:
    """How well a sign was learnt.

    Attributes:
        summary: The amount of its data.
        sided: Whether its mirror image is not the same sign.
        threshold: Likelihood threshold.
        recall: Of the held-out rows, how many were right; None if it could not be held out, because only one person
            showed it and others showed other signs.
    """

    summary: LabelSummary
    sided: bool
    threshold: float
    recall: Share | None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        recall = self.recall.as_dict() if self.recall else None
        return {**self.summary.as_dict(), "sided": self.sided, "threshold": round(self.threshold, 4), "recall": recall}


@dataclass(frozen=True)
class TrainingReport:
    """How well the signs were learnt.

    Attributes:
        signs: The results of each sign.
        held_out: The held-out unit: ``person``, ``session`` or ``take``.
        confusion: Held-out rows, both hands, by true and recognised sign.
        made: Of synthetic hands of all shapes, how many are recognised as one of the signs; some truly show it.
        known: Hands of the takes that are recognised as a shipped sign, which overrides the taught one.
    """

    signs: tuple[CustomSignFigures, ...]
    held_out: str
    confusion: Confusion
    made: Share
    known: tuple[Lookalike, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "signs": [sign.as_dict() for sign in self.signs],
            "held_out": self.held_out,
            "confusion": self.confusion.as_dict(),
            "made_hands": self.made.as_dict(),
            "known": [{"sign": each.label, "told": each.sign, **each.hands.as_dict()} for each in self.known],
        }


def how_it_was_tried(report: TrainingReport) -> str:
    """Return how the figures were measured, without a full stop."""
    tried = f"Recognition of held-out hands, one {report.held_out} at a time"
    return tried if report.held_out == "person" else f"{tried}; not yet tested on other persons"


def false_hands(report: TrainingReport) -> str:
    """Return how many hands of any shape are recognised as one of the signs."""
    rate = f"{report.made.rate or 0.0:.1%}"
    return f"Of synthetic hands of all shapes, {rate} are recognised as one of these signs; some do show it."


def mistakes(report: TrainingReport) -> list[str]:
    """Return the confusions of signs, the most frequent first; may be empty."""
    labels, counts = report.confusion.labels, report.confusion.counts
    found = [
        (count / sum(row), f"{shown} is mistaken for {_sign(seen)} {count} of {sum(row)} times")
        for shown, row in zip(labels, counts, strict=True)
        for seen, count in zip(labels, row, strict=True)
        if count and shown != seen
    ]
    found += [
        (hands.rate or 0.0, f"{each.label} is mistaken for {each.sign} {hands.count} of {hands.of} times")
        for each in report.known
        for hands in [each.hands]
    ]
    return [words for _, words in sorted(found, key=lambda item: -item[0])]


def _sign(seen: str) -> str:
    return "no sign" if seen == NONE else seen
