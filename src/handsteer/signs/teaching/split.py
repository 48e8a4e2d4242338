"""Splits takes into folds, so that no person is in both training and test data."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from handsteer.signs.teaching.dataset import Dataset, Take

_FOLDS: Final = 3


@dataclass(frozen=True)
class Fold:
    """Takes that are held out together, and the rest, which are trained on."""

    held_out: tuple[Take, ...]
    rest: tuple[Take, ...]


def split(dataset: Dataset, labels: Sequence[str]) -> tuple[str, list[Fold]]:
    """Return the unit that is held out, ``person``, ``session`` or ``take``, and up to three folds.

    If a sign is shown by several persons, whole persons are held out, without their takes of signs that no other person
    shows. Otherwise sessions are held out if each label has several, else takes.

    Args:
        dataset: All takes, with at least two of each label.
        labels: The taught signs: only their takes are held out.
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
