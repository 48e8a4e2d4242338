"""Which takes are held out together, so that nobody is on both sides of a test."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from handsteer.signs.teaching.dataset import Dataset, Take

_FOLDS: Final = 3


@dataclass(frozen=True)
class Fold:
    """Takes that are held out together, and what is learnt from meanwhile."""

    held_out: tuple[Take, ...]
    rest: tuple[Take, ...]


def split(dataset: Dataset, labels: Sequence[str]) -> tuple[str, list[Fold]]:
    """Return what is held out at a time, ``person``, ``session`` or ``take``, and up to three folds.

    Where a sign is shown by several persons, a person is never on both sides; what nobody else shows is not held out.
    Otherwise a session is on one side only if each label has several, else a take is.

    Args:
        dataset: All takes, with at least two of each label.
        labels: The signs that are taught: only takes of them are held out.
    """
    if any(len({take.person for take in dataset.of(label)}) > 1 for label in labels):
        return "person", _folds(dataset, labels, {take: take.person for take in dataset.takes})
    if all(len({(take.person, take.session) for take in dataset.of(label)}) > 1 for label in labels):
        return "session", _folds(dataset, labels, {take: (take.person, take.session) for take in dataset.takes})
    numbers = {take: number for label in dataset.labels for number, take in enumerate(dataset.of(label))}
    return "take", _folds(dataset, labels, numbers)


def _folds(dataset: Dataset, labels: Sequence[str], group_of: Mapping[Take, Hashable]) -> list[Fold]:
    groups = list(dict.fromkeys(group_of[take] for take in dataset.takes if take.label in labels))
    count = min(_FOLDS, len(groups))
    folds = []
    for number in range(count):
        out = set(groups[number::count])
        rest = tuple(take for take in dataset.takes if group_of[take] not in out)
        learnt = {take.label for take in rest}
        held_out = tuple(
            take for take in dataset.takes if group_of[take] in out and take.label in labels and take.label in learnt
        )
        if held_out:
            folds.append(Fold(held_out, rest))
    return folds
