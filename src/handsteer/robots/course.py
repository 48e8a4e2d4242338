"""The referee of a course, which counts gates, bumps and time; without clock or simulator.

The first gate is the start line, the last one the finish, and the time runs between them. A gate counts when the
robot's centre crosses the line between its ends forward, with its left end on the left. Gates are to be passed in
order: passing a later one misses those between. Crossing backwards or a second time does not count.

The score is in seconds, lower is better: the time, and :data:`~handsteer.types.BUMP_S` for each bump and
:data:`~handsteer.types.MISS_S` for each missed gate.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from handsteer.types import CourseState, Phase, Pose2D

if TYPE_CHECKING:
    from handsteer.robots.world import Gate

LEAP_M = 0.5
"""No robot moves so far between two steps: it was moved by hand, and has crossed nothing."""


class Referee:
    """Watches one robot on one course.

    Args:
        gates: In the order in which they are to be passed.

    Attributes:
        state: The progress so far.
    """

    def __init__(self, gates: "Sequence[Gate]") -> None:
        self._gates = tuple(gates)
        self.state = CourseState(len(self._gates))
        self._pose: Pose2D | None = None
        self._collisions = 0
        self._time_s = 0.0

    def step(self, pose: Pose2D, collisions: int, time_s: float) -> CourseState:
        """Take the robot's next pose and return the progress.

        Args:
            pose: Pose of the robot in the world.
            collisions: How often it has begun to touch an obstacle; only differences count.
            time_s: The robot's own time; it never goes back.
        """
        before, self._pose = self._pose, pose
        bumps, self._collisions = collisions - self._collisions, collisions
        elapsed_s, self._time_s = time_s - self._time_s, time_s
        if before is None or self.state.phase == "finished":
            return self.state
        if self.state.phase == "running":
            state = self.state
            self.state = replace(state, time_s=state.time_s + elapsed_s, bumps=state.bumps + max(0, bumps))
        self._pass_gates(before, pose)
        return self.state

    def _pass_gates(self, before: Pose2D, now: Pose2D) -> None:
        # The start cannot be missed: nothing counts before it.
        end = len(self._gates) if self.state.phase == "running" else min(1, len(self._gates))
        for index in range(self.state.next_gate, end):
            if crosses(self._gates[index], before, now):
                missed = self.state.missed.union(range(self.state.next_gate, index))
                phase: Phase = "finished" if index + 1 == len(self._gates) else "running"
                self.state = replace(self.state, next_gate=index + 1, missed=missed, phase=phase)


def crosses(gate: "Gate", before: Pose2D, now: Pose2D) -> bool:
    """Return whether the path from ``before`` to ``now`` crosses ``gate`` forward.

    A pose on the line counts as behind it, so that a path in several pieces crosses once.
    """
    if math.hypot(now.x - before.x, now.y - before.y) > LEAP_M:
        return False
    (left_x, left_y), (right_x, right_y) = gate.left, gate.right
    along_x, along_y = right_x - left_x, right_y - left_y

    def beyond(pose: Pose2D) -> float:
        return along_x * (pose.y - left_y) - along_y * (pose.x - left_x)

    start, end = beyond(before), beyond(now)
    if not start < 0 <= end:
        return False
    part = start / (start - end)
    x, y = before.x + part * (now.x - before.x), before.y + part * (now.y - before.y)
    share = ((x - left_x) * along_x + (y - left_y) * along_y) / (along_x**2 + along_y**2)
    return 0 <= share <= 1
