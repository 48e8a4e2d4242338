"""Trains a model of taught signs, and measures how well it distinguishes them from all other hands."""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer import __version__
from handsteer.recognition.custom_signs import FORMAT, Array, CustomModel, Depth, custom_features
from handsteer.recognition.hand import Classifier
from handsteer.recognition.shipped_signs import SURE
from handsteer.training.custom.augmentation import mirrored, points_sideways, vary
from handsteer.training.custom.dataset import Dataset, Take, summarise
from handsteer.training.custom.report import (
    CustomSignFigures,
    TrainingReport,
    check_distinguished,
    check_enough,
    check_not_known,
    custom_labels,
    lookalikes,
    split,
)
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import Confusion
from handsteer.training.network import learn_novelty, train
from handsteer.training.synthetic.hands import Hands, make_hands
from handsteer.types import NONE

SEED: Final = 11
_HIDDEN: Final = (64, 32)
_EPOCHS: Final = 8
_OF_EACH: Final = 6_000
_MADE: Final = 50_000
"""Synthetic hands of all shapes to generate; about four of five have an unambiguous shape and are used."""
_LEAST_RECALL: Final = 0.975
_THRESHOLDS: Final = (0.7, 0.98)
_LIMIT_MARGIN: Final = 1.2
"""Factor on the distance limit of the takes and their variations."""


@dataclass(frozen=True)
class _Rows:
    """Hands with their classes."""

    pixels: Array
    world: Array
    classes: NDArray[np.int64]


def train_signs(
    dataset: Dataset,
    shipped: Classifier,
    *,
    sided: Sequence[str] = (),
    progress: Callable[[int, int], object] = lambda _done, _of: None,
) -> tuple[CustomModel, TrainingReport]:
    """Return a model that distinguishes the signs of ``dataset`` from all other hands, and its measured quality.

    Each sign is learnt for both hands, by mirroring, unless it points sideways. Examples of other hands are synthetic
    (:mod:`handsteer.training.synthetic`), and the takes of ``NONE`` and of shipped signs. To measure recall and set the
    thresholds, persons are held out in turn, or sessions or takes if no sign is shown by several persons. The model is
    then trained on all takes.

    Args:
        dataset: The takes.
        shipped: Recognises the shipped signs, which cannot be taught again.
        sided: Further signs, besides those that point sideways, whose mirror image is another sign or none.
        progress: Called with the number of completed steps and of all steps.

    Raises:
        TrainingError: There is no sign to learn or too little data of one, two labels mean the same or look alike, one
            looks like a shipped sign, or ``sided`` names an unknown sign.
    """
    labels = custom_labels(dataset, sided)
    check_enough(dataset, labels)
    known = lookalikes(dataset, labels, shipped)
    check_not_known(known)
    depth: Depth = "flat" if any(take.is_flat for take in dataset.takes) else "full"
    teacher = _Trainer(frozenset(sided) | _pointing_sideways(dataset, labels), depth)
    held_out, folds = split(dataset, labels)
    steps = _Steps(progress, of=_EPOCHS * (len(folds) + 1))
    tries = []
    for fold in folds:
        learnt = tuple(label for label in labels if any(take.label == label for take in fold.rest))
        tries.append(teacher.try_out(teacher.learn(fold.rest, learnt, steps), fold.held_out, labels))
    truths = np.concatenate([truth for truth, _ in tries] or [np.zeros(0, np.int64)])
    chances = np.concatenate([chance for _, chance in tries] or [np.zeros((0, len(labels)))])
    thresholds = _thresholds(truths, chances, len(labels))
    confusion = _confusion(truths, chances, thresholds, labels)
    check_distinguished(_confusion(truths, chances, np.zeros(len(labels)), labels))
    model = teacher.learn(dataset.takes, labels, steps, thresholds)
    made = _made(SEED + 1)
    report = TrainingReport(
        signs=tuple(_custom_signs(dataset, labels, teacher.sided, thresholds, confusion)),
        held_out=held_out,
        confusion=confusion,
        made=Share(int((model.confidences(made.pixels, made.world) >= SURE).any(axis=1).sum()), len(made.shapes)),
        known=known,
    )
    return model, report


class _Steps:
    """Counts epochs over several trainings."""

    def __init__(self, progress: Callable[[int, int], object], of: int) -> None:
        self._progress = progress
        self._of = of
        self._done = 0

    def __call__(self, _epoch: int) -> None:
        self._done += 1
        self._progress(self._done, self._of)


class _Trainer:
    """Trains models of taught signs.

    Attributes:
        sided: Signs that are not mirrored.
    """

    def __init__(self, sided: frozenset[str], depth: Depth) -> None:
        self.sided = sided
        self._depth = depth
        self._made = _made(SEED)

    def learn(
        self,
        takes: Sequence[Take],
        labels: tuple[str, ...],
        progress: Callable[[int], object],
        thresholds: Array | None = None,
    ) -> CustomModel:
        """Return a model of ``labels``, each of which occurs in ``takes``; other takes are examples of other hands."""
        random = np.random.default_rng(SEED)
        other = len(labels)
        rows = [
            self._varied([take for take in takes if take.label == label], number, random)
            for number, label in enumerate(labels)
        ]
        others = [take for take in takes if take.label not in labels]
        if others:
            rows.append(self._varied(others, other, random))
        rows.append(_Rows(self._made.pixels, self._made.world, np.full(len(self._made.shapes), other)))
        features = np.concatenate([custom_features(each.pixels, each.world, self._depth) for each in rows])
        classes = np.concatenate([each.classes for each in rows])
        network = train(features, classes, hidden=_HIDDEN, epochs=_EPOCHS, seed=SEED, progress=progress)
        mine = classes < other
        novelty = learn_novelty(features[mine], classes[mine], network.mean, network.scale, margin=_LIMIT_MARGIN)
        if thresholds is None:
            thresholds = np.full(other, SURE)
        return CustomModel(labels, self._depth, network, novelty, thresholds, self._facts(takes))

    def try_out(
        self, model: CustomModel, takes: Sequence[Take], labels: tuple[str, ...]
    ) -> tuple[NDArray[np.int64], Array]:
        """Return the (n,) true ``labels`` of ``takes``, as indices, and their (n, labels) confidences.

        Hands of signs that are not sided are evaluated mirrored too.
        """
        truths, chances = [], []
        columns = [labels.index(label) for label in model.labels]
        for take in takes:
            looks = [(take.pixels, take.world)]
            if take.label not in self.sided:
                looks.append((mirrored(take.pixels), mirrored(take.world)))
            for pixels, world in looks:
                of_all = np.zeros((len(pixels), len(labels)))
                of_all[:, columns] = model.confidences(pixels, world)
                truths.append(np.full(len(pixels), labels.index(take.label)))
                chances.append(of_all)
        return np.concatenate(truths), np.concatenate(chances)

    def _varied(self, takes: Sequence[Take], number: int, random: np.random.Generator) -> _Rows:
        pixels = np.concatenate([take.pixels for take in takes])
        world = np.concatenate([take.world for take in takes])
        both_hands = not any(take.label in self.sided for take in takes)
        pixels, world = vary(pixels, world, _OF_EACH, random, both_hands=both_hands)
        return _Rows(pixels, world, np.full(len(pixels), number))

    def _facts(self, takes: Sequence[Take]) -> Mapping[str, Any]:
        dataset = Dataset(tuple(takes))
        return {
            "format": FORMAT,
            "handsteer": __version__,
            "sources": sorted({take.source for take in takes}),
            "persons": len({take.person for take in takes}),
            "signs": [summary.as_dict() for summary in summarise(dataset)],
            "sided": sorted(self.sided),
            "made_hands": len(self._made.shapes),
            "seed": SEED,
        }


def _made(seed: int) -> Hands:
    return make_hands(_MADE, np.random.default_rng(seed))


def _thresholds(truths: NDArray[np.int64], chances: Array, count: int) -> Array:
    """Return the (labels,) likelihood thresholds: as high as most held-out rows of the sign allow."""
    thresholds = np.full(count, SURE)
    for label in range(count):
        mine = chances[truths == label, label]
        if mine.size:
            thresholds[label] = np.clip(
                np.quantile(mine[mine > 0], 1 - _LEAST_RECALL) if mine.any() else 0, *_THRESHOLDS
            )
    return thresholds


def _confusion(truths: NDArray[np.int64], chances: Array, thresholds: Array, labels: tuple[str, ...]) -> Confusion:
    best = chances.argmax(axis=1) if len(chances) else np.zeros(0, int)
    highest = chances[np.arange(len(best)), best]
    sure = (highest > 0) & (highest >= thresholds[best])
    names = (*labels, NONE)
    seen = np.where(sure, best, len(labels))
    return Confusion.of(((names[truth], names[guess]) for truth, guess in zip(truths, seen, strict=True)), labels)


def _pointing_sideways(dataset: Dataset, labels: Sequence[str]) -> frozenset[str]:
    rows = {label: np.concatenate([take.pixels for take in dataset.of(label)]) for label in labels}
    return frozenset(label for label, pixels in rows.items() if points_sideways(pixels))


def _custom_signs(
    dataset: Dataset, labels: tuple[str, ...], sided: Set[str], thresholds: Array, confusion: Confusion
) -> Iterable[CustomSignFigures]:
    summaries = {summary.label: summary for summary in summarise(dataset)}
    for number, label in enumerate(labels):
        counts = confusion.counts[number]
        recall = Share(counts[number], sum(counts)) if any(counts) else None
        yield CustomSignFigures(summaries[label], label in sided, float(thresholds[number]), recall)
