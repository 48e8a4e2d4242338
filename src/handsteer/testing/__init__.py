"""Helpers for tests, ours and those of plug-ins: what fails on request, contracts, and a record of a graph's commands.

``faulty_camera`` and ``fault_transport`` fail on request. ``camera_contract``, ``robot_contract`` and
``transport_contract`` test what each camera, robot and transport must do; these need pytest, and the rest does not.
"""

import math
from bisect import bisect_right

from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, ODOM, Odometry, Twist
from handsteer.transports.base import Received
from handsteer.types import Pose2D


class Trace:
    """Records the commands and the robot's poses in a graph, from its construction on.

    Attributes:
        commands: Linear and angular velocity of each Twist, in m/s and rad/s.
    """

    def __init__(self, graph: Graph) -> None:
        self.commands: list[tuple[float, float]] = []
        self._command_times_s: list[float] = []
        self._times_s: list[float] = []
        self._poses: list[Pose2D] = []
        self._graph = graph
        self._began_s = graph.clock.now()
        graph.transport.subscribe("trace", CMD_VEL, self._on_command)
        graph.transport.subscribe("trace", ODOM, self._on_odometry)

    def pose_at(self, time_s: float) -> Pose2D:
        """Return the robot's actual pose ``time_s`` seconds after the start of the trace."""
        return self._poses[max(0, bisect_right(self._times_s, time_s) - 1)]

    def dead_reckoning(self) -> Pose2D:
        """Return the pose of an ideal robot that follows the commands at once and without slip."""
        x = y = yaw = 0.0
        ends = [*self._command_times_s[1:], self._now()]
        for (linear, angular), begin_s, end_s in zip(self.commands, self._command_times_s, ends, strict=True):
            duration_s = end_s - begin_s
            middle = yaw + angular * duration_s / 2
            x += linear * duration_s * math.cos(middle)
            y += linear * duration_s * math.sin(middle)
            yaw += angular * duration_s
        return Pose2D(x, y, yaw)

    def _now(self) -> float:
        return self._graph.clock.now() - self._began_s

    def _on_command(self, received: Received[Twist]) -> None:
        self._command_times_s.append(self._now())
        self.commands.append((received.message.linear.x, received.message.angular.z))

    def _on_odometry(self, _: Received[Odometry]) -> None:
        self._times_s.append(self._now())
        self._poses.append(self._graph.robot.state.truth)
