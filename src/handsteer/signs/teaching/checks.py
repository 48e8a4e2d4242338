"""Checks a dataset before training."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from handsteer.errors import TrainingError
from handsteer.signs.classifier import Classifier
from handsteer.signs.intervals import Share
from handsteer.signs.metrics import Confusion
from handsteer.signs.teaching.dataset import Dataset, summarise
from handsteer.signs.trained import SURE
from handsteer.types import NONE, SIGNS, find_sign

_LEAST_TAKES: Final = 2
_LEAST_ROWS: Final = 10
_KNOWN_SHARE: Final = 0.3
_CONFUSED_SHARE: Final = 0.2


def taught_labels(dataset: Dataset, sided: Sequence[str]) -> tuple[str, ...]:
    """Return the labels of ``dataset`` that are new signs.

    Raises:
        TrainingError: There is none, two mean the same, or one of ``sided`` is not among them.
    """
    labels = tuple(label for label in dataset.labels if label not in (*SIGNS, NONE))
    if not labels:
        found = ", ".join(dataset.labels) or "nothing at all"
        raise TrainingError(f"there is no new sign to learn, only {found}: collect takes with a label of your own")
    for number, label in enumerate(labels):
        twin = find_sign(label, labels[:number])
        if twin:
            raise TrainingError(f"the labels {twin!r} and {label!r} mean the same sign: give both the same label")
    strangers = [name for name in sided if name not in labels]
    if strangers:
        raise TrainingError(f"--sided: there is no sign {strangers[0]!r} to learn; there are {', '.join(labels)}")
    return labels


def check_enough(dataset: Dataset, labels: Sequence[str]) -> None:
    """Raise TrainingError unless there are enough takes and hands of each of ``labels``."""
    for summary in summarise(dataset):
        if summary.label in labels and (summary.takes < _LEAST_TAKES or summary.rows < _LEAST_ROWS):
            raise TrainingError(
                f"too little of {summary.label}: {summary.takes} takes with {summary.rows} hands, and at least "
                f"{_LEAST_TAKES} takes with {_LEAST_ROWS} hands are needed; five takes of 3 s are good"
            )


@dataclass(frozen=True)
class Lookalike:
    """Hands of a new sign that are recognised as a known sign."""

    label: str
    sign: str
    hands: Share


def lookalikes(dataset: Dataset, labels: Sequence[str], shipped: Classifier) -> tuple[Lookalike, ...]:
    """Return which of ``labels`` the classifier ``shipped`` already recognises as a sign, and how often."""
    found = []
    for label in labels:
        told = [
            guess.sign if guess.confidence >= SURE else NONE
            for take in dataset.of(label)
            if not take.is_flat
            for guess in map(shipped.classify, take.hands)
        ]
        found += [Lookalike(label, sign, Share(told.count(sign), len(told))) for sign in shipped.signs if sign in told]
    return tuple(found)


def check_not_known(found: Sequence[Lookalike]) -> None:
    """Raise TrainingError if a new sign is often recognised as a known one."""
    for each in found:
        share = each.hands.rate or 0.0
        if share > _KNOWN_SHARE:
            raise TrainingError(
                f"{each.label} looks like {each.sign}: {share:.0%} of its hands are told as that already; "
                f"teach another shape, or give {each.sign} another action"
            )


def check_told_apart(likeliest: Confusion) -> None:
    """Raise TrainingError if a sign is often confused with another.

    ``likeliest`` has the likeliest signs of held-out hands, regardless of thresholds.
    """
    *labels, _ = likeliest.labels
    for row, label in enumerate(labels):
        shown = sum(likeliest.counts[row])
        for column, other in enumerate(labels):
            share = likeliest.counts[row][column] / shown if shown else 0.0
            if row != column and share > _CONFUSED_SHARE:
                raise TrainingError(
                    f"{label} looks like {other}: {share:.0%} of its hands that were held out are likelier to be that; "
                    f"teach shapes that differ more, or name both by --sided if one is the mirror image of the other"
                )
