"""Collects takes, live or from recordings."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import Camera, Frame
from handsteer.cameras.files import PHOTO_SUFFIXES, find_photos, is_recording, read_photo, video_frames
from handsteer.clock import Clock
from handsteer.errors import DatasetError
from handsteer.plugins.record.camera import recorded_frames
from handsteer.plugins.teach.dataset import Take
from handsteer.recognition.hand import Hand, Landmarker

Phase = Literal["ready", "countdown", "recording", "done"]

_FEWEST: Final = 5
"""Minimum number of hands in a take."""

_RUN_UP_S: Final = 0.5

_HELD_S: Final = 0.7
"""Terminals report a held key by repeating it; the first repetition comes after up to 0.66 s."""

_Found = tuple[float, Hand]
"""A hand, and its time in seconds."""


@dataclass(frozen=True)
class Facts:
    """Attributes shared by all takes that are collected together: see :class:`Take`."""

    label: str
    person: str
    session: str
    source: str

    def take(self, found: Sequence[_Found]) -> Take:
        """Return a take of at least one hand."""
        hands = tuple(hand for _, hand in found)
        times = tuple(round(time_s - found[0][0], 4) for time_s, _ in found)
        return Take(self.label, self.person, self.session, self.source, hands, times)


@dataclass(frozen=True)
class Status:
    """The progress of collecting.

    Attributes:
        phase: ``ready`` waits for a key, ``countdown`` for time to pass.
        left_s: Seconds left of the countdown or take; 0 if unknown.
        hands: Number of hands in the current take.
        finished: The take that ended with this frame, if any.
        failed: Whether a take with too few hands ended with this frame.
    """

    phase: Phase
    left_s: float
    hands: int
    finished: Take | None = None
    failed: bool = False


class Collector:
    """Controls when to show the sign, and collects the hands; has no clock and no camera.

    Without ``hold``, a countdown precedes each take. With ``hold``, a take lasts while a key is held.

    Args:
        facts: The takes' shared attributes.
        takes: Number of takes to collect.
        take_s: Duration of each in seconds; ignored with ``hold``.
        countdown_s: Duration of the countdown in seconds; ignored with ``hold``.
        hold: Whether takes last while a key is held.
    """

    def __init__(self, facts: Facts, *, takes: int, take_s: float, countdown_s: float, hold: bool = False) -> None:
        self._facts = facts
        self._left = takes
        self._take_s = take_s
        self._countdown_s = countdown_s
        self._hold = hold
        self._found: list[_Found] = []
        self._elapsed_s = 0.0
        self._recording = False

    @property
    def done(self) -> bool:
        """Whether all takes are collected."""
        return self._left == 0

    def step(self, hand: Hand | None, dt_s: float, *, key_age_s: float = math.inf) -> Status:
        """Process the next frame.

        Args:
            hand: The hand in it, if any.
            dt_s: Seconds since the last frame.
            key_age_s: Seconds since the last report of the held key.
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
        """Collect one more take, to replace a deleted one."""
        self._left += 1

    def finish(self) -> Status:
        """End the current take now, or the countdown before it, and collect no more."""
        status = self._end(self._elapsed_s) if self._recording else Status("done", 0.0, 0)
        self._left = 0
        return status

    def _record(self, hand: Hand | None) -> Status:
        if hand is not None:
            self._found.append((self._elapsed_s, hand))
        return Status("recording", 0.0 if self._hold else self._take_s - self._elapsed_s, len(self._found))

    def _end(self, end_s: float) -> Status:
        found = [each for each in self._found if each[0] <= end_s]
        enough = len(found) >= _FEWEST
        take = self._facts.take(found) if enough else None
        self._found, self._elapsed_s, self._recording = [], 0.0, False
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
        camera: Read at its own pace.
        landmarker: Finds the hands; the largest one is used.
        collector: Selects the frames.
        clock: The camera's clock.
        show: Called for each frame, with the hand and the progress.
        key_age: Returns the seconds since the last report of the held key.

    Raises:
        CameraLost: The camera gives no more frames.
        EndOfStream: The camera's file has ended.
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


def collect_recorded(
    source: Path,
    landmarker: Landmarker,
    facts: Facts,
    take_s: float,
    without_hand: Callable[[Path], None] = lambda _: None,
) -> list[Take]:
    """Return the takes in a video, a recording, a photo or a folder of photos.

    A video or recording is divided into takes of ``take_s`` seconds. Each photo is a separate take; the photos of a
    folder form a session. ``without_hand`` is called with each photo in which no hand is found.

    Raises:
        CameraNotFound: The file does not exist, or the folder contains no photos.
        CameraUnreadable: A file cannot be decoded.
        DatasetError: No hand was found in it.
    """
    if (source.is_dir() and not is_recording(source)) or source.suffix.lower() in PHOTO_SUFFIXES:
        takes = list(_photo_takes(source, landmarker, facts, without_hand))
    else:
        takes = list(_video_takes(source, landmarker, facts, take_s))
    if not takes:
        raise DatasetError(f"{source}: no hand was found in it")
    return takes


def collect_moment(recording: Path, landmarker: Landmarker, facts: Facts, begin_s: float, end_s: float) -> Take:
    """Return the hands in a part of a recording as a take, such as a moment at which a sign was not recognised.

    Args:
        recording: An MCAP file, or a bag of ROS 1 or 2.
        landmarker: Finds the hands.
        facts: Label and origin of the take.
        begin_s: Begin of the part, in seconds since the recording began.
        end_s: Its end.

    Raises:
        CameraUnreadable: The recording cannot be read, or contains no pictures.
        DatasetError: There is no hand in that part.
    """
    # The landmarker follows a hand from picture to picture, so it begins a little earlier.
    seen = _seen(recorded_frames(recording, begin_s - _RUN_UP_S, end_s), landmarker)
    found = [(time_s, hand) for time_s, hand in seen if hand is not None and time_s >= begin_s]
    if not found:
        raise DatasetError(f"{recording}: there is no hand from {begin_s:g} to {end_s:g} s")
    return facts.take(found)


def largest(hands: Sequence[Hand]) -> Hand | None:
    """Return the largest of ``hands`` in the image."""
    return max(hands, key=lambda hand: hand.longer_side_px, default=None)


def _photo_takes(
    source: Path, landmarker: Landmarker, facts: Facts, without_hand: Callable[[Path], None]
) -> Iterator[Take]:
    for path in find_photos(source):
        landmarker.reset()
        hand = largest(landmarker.detect(read_photo(path)))
        below = path.parent.relative_to(source) if source.is_dir() else Path()
        session = facts.session if below == Path() else f"{facts.session}/{below.as_posix()}"
        if hand is None:
            without_hand(path)
        else:
            yield replace(facts, session=session).take([(0.0, hand)])


def _video_takes(source: Path, landmarker: Landmarker, facts: Facts, take_s: float) -> Iterator[Take]:
    found: list[_Found] = []
    end_s = take_s
    for time_s, hand in _seen(recorded_frames(source) if is_recording(source) else video_frames(source), landmarker):
        if time_s >= end_s:
            end_s += take_s
            if len(found) >= _FEWEST:
                yield facts.take(found)
            found = []
        if hand is not None:
            found.append((time_s, hand))
    if len(found) >= _FEWEST:
        yield facts.take(found)


def _seen(frames: Iterable[Frame], landmarker: Landmarker) -> Iterator[tuple[float, Hand | None]]:
    """Yield the time of each frame in seconds, and its largest hand."""
    landmarker.reset()
    for frame in frames:
        yield frame.captured_s, largest(landmarker.detect(frame.image))
