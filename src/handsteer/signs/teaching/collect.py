"""Collects takes: live, one after the other, or from recordings."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import PHOTO_SUFFIXES, find_photos, read_photo, video_frames
from handsteer.cameras.protocol import Camera
from handsteer.clock import Clock
from handsteer.errors import DatasetError
from handsteer.landmarks.hand import Hand, Landmarker
from handsteer.signs.teaching.dataset import Take

Phase = Literal["ready", "countdown", "recording", "done"]

_FEWEST: Final = 5
"""Hands in the shortest take that is kept."""


_HELD_S: Final = 0.7
"""Terminals tell of a key that is held by sending it again and again, the second time after up to 0.66 s."""


@dataclass(frozen=True)
class Facts:
    """What is the same for all takes that are collected together: see :class:`Take`."""

    label: str
    person: str
    session: str
    source: str

    def take(self, hands: Sequence[Hand], times_s: Sequence[float]) -> Take:
        """Return a take of ``hands``."""
        begin_s = times_s[0]
        times = tuple(round(time_s - begin_s, 4) for time_s in times_s)
        return Take(self.label, self.person, self.session, self.source, tuple(hands), times)


@dataclass(frozen=True)
class Status:
    """How far the collecting is.

    Attributes:
        phase: ``ready`` waits for a key, ``countdown`` for the time to pass.
        left_s: How long the countdown or the take still lasts, in seconds; 0 when nobody knows.
        hands: Hands in the take that is under way.
        finished: The take that ended with this frame, if one did.
        failed: Whether a take ended with this frame in which there were too few hands to keep it.
    """

    phase: Phase
    left_s: float
    hands: int
    finished: Take | None = None
    failed: bool = False


class Collector:
    """Says when to show the sign, and keeps the hands that are seen meanwhile; has no clock and no camera.

    Hands-free, a countdown goes before each take. With ``hold``, a take lasts for as long as the caller says so.

    Args:
        facts: About all takes.
        takes: How many to collect.
        take_s: How long each lasts, in seconds; not with ``hold``.
        countdown_s: How long to wait before each, in seconds; not with ``hold``.
        hold: Whether takes last for as long as a key is held.
    """

    def __init__(self, facts: Facts, *, takes: int, take_s: float, countdown_s: float, hold: bool = False) -> None:
        self._facts = facts
        self._left = takes
        self._take_s = take_s
        self._countdown_s = countdown_s
        self._hold = hold
        self._hands: list[Hand] = []
        self._times_s: list[float] = []
        self._elapsed_s = 0.0
        self._recording = False

    @property
    def done(self) -> bool:
        """Whether all takes are there."""
        return self._left == 0

    def step(self, hand: Hand | None, dt_s: float, *, key_age_s: float = math.inf) -> Status:
        """Take what the next frame shows.

        Args:
            hand: The hand in it, if there is one.
            dt_s: Seconds since the last frame.
            key_age_s: How long ago the key that is held last made itself known, in seconds.
        """
        held = key_age_s < _HELD_S
        if self.done:
            return Status("done", 0.0, 0)
        self._elapsed_s += dt_s
        if self._recording:
            if held if self._hold else self._elapsed_s <= self._take_s:
                return self._record(hand)
            return self._end(self._elapsed_s - key_age_s if self._hold else self._take_s)
        if held if self._hold else self._elapsed_s >= self._countdown_s:
            self._recording = True
            self._elapsed_s = 0.0
            return self._record(hand)
        return self._waiting()

    def again(self) -> None:
        """Collect one take more, as one was undone."""
        self._left += 1

    def _record(self, hand: Hand | None) -> Status:
        if hand is not None:
            self._hands.append(hand)
            self._times_s.append(self._elapsed_s)
        return Status("recording", 0.0 if self._hold else self._take_s - self._elapsed_s, len(self._hands))

    def _end(self, end_s: float) -> Status:
        count = sum(time_s <= end_s for time_s in self._times_s)
        enough = count >= _FEWEST
        take = self._facts.take(self._hands[:count], self._times_s[:count]) if enough else None
        self._hands, self._times_s, self._elapsed_s, self._recording = [], [], 0.0, False
        self._left -= enough
        waiting = Status("done", 0.0, 0) if self.done else self._waiting()
        return Status(waiting.phase, waiting.left_s, 0, take, failed=not enough)

    def _waiting(self) -> Status:
        if self._hold:
            return Status("ready", 0.0, 0)
        return Status("countdown", self._countdown_s - self._elapsed_s, 0)


Show = Callable[[NDArray[np.uint8], Hand | None, Status], None]


def collect_live(
    camera: Camera,
    landmarker: Landmarker,
    collector: Collector,
    clock: Clock,
    *,
    show: Show,
    key_age: Callable[[], float] = lambda: math.inf,
) -> Iterator[Take]:
    """Yield the takes of ``collector`` as they end.

    Args:
        camera: Is read at its own pace.
        landmarker: Finds the hands; the largest one counts.
        collector: Says what to keep.
        clock: The camera's.
        show: Called for each frame, with the hand and how far the collecting is.
        key_age: Returns how long ago the key that is held last made itself known, in seconds.

    Raises:
        CameraLost: The camera gives no more frames.
    """
    last_s: float | None = None
    while not collector.done:
        frame = camera.read()
        if frame is None:
            time.sleep(camera.period_s or 0.01)
            continue
        hand = largest(landmarker.detect(frame.image))
        status = collector.step(hand, 0.0 if last_s is None else frame.captured_s - last_s, key_age_s=key_age())
        last_s = frame.captured_s
        show(frame.image, hand, status)
        if status.finished is not None:
            yield status.finished
        if camera.period_s is not None:
            time.sleep(max(0.0, frame.captured_s + camera.period_s - clock.now()))


def collect_recorded(source: Path, landmarker: Landmarker, facts: Facts, take_s: float) -> list[Take]:
    """Return the takes in a video, a photo or a folder of photos.

    A video has takes of ``take_s`` seconds, one after the other. Each photo is a take of its own, as it was taken at
    another moment; photos of one folder are of one session.

    Raises:
        CameraNotFound: There is no such file, or there are no photos in the folder.
        CameraUnreadable: A file cannot be decoded.
        DatasetError: There is no hand to be found in it.
    """
    if source.is_dir() or source.suffix.lower() in PHOTO_SUFFIXES:
        takes = list(_photo_takes(source, landmarker, facts))
    else:
        takes = list(_video_takes(source, landmarker, facts, take_s))
    if not takes:
        raise DatasetError(f"{source}: there is no hand to be found in it, so there is nothing to learn from")
    return takes


def largest(hands: Sequence[Hand]) -> Hand | None:
    """Return the largest of ``hands`` in the image."""
    return max(hands, key=lambda hand: hand.longer_side_px, default=None)


def _photo_takes(source: Path, landmarker: Landmarker, facts: Facts) -> Iterator[Take]:
    for path in find_photos(source):
        landmarker.reset()
        hand = largest(landmarker.detect(read_photo(path)))
        below = path.parent.relative_to(source) if source.is_dir() else Path()
        session = facts.session if below == Path() else f"{facts.session}/{below.as_posix()}"
        if hand is not None:
            yield Facts(facts.label, facts.person, session, facts.source).take([hand], [0.0])


def _video_takes(source: Path, landmarker: Landmarker, facts: Facts, take_s: float) -> Iterator[Take]:
    landmarker.reset()
    hands: list[Hand] = []
    times_s: list[float] = []
    end_s = take_s
    for frame in video_frames(source):
        if frame.captured_s >= end_s:
            end_s += take_s
            if len(hands) >= _FEWEST:
                yield facts.take(hands, times_s)
            hands, times_s = [], []
        hand = largest(landmarker.detect(frame.image))
        if hand is not None:
            hands.append(hand)
            times_s.append(frame.captured_s)
    if len(hands) >= _FEWEST:
        yield facts.take(hands, times_s)
