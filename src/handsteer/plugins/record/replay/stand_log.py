"""Finds in the commands of a recording each time that the robot was commanded to stand, why, and by which frame."""

import math
from collections import OrderedDict, deque
from contextlib import suppress
from dataclasses import dataclass, field

import cv2
import numpy as np

from handsteer.control.explain import Reason
from handsteer.errors import FrameError, RecordingError
from handsteer.images import encode_jpeg
from handsteer.messages import HAND_SIGN
from handsteer.nodes.status import ControlStatus
from handsteer.plugins.record.camera import picture_of
from handsteer.plugins.record.recorded import Recorded
from handsteer.plugins.record.replay.drive_facts import DriveFacts, Stand
from handsteer.plugins.record.replay.journals import Spin
from handsteer.types import NONE, STOP, Velocity

MOST_PICTURES = 40
_MOST_STANDS = 10_000
_LONGEST_SIDE = 320
_JPEG_QUALITY = 70
_RECENT_FRAMES, _RECENT_BYTES = 60, 16 << 20
_RECENT_COMMANDS, _RECENT_SIGNS = 16, 64
# As the robot, which brakes when no command has come for 0.4 s.
_NO_COMMAND_S = 0.5
_SAME_STAMP_S = 0.001
_PASSES_ZERO_S = 0.15
_NEW_FRAME_S = 1.0
_REASONS = {NONE: Reason("no_sign"), STOP: Reason("stop_sign", STOP)}
_OF_SIGNS = ("no_sign", "stop_sign", "not_started")
# What a camera without new pictures leads to, and how soon before or after the stop it is reported.
_OF_PICTURES = ("no_sign", "no_input", "not_held", "disarmed", "disengaged")
_TROUBLE_HOLDS_S = 1.0


@dataclass
class _Open:
    """A stand that has just begun, until its frame and its reason are known."""

    stand: Stand
    frame: Recorded | None
    sign_number: int = 0
    causes: dict[str, str] = field(default_factory=dict)
    needs_reason: bool = True


class StandLog:
    """Follows the commands of a recording; all times are in seconds of its stamps.

    Args:
        facts: Gets the stands, and the latencies of commands whose frame the journal knows.
        began_s: When the recording began.
        clock_offset_s: What is added to a time in the journal to get its stamp.
    """

    def __init__(self, facts: DriveFacts, began_s: float, clock_offset_s: float) -> None:
        self._facts = facts
        self._began_s = began_s
        self._offset_s = clock_offset_s
        self._frames: deque[Recorded] = deque()
        self._frame_bytes = 0
        self._commands: deque[tuple[float, Stand | None]] = deque(maxlen=_RECENT_COMMANDS)
        self._is_driving = False
        self._signs: OrderedDict[int, str] = OrderedDict()
        self._sign = ""
        self._open: _Open | None = None
        self._troubles: dict[str, tuple[float, str]] = {}
        self._picture_every = 1

    def note_frame(self, frame: Recorded) -> None:
        """Keep a frame for a moment; it is not decoded."""
        self._frames.append(frame)
        self._frame_bytes += len(frame.raw)
        while len(self._frames) > _RECENT_FRAMES or (self._frame_bytes > _RECENT_BYTES and len(self._frames) > 1):
            self._frame_bytes -= len(self._frames.popleft().raw)

    def note_sign(self, number: int, sign: str) -> None:
        """Note a confirmed sign and its number; a sign may be recorded after the command that followed from it."""
        self._sign = sign
        self._signs[number] = sign
        if len(self._signs) > _RECENT_SIGNS:
            self._signs.popitem(last=False)
        if self._open is not None and number and self._open.sign_number == number:
            self._open.stand.sign = sign

    def note_command(self, time_s: float, velocity: Velocity, place: tuple[float, float] | None) -> None:
        """Note a command, and with it the place of the robot."""
        self._expect_command(time_s, place)
        if not velocity.is_zero:
            self._drive(time_s)
        stand = None
        if velocity.is_zero and self._is_driving:
            stand = self._begin(time_s, self._sign, place)
        self._commands.append((time_s, stand))

    def note_status(self, status: ControlStatus) -> None:
        """Note what the control reports."""
        waits = self._open is not None and self._open.needs_reason
        if waits and status.reason is not None and not status.reason.is_driving:
            self._explain(status.reason.code, status.reason.explanation)

    def note_trouble(self, time_s: float, node: str, trouble: str) -> None:
        """Note what ``my_camera`` or ``hand_sign_recognition`` reports as a problem."""
        self._troubles[node] = (time_s, trouble)
        self._find_cause()

    def note_spin(self, spin: Spin) -> None:
        """Note what the control has processed: which frames have led to its last commands."""
        if spin.is_stop and self._open is not None and self._open.needs_reason:
            self._explain("ended", "the run ended")
        got = _leading(spin)
        if not got or len(got) > len(self._commands):
            return
        for (time_s, stand), (captured_s, number) in zip([*self._commands][-len(got) :], got, strict=True):
            self._facts.latencies_ms.add(time_s - self._began_s, (time_s - self._offset_s - captured_s) * 1000)
            if stand is not None and self._open is not None and self._open.stand is stand:
                self._lead(self._open, captured_s, number)

    def end(self, time_s: float) -> None:
        """Finish: the recording ends at ``time_s``."""
        self._expect_command(time_s, None)
        self._settle()

    def _expect_command(self, time_s: float, place: tuple[float, float] | None) -> None:
        """Begin a stand where commands have ceased, because the robot then brakes."""
        if self._is_driving and self._commands and time_s - self._commands[-1][0] > _NO_COMMAND_S:
            self._begin(self._commands[-1][0] + _NO_COMMAND_S, "", place)
            self._explain("no_command", f"no command came for {_NO_COMMAND_S:g} s")

    def _explain(self, code: str, reason: str) -> None:
        assert self._open is not None
        self._open.needs_reason = False
        self._open.stand.code, self._open.stand.reason = code, reason
        self._find_cause()

    def _find_cause(self) -> None:
        """Give the stand that has begun the problems that were reported about then, if they may have led to it."""
        opened = self._open
        if opened is None or opened.stand.code not in _OF_PICTURES:
            return
        for node, (reported_s, trouble) in self._troubles.items():
            if abs(reported_s - self._began_s - opened.stand.time_s) <= _TROUBLE_HOLDS_S:
                opened.causes.setdefault(node, trouble)
        opened.stand.cause = "; ".join(opened.causes.values())

    def _lead(self, opened: _Open, captured_s: float, number: int) -> None:
        """Note which frame and sign have led to a stand."""
        frame = self._captured_at(captured_s + self._offset_s)
        opened.stand.has_led = frame is not None
        opened.frame = frame or opened.frame
        opened.sign_number = number
        opened.stand.sign = self._signs.get(number, opened.stand.sign)

    def _drive(self, time_s: float) -> None:
        self._is_driving = True
        if self._open is not None:
            stand = self._open.stand
            stand.duration_s = time_s - self._began_s - stand.time_s
            if self._open.needs_reason and stand.duration_s < _PASSES_ZERO_S and stand.sign not in _REASONS:
                # From forward to backward, or back.
                self._discard(stand)
        self._settle()

    def _discard(self, stand: Stand) -> None:
        self._open = None
        self._facts.stand_count -= 1
        if self._facts.stands and self._facts.stands[-1] is stand:
            self._facts.stands.pop()

    def _begin(self, time_s: float, sign: str, place: tuple[float, float] | None) -> Stand:
        self._settle()
        self._is_driving = False
        stand = Stand(time_s - self._began_s, sign=sign, place=place)
        self._facts.stand_count += 1
        if len(self._facts.stands) < _MOST_STANDS:
            self._facts.stands.append(stand)
        is_new = bool(self._frames) and time_s - self._frames[-1].time_s < _NEW_FRAME_S
        self._open = _Open(stand, self._frames[-1] if is_new else None)
        return stand

    def _settle(self) -> None:
        """Give the stand that began last its picture, and if the control reported no reason, the one of its sign."""
        opened, self._open = self._open, None
        if opened is None:
            return
        stand = opened.stand
        # A status shows a moment later what the sign was at this one.
        if opened.needs_reason or (stand.has_led and stand.code in _OF_SIGNS):
            reason = _REASONS.get(stand.sign)
            stand.code = reason.code if reason else stand.code
            stand.reason = reason.explanation if reason else stand.reason or "no reason was reported"
        if opened.frame is not None and (self._facts.stand_count - 1) % self._picture_every == 0:
            with suppress(FrameError, RecordingError):
                stand.picture = _small(opened.frame)
                self._limit_pictures()

    def _limit_pictures(self) -> None:
        """Remove every second picture if there are too many."""
        if sum(stand.picture is not None for stand in self._facts.stands) > MOST_PICTURES:
            self._picture_every *= 2
            for index, stand in enumerate(self._facts.stands):
                if index % self._picture_every:
                    stand.picture = None

    def _captured_at(self, stamp_s: float) -> Recorded | None:
        for frame in reversed(self._frames):
            with suppress(RecordingError):
                stamp = frame.message.header.stamp
                if abs(stamp.sec + stamp.nanosec / 1e9 - stamp_s) < _SAME_STAMP_S:
                    return frame
        return None


def _leading(spin: Spin) -> list[tuple[float, int]]:
    """Return for each command of a spin the capture time and the number of what led to it; empty if uncertain."""
    commands = sum(count for topic, count in spin.gave.items() if topic.endswith("cmd_vel"))
    by_topic: dict[str, list[tuple[float, int]]] = {}
    for got in spin.got:
        if got.captured_s is not None and math.isfinite(got.captured_s):
            number = got.number if got.topic.endswith(HAND_SIGN.name) else 0
            by_topic.setdefault(got.topic, []).append((got.captured_s, number))
    return next((led for led in by_topic.values() if len(led) == commands), [])


def _small(frame: Recorded) -> bytes:
    picture = picture_of(frame)
    scale = _LONGEST_SIDE / max(picture.shape[:2])
    if scale < 1:
        picture = np.asarray(cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    return encode_jpeg(picture, _JPEG_QUALITY).tobytes()
