"""Finds in a recording the times at which the robot was commanded to move without a live reason.

What the control says of itself is not enough: each input's own messages have to show it too, as the control has got
them.
"""

import math
from array import array
from collections.abc import Iterable, Mapping
from typing import Final, Literal

from handsteer.config import ControlConfig, JoyConfig
from handsteer.messages import Joy, pointing_in, stick_in
from handsteer.nodes.status import ControlStatus
from handsteer.plugins.record.replay.drive_facts import DriveFacts, Unexplained
from handsteer.timeouts import ROBOT_S
from handsteer.types import Velocity, action_of

SLACK_S: Final = 0.1
"""Messages are recorded so much earlier or later than the control gets them, at most."""

_STATUS_HOLDS_S: Final = 0.5
_STATUS_PERIOD_S: Final = 0.15
"""Statuses come ten times a second, on a busy machine less often: one counts for so long before it, and as long after
the last that says the same."""

_SHORTEST_S: Final = 0.2
"""A motion that is shorter may fall between two statuses."""

_MOST_SPANS: Final = 200_000
_MOST_LISTED: Final = 1000

Input = Literal["signs", "joystick", "steering", "gamepad"]
_SOURCES: Final[Mapping[Input, str]] = {
    "signs": "signs",
    "joystick": "joystick",
    "steering": "steering",
    "gamepad": "steering",
}
_MODES: Final[Mapping[Input, tuple[str, ...]]] = {
    "signs": ("signs",),
    "joystick": ("joystick", "point"),
    "gamepad": ("joystick",),
}

Span = tuple[float, float]


class Level:
    """When something held, of which messages tell: from each to the next, or for ``holds_s``."""

    def __init__(self) -> None:
        self._edges = array("d")  # begin and end in turn

    def note(self, time_s: float, *, on: bool, holds_s: float = math.inf) -> None:
        """Note a message; times never go back."""
        edges = self._edges
        if edges and edges[-1] >= time_s:
            edges[-1] = time_s
        if not on:
            return
        if edges and edges[-1] == time_s:
            edges[-1] = time_s + holds_s
        elif len(edges) < 2 * _MOST_SPANS:
            edges.extend((time_s, time_s + holds_s))

    def spans(self, before_s: float = 0.0, after_s: float = 0.0) -> list[Span]:
        """Return when it held, with something more before and after."""
        begins, ends = self._edges[::2], self._edges[1::2]
        return union((begin - before_s, end + after_s) for begin, end in zip(begins, ends, strict=True))


class ReasonLog:
    """Follows commands, and what may be their reasons; times are in seconds since the recording began.

    Args:
        facts: Gets the times without a reason.
        rule: The control's parameters at the beginning; the defaults, in any mode, if unknown.
        gamepad: How ``/joy`` is read.
    """

    def __init__(self, facts: DriveFacts, rule: ControlConfig | None = None, gamepad: JoyConfig | None = None) -> None:
        self._facts = facts
        self._gamepad = (gamepad or JoyConfig()).model_dump()
        self._rule = rule or ControlConfig()
        self._mode: str | None = _mode_of(rule) if rule else None
        self._moves: dict[str, Level] = {}
        self._inputs: dict[Input, Level] = {name: Level() for name in _SOURCES}
        self._said: dict[str, Level] = {}
        self._watched: list[float] = []
        self._stopped = Level()

    def note_rule(self, rule: ControlConfig) -> None:
        """Note the parameters from now on."""
        self._rule, self._mode = rule, _mode_of(rule)

    def note_sign(self, time_s: float, sign: str) -> None:
        """Note a confirmed sign: any but those that stop may keep a robot in motion."""
        self._note("signs", time_s, self._rule.sign_timeout, on=action_of(sign, self._rule.actions) != "stop")

    def note_steering(self, time_s: float, wanted: Velocity) -> None:
        """Note a steering command."""
        self._note("steering", time_s, self._rule.steering_timeout, on=wanted.is_finite and not wanted.is_zero)

    def note_joystick(self, time_s: float, message: Joy) -> None:
        """Note the state of the hand as a joystick, or where it points."""
        stick = (pointing_in if self._rule.points else stick_in)(message)
        self._note("joystick", time_s, self._rule.sign_timeout, on=stick.held and stick.is_valid)

    def note_gamepad(self, time_s: float, message: Joy) -> None:
        """Note the state of a gamepad."""
        stick = stick_in(message, **self._gamepad)
        self._note("gamepad", time_s, self._rule.steering_timeout, on=stick.held and stick.is_valid)

    def note_stop(self, time_s: float, *, is_stopped: bool) -> None:
        """Note ``/stop``."""
        self._stopped.note(time_s, on=is_stopped)

    def note_command(self, time_s: float, topic: str, velocity: Velocity) -> None:
        """Note a command to a robot, which follows it until the next one, or brakes on its own after a while."""
        self._moves.setdefault(topic, Level()).note(time_s, on=not velocity.is_zero, holds_s=ROBOT_S)

    def note_status(self, time_s: float, status: ControlStatus) -> None:
        """Note what the control reports."""
        if status.rule is not None:
            self.note_rule(status.rule)
        if status.reason is None:
            return
        self._watched = [self._watched[0] if self._watched else time_s, time_s]
        for source in {*_SOURCES.values()}:
            on = status.reason.is_driving and status.source == source
            self._said.setdefault(source, Level()).note(time_s, on=on, holds_s=_STATUS_HOLDS_S)

    def end(self, time_s: float) -> None:
        """Finish: the recording ends at ``time_s``."""
        moved = union(span for level in self._moves.values() for span in level.spans())
        moved = common(moved, [(0.0, time_s)])
        inputs = {name: level.spans(SLACK_S, SLACK_S) for name, level in self._inputs.items()}
        live = union(span for spans in inputs.values() for span in spans)
        stopped = [(begin + SLACK_S, end) for begin, end in self._stopped.spans() if end - begin > SLACK_S]
        found = [(span, "no sign, no steering and no joystick was live") for span in less(moved, live)]
        found += [(span, "it was stopped, until it is reset") for span in common(common(moved, live), stopped)]
        found += [(span, "the control named no reason of its own") for span in self._unsaid(moved, live, inputs)]
        listed = sorted(found)[:_MOST_LISTED]
        self._facts.unexplained = [Unexplained(begin, end, why) for (begin, end), why in listed]

    def _note(self, name: Input, time_s: float, holds_s: float, *, on: bool) -> None:
        on = on and (self._mode is None or self._mode in _MODES.get(name, (self._mode,)))
        self._inputs[name].note(time_s, on=on, holds_s=holds_s)

    def _unsaid(self, moved: list[Span], live: list[Span], inputs: Mapping[Input, list[Span]]) -> list[Span]:
        """Return when it moved by an input that the control did not name then; none without its statuses."""
        if not self._watched:
            return []
        said = {source: level.spans(_STATUS_PERIOD_S, _STATUS_PERIOD_S) for source, level in self._said.items()}
        named = union(span for name, spans in inputs.items() for span in common(spans, said[_SOURCES[name]]))
        begin_s, end_s = self._watched
        watched = common(common(moved, live), [(begin_s, end_s)])
        return [(begin, end) for begin, end in less(watched, named) if end - begin > _SHORTEST_S]


def _mode_of(rule: ControlConfig) -> str:
    return "point" if rule.points else rule.mode


def union(spans: Iterable[Span]) -> list[Span]:
    """Return ``spans`` in order, with those joined that overlap."""
    joined: list[Span] = []
    for begin, end in sorted(spans):
        if joined and begin <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        elif end > begin:
            joined.append((begin, end))
    return joined


def less(these: list[Span], others: list[Span]) -> list[Span]:
    """Return what of ``these`` is in none of ``others``; both are in order and do not overlap."""
    rest: list[Span] = []
    first = 0
    for begin, end in these:
        while first < len(others) and others[first][1] <= begin:
            first += 1
        at, from_s = first, begin
        while at < len(others) and others[at][0] < end:
            if others[at][0] > from_s:
                rest.append((from_s, others[at][0]))
            from_s = max(from_s, others[at][1])
            at += 1
        if from_s < end:
            rest.append((from_s, end))
    return rest


def common(these: list[Span], others: list[Span]) -> list[Span]:
    """Return what is in both; each is in order and does not overlap."""
    return less(these, less(these, others))
