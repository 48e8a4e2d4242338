"""How well signs are told over time: false commands a minute, and how soon each sign counts."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain, groupby
from statistics import median
from typing import Any

from handsteer.signs.intervals import Rate, Share
from handsteer.signs.metrics import Confusion
from handsteer.types import NONE


@dataclass(frozen=True)
class FrameVerdict:
    """What one frame shows, and what was made of it.

    Attributes:
        time_s: When it is, from the first frame.
        truth: The sign that it shows, or ``NONE``; None when nobody knows.
        seen: The sign that was seen in this frame alone.
        counts: The sign that counted, and drove.
    """

    time_s: float
    truth: str | None
    seen: str
    counts: str


@dataclass(frozen=True)
class Event:
    """A time in which a sign counted without a break.

    Attributes:
        sign: The sign.
        start_s: When it began, in seconds from the first frame of the video.
        end_s: When its last frame was.
        video: The video.
        engaged: Whether another sign counted right before, so that somebody was driving.
    """

    sign: str
    start_s: float
    end_s: float
    video: str = ""
    engaged: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class Reaction:
    """How soon a sign counted after it was first shown.

    Attributes:
        shown: How often it was shown.
        missed: How often it never counted while it was.
        median_s: Of the other times, the time from its first frame to the frame at which it counted, in seconds.
        slowest_s: Likewise, the longest.
    """

    shown: int
    missed: int
    median_s: float | None
    slowest_s: float | None


@dataclass(frozen=True)
class VideoReport:
    """The figures of a video, or of several together.

    Attributes:
        videos: How many there are.
        frames: How many there are.
        duration_s: How long it is.
        counted_s: For how long each sign counted, ``NONE`` among them.
        motion_events: Each time in which a sign counted that moves the robot.
        labels: What the labels say about it; None when there are none.
    """

    videos: int
    frames: int
    duration_s: float
    counted_s: dict[str, float]
    motion_events: tuple[Event, ...]
    labels: "LabelledFigures | None"

    @property
    def motion_rate(self) -> Rate:
        """How often a sign began to count that moves the robot."""
        return Rate(len(self.motion_events), self.duration_s)

    @property
    def engaged_rate(self) -> Rate:
        """How often one began behind another sign, in the time in which signs counted."""
        engaged_s = sum(time_s for sign, time_s in self.counted_s.items() if sign != NONE)
        return Rate(sum(event.engaged for event in self.motion_events), engaged_s)

    @property
    def idle_rate(self) -> Rate:
        """How often one began when none had counted, in the time in which none did."""
        return Rate(sum(not event.engaged for event in self.motion_events), self.counted_s.get(NONE, 0.0))

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain values, for JSON."""
        return {
            "videos": self.videos,
            "frames": self.frames,
            "duration_s": self.duration_s,
            "counted_s": self.counted_s,
            "motion_events": [asdict(event) for event in self.motion_events],
            **self.motion_rate.as_dict("motion_events"),
            **self.engaged_rate.as_dict("motion_events_engaged"),
            **self.idle_rate.as_dict("motion_events_idle"),
            "labels": self.labels and self.labels.as_dict(),
        }


@dataclass(frozen=True)
class LabelledFigures:
    """The figures of the frames whose sign is known.

    Attributes:
        scored_s: For how long the sign is known.
        seen_right: Of the frames of each sign, in how many it was seen.
        counted_right: Of the frames of each sign, for how many it counted; the time to react is lost here.
        reactions: How soon each sign counted.
        false_commands: Each time in which a sign counted that moves the robot and that was not shown.
        confusion: Frames by the sign that they show and the one that counted.
    """

    scored_s: float
    seen_right: dict[str, Share]
    counted_right: dict[str, Share]
    reactions: dict[str, Reaction]
    false_commands: tuple[Event, ...]
    confusion: Confusion

    @property
    def false_rate(self) -> Rate:
        """How many false commands there are in the time in which the sign is known."""
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
            "confusion": self.confusion.as_dict(),
        }


def video_report(
    videos: Mapping[str, Sequence[FrameVerdict]],
    signs: Sequence[str],
    motion: Collection[str],
    grace_s: float = 0.3,
) -> VideoReport:
    """Return the figures of one video, or of several together.

    A false command is a time in which one sign counts that moves the robot, but was not shown at any moment of the
    last ``grace_s`` seconds: those who change their sign are given that long to be understood. It is one event however
    long it lasts. Where the truth is not known within that time, nothing is held against the recogniser.

    Args:
        videos: The name of each, and all its frames in their order.
        signs: The signs that can occur, without ``NONE``.
        motion: Those that can move the robot.
        grace_s: How long a sign that is no longer shown may go on to count, in seconds.
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
        confusion=Confusion.of(((frame.truth or NONE, frame.counts) for frame in frames_known), signs),
    )


def _period_s(frames: Sequence[FrameVerdict]) -> float:
    return (frames[-1].time_s - frames[0].time_s) / (len(frames) - 1) if len(frames) > 1 else 0.0


def _is_false(frames: Sequence[FrameVerdict], at: int, motion: Collection[str], grace_s: float) -> bool:
    now = frames[at]
    if now.counts not in motion:
        return False
    begin = at
    # What a frame shows is shown until the next one.
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
    """Yield an event for each run of the same mark; None marks nothing. It ends with its last frame."""
    for video, frames in videos.items():
        for mark, group in groupby(enumerate(marks[video]), key=lambda pair: pair[1]):
            if mark is not None:
                numbers = [number for number, _ in group]
                first, last = numbers[0], numbers[-1]
                engaged = first > 0 and frames[first - 1].counts != NONE
                yield Event(mark, round(frames[first].time_s, 6), round(frames[last].time_s, 6), video, engaged)
