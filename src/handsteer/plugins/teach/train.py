"""Trains a model of taught signs, and measures how well it distinguishes them from all other hands."""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer import __version__
from handsteer.errors import TrainingError
from handsteer.plugins.teach.augmentation import mirrored, points_sideways, vary
from handsteer.plugins.teach.dataset import Dataset, Take, summarise, typical_hand
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion
from handsteer.plugins.teach.network import learn_novelty, train
from handsteer.plugins.teach.report import (
    FOLDS,
    CustomSignFigures,
    Fold,
    LeftOut,
    Lookalike,
    Mistake,
    TrainingReport,
    custom_labels,
    lookalikes,
    most_confused,
    split,
    too_known,
    too_small,
)
from handsteer.plugins.teach.synthetic.hands import Hands, make_hands
from handsteer.recognition.custom_signs import FORMAT, Array, CustomModel, Depth, custom_features
from handsteer.recognition.hand import Classifier
from handsteer.recognition.shipped_signs import SURE
from handsteer.types import NONE, SIGNS

SEED: Final = 11
_HIDDEN: Final = (64, 32)
_EPOCHS: Final = 8
_OF_EACH: Final = 6_000
_MADE: Final = 50_000
"""Synthetic hands of all shapes to generate; about seven of ten have an unambiguous shape and are used."""
_LEAST_RECALL: Final = 0.975
_THRESHOLDS: Final = (0.7, 0.98)
_LIMIT_MARGIN: Final = 1.2
"""Factor on the distance limit of the takes and their variations."""


@dataclass(frozen=True)
class _Tried:
    """Held-out hands, and those mirrored.

    Attributes:
        truths: (n,) indices of their true signs.
        chances: (n, labels) confidences.
        takes: (n,) their takes.
        hands: (n,) their indices in their takes.
    """

    truths: NDArray[np.int64]
    chances: Array
    takes: tuple[Take, ...]
    hands: NDArray[np.int64]


def training_rows(signs: int) -> int:
    """Return how many rows a training of ``signs`` signs passes over at most, in all epochs and folds."""
    return (FOLDS + 1) * _EPOCHS * (signs * _OF_EACH + _MADE)


def train_signs(
    dataset: Dataset,
    shipped: Classifier,
    *,
    sided: Sequence[str] = (),
    progress: Callable[[int, int], object] = lambda _done, _of: None,
) -> tuple[CustomModel, TrainingReport]:
    """Return a model that distinguishes the signs of ``dataset`` from all other hands, and its measured quality.

    Each sign is learnt for both hands, by mirroring, unless it points sideways. Examples of other hands are synthetic
    (:mod:`handsteer.plugins.teach.synthetic`), and the takes of ``NONE`` and of shipped signs. To measure recall and
    set the thresholds, persons are held out in turn, or sessions or takes if no sign is shown by several persons. The
    model is then trained on all takes.

    Args:
        dataset: The takes.
        shipped: Recognises the shipped signs, which cannot be taught again.
        sided: Further signs, besides those that point sideways, whose mirror image is another sign or none.
        progress: Called with the number of completed steps and of all steps.

    Signs that cannot be learnt are left out, and the report says why: disabled ones, those with too little data, those
    that look like a shipped sign, and those that look too much like another one.

    Raises:
        TrainingError: No sign can be learnt, two labels mean the same, or ``sided`` names an unknown sign.
    """
    numbers = {take: number for number, take in enumerate(dataset.takes)}
    dataset, known, left_out = _learnable(dataset, shipped, sided)
    while True:
        labels = tuple(label for label in dataset.labels if label not in (*SIGNS, NONE))
        if not labels:
            raise TrainingError("; ".join(each.why for each in left_out))
        depth: Depth = "flat" if any(take.is_flat for take in dataset.takes) else "full"
        teacher = _Trainer(frozenset(sided) | _pointing_sideways(dataset, labels), depth)
        held_out, folds = split(dataset, labels)
        steps = _counting(progress, of=_EPOCHS * (len(folds) + 1))
        tried = teacher.try_all(folds, labels, steps)
        confused = most_confused(_confusion(tried, np.zeros(len(labels)), labels))
        if confused is None:
            break
        left_out = (*left_out, confused)
        dataset = _without(dataset, {confused.label})
    thresholds = _thresholds(tried, len(labels))
    confusion = _confusion(tried, thresholds, labels)
    model = teacher.learn(dataset.takes, labels, steps, thresholds)
    made = _made(SEED + 1)
    report = TrainingReport(
        signs=tuple(_custom_signs(dataset, labels, teacher.sided, thresholds, confusion)),
        held_out=held_out,
        confusion=confusion,
        made=Share(int((model.confidences(made.pixels, made.world) >= SURE).any(axis=1).sum()), len(made.shapes)),
        known=tuple(each for each in known if each.label in labels),
        left_out=left_out,
        mistakes=tuple(_mistakes(tried, thresholds, labels, numbers)),
    )
    return model, report


def _learnable(
    dataset: Dataset, shipped: Classifier, sided: Sequence[str]
) -> tuple[Dataset, tuple[Lookalike, ...], tuple[LeftOut, ...]]:
    """Return ``dataset`` without the signs that cannot be learnt, and these; and which look like a shipped sign."""
    disabled = tuple(LeftOut(label, f"{label} is disabled") for label in dataset.labels if label in dataset.disabled)
    dataset = _without(dataset, dataset.disabled)
    labels = custom_labels(dataset, sided) if not disabled or dataset.takes else ()
    small = too_small(dataset, labels)
    dataset = _without(dataset, {each.label for each in small})
    known = lookalikes(dataset, [label for label in labels if label in dataset.labels], shipped)
    same = too_known(known)
    return _without(dataset, {each.label for each in same}), known, (*disabled, *small, *same)


def _without(dataset: Dataset, labels: Set[str]) -> Dataset:
    return Dataset(tuple(take for take in dataset.takes if take.label not in labels))


def _counting(progress: Callable[[int, int], object], of: int) -> Callable[[int], object]:
    """Return what counts epochs over several trainings."""
    done = itertools.count(1)
    return lambda _epoch: progress(next(done), of)


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
        groups = [[take for take in takes if take.label == label] for label in labels]
        groups.append([take for take in takes if take.label not in labels])
        hands = [self._varied(group, random) for group in groups if group]
        hands.append((self._made.pixels, self._made.world))
        features = np.concatenate([custom_features(*each, self._depth) for each in hands])
        classes = np.repeat(np.minimum(np.arange(len(hands)), other), [len(pixels) for pixels, _ in hands])
        network = train(features, classes, hidden=_HIDDEN, epochs=_EPOCHS, seed=SEED, progress=progress)
        mine = classes < other
        novelty = learn_novelty(features[mine], classes[mine], network.mean, network.scale, margin=_LIMIT_MARGIN)
        if thresholds is None:
            thresholds = np.full(other, SURE)
        return CustomModel(labels, self._depth, network, novelty, thresholds, self._facts(takes))

    def try_all(self, folds: Sequence[Fold], labels: tuple[str, ...], progress: Callable[[int], object]) -> _Tried:
        """Return how the held-out takes of ``folds`` are recognised by models of the rest."""
        truths, chances = [np.zeros(0, np.int64)], [np.zeros((0, len(labels)))]
        takes: list[Take] = []
        hands = [np.zeros(0, np.int64)]
        for fold in folds:
            learnt = tuple(label for label in labels if any(take.label == label for take in fold.rest))
            model = self.learn(fold.rest, learnt, progress)
            for take in fold.held_out:
                found = self._try_out(model, take, labels)
                truths.append(np.full(len(found), labels.index(take.label)))
                chances.append(found)
                takes += [take] * len(found)
                hands.append(np.arange(len(found)) % len(take.hands))
        return _Tried(np.concatenate(truths), np.concatenate(chances), tuple(takes), np.concatenate(hands))

    def _try_out(self, model: CustomModel, take: Take, labels: tuple[str, ...]) -> Array:
        """Return the (n, labels) confidences of the hands of ``take``, then of those mirrored unless it is sided."""
        columns = [labels.index(label) for label in model.labels]
        looks = [(take.pixels, take.world)]
        if take.label not in self.sided:
            looks.append((mirrored(take.pixels), mirrored(take.world)))
        chances = np.zeros((len(looks) * len(take.hands), len(labels)))
        chances[:, columns] = np.concatenate([model.confidences(pixels, world) for pixels, world in looks])
        return chances

    def _varied(self, takes: Sequence[Take], random: np.random.Generator) -> tuple[Array, Array]:
        pixels = np.concatenate([take.pixels for take in takes])
        world = np.concatenate([take.world for take in takes])
        both_hands = not any(take.label in self.sided for take in takes)
        return vary(pixels, world, _OF_EACH, random, both_hands=both_hands)

    def _facts(self, takes: Sequence[Take]) -> Mapping[str, Any]:
        dataset = Dataset(tuple(takes))
        return {
            "format": FORMAT,
            "handsteer": __version__,
            "sources": sorted({take.source for take in takes}),
            "persons": len({take.person for take in takes}),
            "signs": [asdict(summary) for summary in summarise(dataset)],
            "sided": sorted(self.sided),
            "hands": {label: _outline(dataset, label, sided=label in self.sided) for label in dataset.labels},
            "made_hands": len(self._made.shapes),
            "seed": SEED,
        }


def _outline(dataset: Dataset, label: str, *, sided: bool) -> list[list[int]]:
    """Return the (21, 2) landmarks of a typical hand in pixels, for a drawing of the sign."""
    hands = [hand for take in dataset.of(label) for hand in take.hands]
    outline: list[list[int]] = hands[typical_hand(hands, sided=sided)].pixels[:, :2].round().astype(int).tolist()
    return outline


def _made(seed: int) -> Hands:
    return make_hands(_MADE, np.random.default_rng(seed))


def _thresholds(tried: _Tried, count: int) -> Array:
    """Return the (labels,) likelihood thresholds: as high as most held-out rows of the sign allow."""
    thresholds = np.full(count, SURE)
    for label in range(count):
        mine = tried.chances[tried.truths == label, label]
        if mine.size:
            thresholds[label] = np.clip(
                np.quantile(mine[mine > 0], 1 - _LEAST_RECALL) if mine.any() else 0, *_THRESHOLDS
            )
    return thresholds


def _seen(tried: _Tried, thresholds: Array, labels: tuple[str, ...]) -> list[str]:
    """Return the recognised sign of each row."""
    chances = tried.chances
    best = chances.argmax(axis=1) if len(chances) else np.zeros(0, int)
    highest = chances[np.arange(len(best)), best]
    sure = (highest > 0) & (highest >= thresholds[best])
    return [(*labels, NONE)[number] for number in np.where(sure, best, len(labels))]


def _confusion(tried: _Tried, thresholds: Array, labels: tuple[str, ...]) -> Confusion:
    shown = (labels[truth] for truth in tried.truths)
    return Confusion.of(zip(shown, _seen(tried, thresholds, labels), strict=True), labels)


def _mistakes(
    tried: _Tried, thresholds: Array, labels: tuple[str, ...], numbers: Mapping[Take, int]
) -> Iterable[Mistake]:
    """Return which takes have hands that were not recognised, the worst first."""
    rows: dict[tuple[Take, str], list[int]] = {}
    for take, hand, seen in zip(tried.takes, tried.hands.tolist(), _seen(tried, thresholds, labels), strict=True):
        if seen != take.label:
            rows.setdefault((take, seen), []).append(hand)
    found = (
        Mistake(numbers[take], hands[len(hands) // 2], take.label, seen, Share(len(set(hands)), len(take.hands)))
        for (take, seen), hands in rows.items()
    )
    return sorted(found, key=lambda each: -(each.hands.rate or 0.0))


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
