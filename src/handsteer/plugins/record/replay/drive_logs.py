"""Follows the signs, the robot and the things around it through a recording; times are in seconds since it began."""

import math
from itertools import islice
from typing import Any

from handsteer.errors import RecordingError
from handsteer.messages import MarkerArray, yaw_of
from handsteer.nodes.status import RobotStatus
from handsteer.nodes.world_markers import GATES
from handsteer.plugins.record.replay.drive_facts import DriveFacts, Lap, SignSpan, SignTotal, Thing
from handsteer.types import CourseState, Velocity

_MOST_SPANS = 20_000
_MOST_NAMES = 100
_LONGEST_NAME = 60
_OTHERS = "other signs"
# As the control, for which there is no sign when none has come for 0.35 s.
_SIGN_HOLDS_S = 0.35

_LARGEST = 1e6
_MOST_LAPS, _MOST_BUMPS, _MOST_LEAPS = 1000, 1000, 1000
_LEAP_M = 0.5
# Statuses come ten times a second, and later under load.
_STATUS_S = 0.5
# A robot at rest measures a little.
_STANDS_MPS, _STANDS_RADPS = 0.01, 0.02
_LONGEST_STEP_S = 0.5

_MOST_THINGS = 2000
_BOX, _SPHERE, _CYLINDER = 1, 2, 3
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_FARTHEST_M = 1e5


class SignLog:
    """Follows when each sign was the confirmed one, and what single frames showed.

    Args:
        facts: Gets spans, totals and confidences.

    Attributes:
        sign: The newest confirmed sign; empty before the first.
    """

    def __init__(self, facts: DriveFacts) -> None:
        self.sign = ""
        self._facts = facts
        self._span: SignSpan | None = None
        self._index: dict[str, int] = {}

    def note(self, sign: str, time_s: float) -> None:
        """Note the confirmed sign of a frame."""
        self.sign = sign[:_LONGEST_NAME]
        name = _known(self.sign, self._facts.signs)
        total = self._facts.signs.setdefault(name, SignTotal())
        total.frames += 1
        if self._span is not None:
            self._span.end_s = min(time_s, self._span.end_s + _SIGN_HOLDS_S)
        if self._span is None or self._span.sign != name or self._span.end_s < time_s:
            self.end()
            total.times += 1
            self._span = SignSpan(name, time_s, time_s)
            if len(self._facts.spans) < _MOST_SPANS:
                self._facts.spans.append(self._span)

    def note_confidence(self, time_s: float, seen: str, confidence: float) -> None:
        """Note what the newest frame alone shows."""
        name = _known(seen[:_LONGEST_NAME], self._index)
        index = self._index.setdefault(name, len(self._index))
        if index == len(self._facts.seen):
            self._facts.seen.append(name)
        self._facts.confidence.add(time_s, max(0.0, min(confidence, 1.0)), index)

    def end(self) -> None:
        """Close the last span."""
        if self._span is not None:
            self._facts.signs[self._span.sign].seconds += self._span.end_s - self._span.begin_s


def _known(name: str, names: dict[str, SignTotal] | dict[str, int]) -> str:
    """Return ``name``, or a common one if there are too many."""
    return name if name in names or len(names) < _MOST_NAMES else _OTHERS


class RobotLog:
    """Follows the robot: its path, bumps and laps.

    Args:
        facts: Gets the path, the distance, the time of driving, bumps and laps.

    Attributes:
        place: The newest place on the map, x and y in metres; None if it is unknown.
    """

    def __init__(self, facts: DriveFacts) -> None:
        self.place: tuple[float, float] | None = None
        self._facts = facts
        self._odometry: tuple[float, float, float] | None = None
        self._odometry_m = 0.0
        self._moved_s = 0.0
        self._commanded: tuple[float, bool] | None = None
        self._commanded_s = 0.0
        self._path_m: float | None = None
        self._collisions: int | None = None
        self._course: CourseState | None = None

    def note_command(self, time_s: float, velocity: Velocity) -> None:
        """Note a command, from which the time of driving is taken if there is no odometry."""
        if self._commanded is not None and self._commanded[1]:
            self._commanded_s += _step_s(self._commanded[0], time_s)
        self._commanded = (time_s, not velocity.is_zero)

    def note_odometry(self, time_s: float, message: Any) -> None:
        """Note where the robot is and how fast.

        Raises:
            RecordingError: It is not finite.
        """
        position, twist = message.pose.pose.position, message.twist.twist
        numbers = (twist.linear.x, twist.angular.z, position.x, position.y, yaw_of(message.pose.pose.orientation))
        if not all(abs(number) < _LARGEST for number in numbers):
            raise RecordingError("an odometry that is not finite")
        linear, angular, x, y, _ = numbers
        self._facts.driven.add(time_s, linear, angular, x, y)
        if self._odometry is not None:
            before_s, before_x, before_y = self._odometry
            step_m = math.hypot(x - before_x, y - before_y)
            if step_m < _LEAP_M:
                self._odometry_m += step_m
            elif len(self._facts.leaps_s) < _MOST_LEAPS:
                self._facts.leaps_s.append(time_s)
            if abs(linear) > _STANDS_MPS or abs(angular) > _STANDS_RADPS:
                self._moved_s += _step_s(before_s, time_s)
        self._odometry = (time_s, x, y)
        if not len(self._facts.truth):
            self.place = (x, y)

    def note_status(self, time_s: float, status: RobotStatus) -> None:
        """Note what the robot reports."""
        if status.truth is not None:
            self.place = (status.truth.x, status.truth.y)
            self._facts.truth.add(time_s, *self.place)
        if status.path_length_m is not None:
            if self._path_m is not None:
                # It is 0 again when the robot was put to its start.
                gained_m = status.path_length_m - self._path_m
                self._facts.distance_m = (self._facts.distance_m or 0.0) + (
                    gained_m if gained_m >= 0 else status.path_length_m
                )
            self._path_m = status.path_length_m
        self._note_bumps(status.collisions)
        if status.course is not None:
            self._note_course(time_s, status.course)

    def end(self) -> None:
        """Complete the totals."""
        facts = self._facts
        if len(facts.driven):
            facts.driving_s = self._moved_s
            facts.distance_m = self._odometry_m if facts.distance_m is None else facts.distance_m
        elif facts.commands:
            facts.driving_s = self._commanded_s

    def _note_bumps(self, collisions: int | None) -> None:
        if collisions is None:
            return
        self._facts.knows_bumps = True
        before, self._collisions = self._collisions, collisions
        new = 0 if before is None else collisions - before if collisions >= before else collisions
        self._facts.bumps += [self.place] * min(new, _MOST_BUMPS - len(self._facts.bumps))

    def _note_course(self, time_s: float, course: CourseState) -> None:
        before, self._course = self._course, course
        if course.phase == "ready":
            return
        laps = self._facts.laps
        if before is None and course.phase == "finished":
            return  # a lap before the recording
        is_new = before is None or before.phase == "ready" or course.next_gate < before.next_gate
        if is_new and len(laps) < _MOST_LAPS:
            began_s = time_s - course.time_s
            laps.append(Lap(began_s if began_s < -_STATUS_S else max(0.0, began_s), course))
        elif laps:
            laps[-1].course = course


def _step_s(before_s: float, now_s: float) -> float:
    return max(0.0, min(now_s - before_s, _LONGEST_STEP_S))


class MapThings:
    """The things that the markers so far have left on the map; those of other shapes than boxes and discs are not."""

    def __init__(self) -> None:
        self._things: dict[tuple[str, int], Thing] = {}

    def note(self, message: MarkerArray) -> None:
        """Add, change or remove things."""
        for marker in islice(message.markers, _MOST_THINGS):
            key = (marker.ns, marker.id)
            thing = _thing(marker) if marker.action == _ADD else None
            if marker.action == _DELETE_ALL:
                self._things.clear()
            elif thing is not None and (key in self._things or len(self._things) < _MOST_THINGS):
                self._things[key] = thing
            elif marker.action == _DELETE:
                self._things.pop(key, None)

    def all(self) -> list[Thing]:
        """Return all things, obstacles before gates."""
        return sorted(self._things.values(), key=lambda thing: thing.kind == "gate")


def _thing(marker: Any) -> Thing | None:
    position, scale, colour = marker.pose.position, marker.scale, marker.color
    yaw = yaw_of(marker.pose.orientation)
    numbers = (position.x, position.y, yaw, scale.x, scale.y, colour.r, colour.g, colour.b)
    if not all(math.isfinite(number) and abs(number) < _FARTHEST_M for number in numbers):
        return None
    if marker.type not in (_BOX, _SPHERE, _CYLINDER):
        return None
    kind = "gate" if marker.ns == GATES else "box" if marker.type == _BOX else "disc"
    red, green, blue = (round(255 * max(0.0, min(part, 1.0))) for part in (colour.r, colour.g, colour.b))
    return Thing(kind, position.x, position.y, yaw, scale.x, scale.y, (red, green, blue))
