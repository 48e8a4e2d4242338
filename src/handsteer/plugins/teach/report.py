"""Checks a dataset before a training, and reports how well its signs are distinguished afterwards."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from handsteer.errors import TrainingError
from handsteer.plugins.teach.dataset import Dataset, LabelSummary, Take, summarise
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion
from handsteer.recognition.hand import Classifier
from handsteer.recognition.shipped_signs import SURE
from handsteer.types import NONE, SIGNS, find_sign

_LEAST_TAKES: Final = 2
_LEAST_ROWS: Final = 10
_KNOWN_SHARE: Final = 0.3
_CONFUSED_SHARE: Final = 0.2

FOLDS: Final = 3
"""Maximum number of folds of :func:`split`."""


def custom_labels(dataset: Dataset, sided: Sequence[str]) -> tuple[str, ...]:
    """Return the labels of ``dataset`` that are new signs.

    Raises:
        TrainingError: There is none, two mean the same, or one of ``sided`` is not among them.
    """
    labels = tuple(label for label in dataset.labels if label not in (*SIGNS, NONE))
    if not labels:
        found = ", ".join(dataset.labels) or "nothing at all"
        raise TrainingError(f"there is no new sign to learn, only {found}: collect takes with a label of your own")
    for number, label in enumerate(labels):
        twin = find_sign(label, (*SIGNS, NONE, *labels[:number]))
        if twin:
            raise TrainingError(f"the labels {twin!r} and {label!r} mean the same sign: give both the same label")
    strangers = [name for name in sided if name not in labels]
    if strangers:
        raise TrainingError(f"--sided: there is no sign {strangers[0]!r} to learn; there are {', '.join(labels)}")
    return labels


@dataclass(frozen=True)
class LeftOut:
    """A sign that was not learnt, and why, as a sentence without a full stop."""

    label: str
    why: str


def too_small(dataset: Dataset, labels: Sequence[str]) -> tuple[LeftOut, ...]:
    """Return which of ``labels`` have too few takes or hands to be learnt."""
    return tuple(
        LeftOut(
            summary.label,
            f"too little data for {summary.label}: {summary.takes} {'take' if summary.takes == 1 else 'takes'} with "
            f"{summary.rows} hands; at least "
            f"{_LEAST_TAKES} takes with {_LEAST_ROWS} hands are needed; five takes of 3 s are good",
        )
        for summary in summarise(dataset)
        if summary.label in labels and (summary.takes < _LEAST_TAKES or summary.rows < _LEAST_ROWS)
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
        seen = [
            guess.sign if guess.confidence >= SURE else NONE
            for take in dataset.of(label)
            if not take.is_flat
            for guess in map(shipped.classify, take.hands)
        ]
        found += [Lookalike(label, sign, Share(seen.count(sign), len(seen))) for sign in shipped.signs if sign in seen]
    return tuple(found)


def too_known(found: Sequence[Lookalike]) -> tuple[LeftOut, ...]:
    """Return the new signs that are often recognised as a known one."""
    return tuple(
        LeftOut(
            each.label,
            f"{each.label} looks like {each.sign}: {share:.0%} of its hands are recognised as that already; "
            f"teach another shape, or give {each.sign} another action",
        )
        for each in found
        for share in [each.hands.rate or 0.0]
        if share > _KNOWN_SHARE
    )


def most_confused(likeliest: Confusion) -> LeftOut | None:
    """Return the sign that is most often confused with another, if that is too often.

    ``likeliest`` has the likeliest signs of held-out hands, regardless of thresholds.
    """
    *labels, _ = likeliest.labels
    shares: list[tuple[float, str, str]] = [
        (count / sum(row), label, other)
        for label, row in zip(labels, likeliest.counts, strict=False)
        for other, count in zip(labels, row, strict=False)
        if label != other and sum(row) > 0
    ]
    share, label, other = max(shares, default=(0.0, "", ""), key=lambda each: each[0])
    if share <= _CONFUSED_SHARE:
        return None
    why = (
        f"{label} looks like {other}: {share:.0%} of its held-out hands look more like that; "
        f"teach shapes that differ more, or name both by --sided if one is the mirror image of the other"
    )
    return LeftOut(label, why)


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
    count = min(FOLDS, len(groups))
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


@dataclass(frozen=True)
class CustomSignFigures:
    """How well a sign was learnt.

    Attributes:
        summary: The amount of its data.
        sided: Whether its mirror image is not the same sign.
        threshold: Likelihood threshold.
        recall: Of the held-out rows, two for each hand unless it is sided, how many were right; None if it could not be
            held out, because only one person showed it and others showed other signs.
    """

    summary: LabelSummary
    sided: bool
    threshold: float
    recall: Share | None

    @property
    def hands_tried(self) -> int:
        """Number of held-out hands, each counted once."""
        rows = self.recall.of if self.recall is not None else 0
        return rows if self.sided else rows // 2

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        recall = self.recall.as_dict() if self.recall else None
        return {**asdict(self.summary), "sided": self.sided, "threshold": round(self.threshold, 4), "recall": recall}


@dataclass(frozen=True)
class Mistake:
    """Held-out hands of one take that were recognised as another sign, or as none.

    Attributes:
        take: Index of the take in the dataset.
        hand: Index of one of these hands in the take.
        shown: The sign of the take.
        seen: The recognised sign.
        hands: How many of the take's hands: as shown or mirrored.
    """

    take: int
    hand: int
    shown: str
    seen: str
    hands: Share


@dataclass(frozen=True)
class TrainingReport:
    """How well the signs were learnt.

    Attributes:
        signs: The results of each sign.
        held_out: The held-out unit: ``person``, ``session`` or ``take``.
        confusion: Held-out rows, both hands, by true and recognised sign.
        made: Of synthetic hands of all shapes, how many are recognised as one of the signs; some truly show it.
        known: Hands of the takes that are recognised as a shipped sign, which overrides the taught one.
        left_out: Signs of the dataset that were not learnt.
        mistakes: The takes with hands that were not recognised, the worst first.
    """

    signs: tuple[CustomSignFigures, ...]
    held_out: str
    confusion: Confusion
    made: Share
    known: tuple[Lookalike, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    mistakes: tuple[Mistake, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "signs": [sign.as_dict() for sign in self.signs],
            "held_out": self.held_out,
            "confusion": asdict(self.confusion),
            "made_hands": self.made.as_dict(),
            "known": [{"sign": each.label, "told": each.sign, **each.hands.as_dict()} for each in self.known],
            "left_out": {each.label: each.why for each in self.left_out},
        }


def how_it_was_tried(report: TrainingReport) -> str:
    """Return how the figures were measured, without a full stop."""
    both = "" if all(sign.sided for sign in report.signs) else ", each as it is and mirrored"
    tried = f"Recognition of held-out hands{both}, one {report.held_out} at a time"
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
        (each.hands.rate or 0.0, words) for each, words in zip(report.known, lookalike_words(report), strict=True)
    ]
    return [words for _, words in sorted(found, key=lambda item: -item[0])]


def lookalike_words(report: TrainingReport) -> list[str]:
    """Return which taught signs are recognised as shipped ones, and how often."""
    return [
        f"{each.label} is mistaken for {each.sign} {each.hands.count} of {each.hands.of} times" for each in report.known
    ]


def _sign(seen: str) -> str:
    return "no sign" if seen == NONE else seen
