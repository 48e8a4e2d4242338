"""The results of an evaluation: by source, by view, and overall."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import (
    Confusion,
    PhotoReport,
    PhotoResult,
    Tally,
    photo_report,
    tally,
)
from handsteer.plugins.teach.evaluation.sources import PhotoRun, VideoRun
from handsteer.plugins.teach.evaluation.video_metrics import VideoReport, video_report
from handsteer.plugins.teach.evaluation.views import View
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


@dataclass(frozen=True)
class Evaluation:
    """The results of all sources, and figures computed from them.

    Attributes:
        signs: The recognised signs, without ``NONE``, in the order of the tables.
        motion: The signs that move the robot.
        photos: Results of photo folders: one run per folder and view.
        hands: Likewise, of datasets of landmarks.
        videos: Likewise, of videos.
        grace_s: In videos, how long a sign may stay active after it was last shown, in seconds.
    """

    signs: tuple[str, ...]
    motion: Collection[str]
    photos: tuple[PhotoRun, ...] = ()
    hands: tuple[PhotoRun, ...] = ()
    videos: tuple[VideoRun, ...] = ()
    grace_s: float = 0.3

    @property
    def views(self) -> tuple[View, ...]:
        """The views of the sources."""
        stills = [run.view for run in (*self.photos, *self.hands)]
        return tuple(dict.fromkeys([*stills, *(run.view for run in self.videos)]))

    @property
    def stills(self) -> tuple[PhotoRun, ...]:
        """The runs to combine: those of photos, or if there are none, of datasets.

        They are not mixed, because a dataset has no figures on whether hands are found.
        """
        return self.photos or self.hands

    @property
    def results(self) -> list[PhotoResult]:
        """The results of all :attr:`stills`."""
        return [result for run in self.stills for result in run.results]

    @property
    def calibration(self) -> Calibration:
        """The calibration of the likelihoods of all :attr:`stills`."""
        return calibration(self.results)

    @property
    def sweep(self) -> dict[float, Tally]:
        """The results of all :attr:`stills` for other thresholds."""
        return sweep(self.results, self.signs, self.motion)

    @property
    def confusion(self) -> Confusion | None:
        """The confusion matrix of all :attr:`stills`, or else of all videos; None without labels."""
        if self.stills:
            return self.of_photos(self.stills).confusion
        labels = self.of_videos(self.videos).labels
        return labels.confusion if labels else None

    def of_photos(self, runs: Sequence[PhotoRun]) -> PhotoReport:
        """Return the combined figures of ``runs``."""
        return photo_report(
            [result for run in runs for result in run.results],
            self.signs,
            self.motion,
            unscored=sum(run.unscored for run in runs),
            without_depth=sum(run.without_depth for run in runs),
        )

    def of_videos(self, runs: Sequence[VideoRun]) -> VideoReport:
        """Return the combined figures of ``runs``."""
        several = len({run.view for run in runs}) > 1
        videos = {f"{run.source}, {run.view.name}" if several else run.source: run.frames for run in runs}
        return video_report(videos, self.signs, self.motion, self.grace_s)

    def as_dict(self, *, with_sweep: bool = False) -> dict[str, Any]:
        """Return everything as plain values, for JSON.

        The top level has the figures of all :attr:`stills` and of all videos; ``views`` has those of each view,
        ``sources`` those of each source and view, and ``verdicts`` those of each photo; ``sweep``, if ``with_sweep``,
        has the results for other thresholds.
        """
        together = self._figures(self.stills, self.videos)
        if self.stills:
            together["calibration"] = self.calibration.as_dict()
        if with_sweep:
            together["sweep"] = [{"threshold": at, **row.as_dict()} for at, row in self.sweep.items()]
        return {**together, "views": self._by_view(), "sources": self._by_source(), "verdicts": self._verdicts()}

    def _by_view(self) -> list[dict[str, Any]]:
        return [
            {
                **_described(view),
                **self._figures(
                    [run for run in self.stills if run.view == view], [run for run in self.videos if run.view == view]
                ),
            }
            for view in self.views
        ]

    def _by_source(self) -> list[dict[str, Any]]:
        stills = [(run.source, run.view, self._figures([run], [])) for run in (*self.photos, *self.hands)]
        videos = [(run.source, run.view, self._figures([], [run])) for run in self.videos]
        return [{"source": source, **_described(view), **figures} for source, view, figures in (*stills, *videos)]

    def _verdicts(self) -> list[dict[str, Any]]:
        return [
            {"source": run.source, "view": run.view.name, **result.as_dict()}
            for run in (*self.photos, *self.hands)
            for result in run.results
        ]

    def _figures(self, stills: Sequence[PhotoRun], videos: Sequence[VideoRun]) -> dict[str, Any]:
        return {
            **(self.of_photos(stills).as_dict() if stills else {}),
            **(self.of_videos(videos).as_dict() if videos else {}),
        }


def _described(view: View) -> dict[str, Any]:
    return {"view": view.name, "flip": view.flip, "rotate": view.rotate_deg}
