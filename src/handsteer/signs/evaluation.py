"""The results of an evaluation: by source, by view, and overall."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from handsteer.signs.calibration import Calibration, calibration, sweep
from handsteer.signs.metrics import Confusion, PhotoReport, PhotoResult, Tally, photo_report
from handsteer.signs.sources import PhotoRun, VideoRun
from handsteer.signs.video_metrics import VideoReport, video_report
from handsteer.signs.views import View


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
