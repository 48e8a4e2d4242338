"""Calibration of likelihoods (of hands with 90 %, do 90 % show that sign?), and results for other thresholds."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from handsteer.signs.intervals import Share
from handsteer.signs.metrics import PhotoResult, Tally, tally
from handsteer.types import NONE

BINS: Final = 10
THRESHOLDS: Final = (*(percent / 100 for percent in range(30, 100, 5)), 0.97, 0.99)
"""The confidence thresholds that :func:`sweep` evaluates."""


@dataclass(frozen=True)
class Bin:
    """The hands whose likeliest sign has a likelihood in one range.

    Attributes:
        low: Lower end of the range, 0 to 1.
        high: Upper end, exclusive except in the last bin.
        confidence: The mean likelihood; None in an empty bin.
        right: Number of hands that show their likeliest sign.
    """

    low: float
    high: float
    confidence: float | None
    right: Share


@dataclass(frozen=True)
class Calibration:
    """How well likelihoods agree with the truth.

    Attributes:
        bins: Of equal width, in ascending order.
        expected_error: The expected calibration error, 0 to 1; None without hands.
    """

    bins: tuple[Bin, ...]
    expected_error: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        bins = [{**asdict(each), "right": each.right.as_dict()} for each in self.bins]
        return {"bins": bins, "expected_calibration_error": self.expected_error}


def calibration(results: Iterable[PhotoResult]) -> Calibration:
    """Return how well the likelihoods of ``results`` agree with the truth.

    Each photo with a hand counts once, by its likeliest sign, even below its threshold; a photo without a sign is never
    right. The expected error is the distance between a bin's mean likelihood and its share of right hands, averaged
    over the bins and weighted by their hands: C. Guo et al., "On calibration of modern neural networks", ICML 2017,
    equation 3.
    """
    found = [(*photo.likeliest, photo.truth) for photo in results if photo.likelihoods]
    in_bin: list[list[tuple[float, bool]]] = [[] for _ in range(BINS)]
    for sign, likelihood, truth in found:
        in_bin[min(BINS - 1, int(likelihood * BINS))].append((likelihood, sign == truth))
    bins = tuple(
        Bin(
            low=number / BINS,
            high=(number + 1) / BINS,
            confidence=sum(likelihood for likelihood, _ in hands) / len(hands) if hands else None,
            right=Share(sum(right for _, right in hands), len(hands)),
        )
        for number, hands in enumerate(in_bin)
    )
    errors = [
        each.right.of * abs(each.right.rate - each.confidence)
        for each in bins
        if each.right.rate is not None and each.confidence is not None
    ]
    return Calibration(bins, sum(errors) / len(found) if found else None)


def sweep(
    results: Collection[PhotoResult],
    signs: Sequence[str],
    motion: Collection[str],
    thresholds: Iterable[float] = THRESHOLDS,
) -> dict[float, Tally]:
    """Return the counts of ``results`` for each of ``thresholds`` on the confidence.

    They are computed from the likelihoods, without recognising again. With several hands in view, the selected hand
    stays the same, though another threshold might have selected another.
    """
    return {
        threshold: tally([replace(photo, seen=_seen(photo, threshold)) for photo in results], signs, motion)
        for threshold in thresholds
    }


def _seen(photo: PhotoResult, threshold: float) -> str:
    sign, likelihood = photo.likeliest
    return sign if likelihood >= threshold else NONE
