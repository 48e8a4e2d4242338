"""Whether likelihoods can be trusted: of the hands with 90 %, do 90 % show that sign? And other thresholds than set."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from handsteer.signs.intervals import Share
from handsteer.signs.metrics import PhotoResult, Tally, tally
from handsteer.types import NONE

BINS: Final = 10
THRESHOLDS: Final = (*(percent / 100 for percent in range(30, 100, 5)), 0.97, 0.99)
"""The confidences that :func:`sweep` tries."""


@dataclass(frozen=True)
class Bin:
    """The hands whose likeliest sign is about as likely.

    Attributes:
        low: The least likelihood in it, 0 to 1.
        high: The greatest, which only the last bin has itself.
        confidence: The mean likelihood; None in an empty bin.
        right: How many of the hands do show their likeliest sign.
    """

    low: float
    high: float
    confidence: float | None
    right: Share


@dataclass(frozen=True)
class Calibration:
    """How well likelihoods agree with what is true.

    Attributes:
        bins: From the least likely to the likeliest, each as wide as the others.
        expected_error: The expected calibration error, 0 to 1; None of nothing.
    """

    bins: tuple[Bin, ...]
    expected_error: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        bins = [{**asdict(each), "right": each.right.as_dict()} for each in self.bins]
        return {"bins": bins, "expected_calibration_error": self.expected_error}


def calibration(results: Iterable[PhotoResult]) -> Calibration:
    """Return how well the likelihoods of ``results`` agree with what is true.

    Each photo in which a hand was found counts once, with its likeliest sign, sure enough or not; a photo that shows no
    sign is never right. The expected error is the distance between the mean likelihood of a bin and the share that is
    right in it, the mean of all bins, each weighed by its hands: C. Guo et al., "On calibration of modern neural
    networks", ICML 2017, equation 3.
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
    """Return what would be counted of ``results`` if a sign were seen from each of ``thresholds`` on.

    It follows from the likelihoods; nothing is recognised again. Where several hands are in view, the one that was
    looked at stays, though another threshold might have chosen another.
    """
    return {
        threshold: tally([replace(photo, seen=_seen(photo, threshold)) for photo in results], signs, motion)
        for threshold in thresholds
    }


def _seen(photo: PhotoResult, threshold: float) -> str:
    sign, likelihood = photo.likeliest
    return sign if likelihood >= threshold else NONE
