"""Follows the robot of a recording: its path, bumps and laps."""

import math
from typing import Any

from handsteer.errors import RecordingError
from handsteer.messages import yaw_of
from handsteer.nodes.status import RobotStatus
from handsteer.replay.drive_facts import DriveFacts, Lap
from handsteer.types import CourseState, Velocity

_LARGEST = 1e6
_MOST_LAPS, _MOST_BUMPS, _MOST_LEAPS = 1000, 1000, 1000
_LEAP_M = 0.5
# A robot at rest measures a little.
_STANDS_MPS, _STANDS_RADPS = 0.01, 0.02
_LONGEST_STEP_S = 0.5


class RobotLog:
    """Follows the robot of a recording; times are in seconds since it began.

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
        self._note_bumps(time_s, status.collisions)
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

    def _note_bumps(self, time_s: float, collisions: int | None) -> None:
        if collisions is None:
            return
        self._facts.knows_bumps = True
        before, self._collisions = self._collisions, collisions
        new = 0 if before is None else collisions - before if collisions >= before else collisions
        for _ in range(min(new, _MOST_BUMPS - len(self._facts.bumps))):
            self._facts.bumps.append((time_s, *(self.place or (None, None))))

    def _note_course(self, time_s: float, course: CourseState) -> None:
        before, self._course = self._course, course
        if course.phase == "ready":
            return
        laps = self._facts.laps
        is_new = before is None or before.phase == "ready" or course.next_gate < before.next_gate
        if is_new and len(laps) < _MOST_LAPS:
            laps.append(Lap(max(0.0, time_s - course.time_s), course))
        elif laps:
            laps[-1].course = course


def _step_s(before_s: float, now_s: float) -> float:
    return max(0.0, min(now_s - before_s, _LONGEST_STEP_S))
