"""Figures of sign recognition over time: false commands per minute, and reaction times."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain, groupby
from statistics import median
from typing import Any

from handsteer.control.engagement import Engagement
from handsteer.plugins.teach.evaluation.intervals import Rate, Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion
from handsteer.types import NONE


@dataclass(frozen=True)
class FrameVerdict:
    """The label of one frame, and its recognition.

    Attributes:
        time_s: Seconds since the first frame.
        truth: The correct sign, or ``NONE``; None if unknown.
        seen: The sign recognised in this frame alone.
        counts: The confirmed sign, which drives.
    """

    time_s: float
    truth: str | None
    seen: str
    counts: str


@dataclass(frozen=True)
class Event:
    """A period in which one sign was confirmed without a break.

    Attributes:
        sign: The sign.
        start_s: Its start, in seconds from the first frame of the video.
        end_s: The time of its last frame.
        video: The video.
        follows_sign: Whether another sign was confirmed directly before, so that the user was driving.
    """

    sign: str
    start_s: float
    end_s: float
    video: str = ""
    follows_sign: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class Reaction:
    """How soon a sign was confirmed after it was first shown.

    Attributes:
        shown: How often it was shown.
        missed: How often it was not confirmed while shown.
        median_s: Median time from the first frame that shows it to its confirmation, in seconds, without the missed
            ones.
        slowest_s: Likewise, the longest time.
    """

    shown: int
    missed: int
    median_s: float | None
    slowest_s: float | None


@dataclass(frozen=True)
class VideoReport:
    """The figures of one or several videos.

    Attributes:
        videos: Number of videos.
        frames: Number of frames.
        duration_s: Total duration.
        counted_s: Time in which each sign was confirmed, including ``NONE``.
        motion_events: Each period in which a sign that moves the robot was confirmed.
        engaged_motion: The same while the hand was engaged: all that move the robot with ``control.engage``.
        labels: Figures from the labels; None without labels.
    """

    videos: int
    frames: int
    duration_s: float
    counted_s: dict[str, float]
    motion_events: tuple[Event, ...]
    engaged_motion: tuple[Event, ...]
    labels: "LabelledFigures | None"

    @property
    def motion_rate(self) -> Rate:
        """Rate at which signs that move the robot were confirmed."""
        return Rate(len(self.motion_events), self.duration_s)

    @property
    def after_sign_rate(self) -> Rate:
        """Rate of those directly after another sign, in the time in which a sign was confirmed."""
        with_sign_s = sum(time_s for sign, time_s in self.counted_s.items() if sign != NONE)
        return Rate(sum(event.follows_sign for event in self.motion_events), with_sign_s)

    @property
    def after_none_rate(self) -> Rate:
        """Rate of those directly after ``NONE``, in the time in which no sign was confirmed."""
        return Rate(sum(not event.follows_sign for event in self.motion_events), self.counted_s.get(NONE, 0.0))

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "videos": self.videos,
            "frames": self.frames,
            "duration_s": self.duration_s,
            "counted_s": self.counted_s,
            "motion_events": [asdict(event) for event in self.motion_events],
            **self.motion_rate.as_dict("motion_events"),
            **self.after_sign_rate.as_dict("motion_events_after_sign"),
            **self.after_none_rate.as_dict("motion_events_after_none"),
            "engaged_motion_events": [asdict(event) for event in self.engaged_motion],
            "labels": self.labels and self.labels.as_dict(),
        }


@dataclass(frozen=True)
class LabelledFigures:
    """The figures of the labelled frames.

    Attributes:
        scored_s: Duration of the labelled frames.
        seen_right: Of the frames of each sign, in how many it was recognised.
        counted_right: Of the frames of each sign, in how many it was confirmed; this includes the reaction time.
        reactions: Reaction times of each sign.
        false_commands: Each period in which a sign that moves the robot was confirmed but not shown.
        engaged_false: The same while the hand was engaged.
        confusion: Frames by true and confirmed sign.
    """

    scored_s: float
    seen_right: dict[str, Share]
    counted_right: dict[str, Share]
    reactions: dict[str, Reaction]
    false_commands: tuple[Event, ...]
    engaged_false: tuple[Event, ...]
    confusion: Confusion

    @property
    def false_rate(self) -> Rate:
        """Rate of false commands in the labelled time."""
        return Rate(len(self.false_commands), self.scored_s)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "scored_s": self.scored_s,
            "seen_right": {sign: share.as_dict() for sign, share in self.seen_right.items()},
            "counted_right": {sign: share.as_dict() for sign, share in self.counted_right.items()},
            "reactions": {sign: asdict(reaction) for sign, reaction in self.reactions.items()},
            "false_commands": [asdict(event) for event in self.false_commands],
            **self.false_rate.as_dict("false_commands"),
            "engaged_false_commands": [asdict(event) for event in self.engaged_false],
            "confusion": asdict(self.confusion),
        }


def video_report(
    videos: Mapping[str, Sequence[FrameVerdict]],
    signs: Sequence[str],
    motion: Collection[str],
    grace_s: float = 0.3,
) -> VideoReport:
    """Return the figures of one or several videos.

    A false command is a period in which a sign that moves the robot is confirmed, but was not shown at any time in the
    last ``grace_s`` seconds, which allows for reaction time after a change. It is one event, however long it lasts.
    Periods with unknown truth are not counted.

    Args:
        videos: All frames of each video, in order, by its name.
        signs: The recognised signs, without ``NONE``.
        motion: The signs that move the robot.
        grace_s: How long a sign may stay active after it was last shown, in seconds.
    """
    periods_s = {name: _period_s(frames) for name, frames in videos.items()}
    counted = {
        sign: sum(periods_s[name] * sum(frame.counts == sign for frame in frames) for name, frames in videos.items())
        for sign in (*signs, NONE)
    }
    moving = {
        name: [frame.counts if frame.counts in motion else None for frame in frames] for name, frames in videos.items()
    }
    known = any(frame.truth is not None for frames in videos.values() for frame in frames)
    return VideoReport(
        videos=len(videos),
        frames=sum(map(len, videos.values())),
        duration_s=sum(len(frames) * periods_s[name] for name, frames in videos.items()),
        counted_s={sign: round(time_s, 3) for sign, time_s in counted.items() if time_s},
        motion_events=tuple(_events(moving, videos)),
        engaged_motion=tuple(_events(_while_engaged(moving, videos), videos)),
        labels=_labelled(videos, signs, motion, grace_s) if known else None,
    )


def _labelled(
    videos: Mapping[str, Sequence[FrameVerdict]], signs: Sequence[str], motion: Collection[str], grace_s: float
) -> LabelledFigures:
    scored = {name: [frame for frame in frames if frame.truth is not None] for name, frames in videos.items()}
    frames_known = list(chain.from_iterable(scored.values()))
    of_sign = {sign: [frame for frame in frames_known if frame.truth == sign] for sign in (*signs, NONE)}
    shown = {sign: frames for sign, frames in of_sign.items() if frames}
    false = {
        name: [frame.counts if _is_false(frames, at, motion, grace_s) else None for at, frame in enumerate(frames)]
        for name, frames in videos.items()
    }
    return LabelledFigures(
        scored_s=sum(len(scored[name]) * _period_s(frames) for name, frames in videos.items()),
        seen_right={sign: Share(sum(f.seen == sign for f in of), len(of)) for sign, of in shown.items()},
        counted_right={sign: Share(sum(f.counts == sign for f in of), len(of)) for sign, of in shown.items()},
        reactions={sign: _reaction(sign, videos.values()) for sign in shown},
        false_commands=tuple(_events(false, videos)),
        engaged_false=tuple(_events(_while_engaged(false, videos), videos)),
        confusion=Confusion.of(((frame.truth or NONE, frame.counts) for frame in frames_known), signs),
    )


def _period_s(frames: Sequence[FrameVerdict]) -> float:
    return (frames[-1].time_s - frames[0].time_s) / (len(frames) - 1) if len(frames) > 1 else 0.0


def _is_false(frames: Sequence[FrameVerdict], at: int, motion: Collection[str], grace_s: float) -> bool:
    now = frames[at]
    if now.counts not in motion:
        return False
    begin = at
    # The sign of a frame holds until the next frame.
    while begin > 0 and now.time_s - frames[begin].time_s < grace_s:
        begin -= 1
    return all(frame.truth not in (None, now.counts) for frame in frames[begin : at + 1])


def _reaction(sign: str, videos: Iterable[Sequence[FrameVerdict]]) -> Reaction:
    times_s: list[float | None] = []
    for frames in videos:
        for showing in (list(group) for truth, group in groupby(frames, lambda frame: frame.truth) if truth == sign):
            counted_s = next((frame.time_s for frame in showing if frame.counts == sign), None)
            times_s.append(None if counted_s is None else round(counted_s - showing[0].time_s, 6))
    known_s = [time_s for time_s in times_s if time_s is not None]
    return Reaction(
        shown=len(times_s),
        missed=len(times_s) - len(known_s),
        median_s=median(known_s) if known_s else None,
        slowest_s=max(known_s, default=None),
    )


def _events(marks: Mapping[str, Sequence[str | None]], videos: Mapping[str, Sequence[FrameVerdict]]) -> Iterator[Event]:
    """Yield an event for each run of equal marks, except None. It ends with its last frame."""
    for video, frames in videos.items():
        for mark, group in groupby(enumerate(marks[video]), key=lambda pair: pair[1]):
            if mark is not None:
                numbers = [number for number, _ in group]
                first, last = numbers[0], numbers[-1]
                follows_sign = first > 0 and frames[first - 1].counts != NONE
                yield Event(mark, round(frames[first].time_s, 6), round(frames[last].time_s, 6), video, follows_sign)


def _while_engaged(
    marks: Mapping[str, Sequence[str | None]], videos: Mapping[str, Sequence[FrameVerdict]]
) -> dict[str, list[str | None]]:
    """Return the marks of the frames in which the hand is engaged, None for the others."""
    return {
        video: [mark if engaged else None for mark, engaged in zip(marks[video], _engaged(frames), strict=True)]
        for video, frames in videos.items()
    }


def _engaged(frames: Sequence[FrameVerdict]) -> Iterator[bool]:
    clutch, before_s = Engagement(enabled=True, by="hold"), 0.0
    for frame in frames:
        clutch.step(max(0.0, frame.time_s - before_s))
        clutch.note_sign(frame.counts)
        before_s = frame.time_s
        yield clutch.engaged
