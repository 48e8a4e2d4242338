"""The node ``robot``, which takes velocity commands and publishes odometry, transforms and joint states."""

import logging
import math
import threading
from typing import Any

import numpy as np

from handsteer.clock import Clock
from handsteer.config import RobotConfig
from handsteer.errors import PluginError, quoted
from handsteer.messages import (
    CLOCK,
    CMD_VEL,
    JOINT_STATES,
    NO_STAMP,
    ODOM,
    ROBOT_DESCRIPTION,
    SCAN,
    TF,
    ClockMessage,
    Header,
    JointState,
    LaserScan,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    String,
    TFMessage,
    Topic,
    Transform,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    Vector3,
    is_zero,
    twist,
    velocity_in,
)
from handsteer.nodes.base import Node
from handsteer.nodes.status import RobotStatus
from handsteer.nodes.supervision import Rivals, StopKeeper
from handsteer.nodes.surroundings import Surroundings
from handsteer.nodes.timing import StallGuard
from handsteer.robots import RangeScan, Robot, RobotState, Waiting
from handsteer.transports.base import Call, Received, Transport
from handsteer.types import ZERO, Pose2D, Velocity

log = logging.getLogger(__name__)

_PERIOD_S = 0.02
_SCAN_PERIOD_S = 0.1
_DIAGNOSE_PERIOD_S = 0.1
# After a longer stall of the machine, the simulated robot pauses instead of jumping.
_LONGEST_STEP_S = 0.1
# No robot moves so far within a period: it was moved by hand, or its odometry was reset.
_LEAP_M = 0.5
_LONGEST_END_S = 5.0
"""How long a robot may take to stop and to close."""

# Variances of x, y, z, roll, pitch and yaw, in m² and rad²: wheels measure only the motion in the plane.
_COVARIANCE = np.diag([0.001, 0.001, 1e6, 1e6, 1e6, 0.01]).reshape(-1)


class RobotNode(Node):
    """Drives a robot and publishes its state 50 times a second.

    Args:
        robot: The robot to drive.
        config: Names of the coordinate frames, and whether to publish ``/clock``.
        cmd_vel: Topic of the commands, with Twist or TwistStamped.
        odom, scan: Topics of the odometry and the laser scans.

    Attributes:
        state: The robot's newest state.
        path_length_m: Distance actually driven, without turns in place.
        was_located: Whether its pose was ever known.
        surroundings: The world around it, and what changes it.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        robot: Robot,
        config: RobotConfig,
        cmd_vel: Topic[Any] = CMD_VEL,
        *,
        odom: Topic[Odometry] = ODOM,
        scan: Topic[LaserScan] = SCAN,
    ) -> None:
        super().__init__("robot", transport, clock)
        self._robot = robot
        self._config = config
        self._last_step_s = clock.now()
        self._stall_guard = StallGuard(config.cmd_vel_timeout, clock.now())
        self._command = ZERO
        self._commanded_s = clock.now()
        self.state = _first_state(robot)
        self.path_length_m = 0.0
        self.was_located = self.state.located
        StopKeeper(self)
        self._odom = self.publisher(odom)
        self._tf = self.publisher(TF)
        self._joint_states = self.publisher(JOINT_STATES)
        self._clock_out = self.publisher(CLOCK) if config.publish_clock else None
        self._scan = self.publisher(scan)
        self.publisher(ROBOT_DESCRIPTION).publish(String(data=robot.description))
        self._hears_old = False
        self.subscribe(cmd_vel, self._on_command)
        self._rivals = Rivals(self, [cmd_vel], {config.cmd_vel_topic: robot.commanders})
        self.every(_PERIOD_S, self._step)
        self.every(_SCAN_PERIOD_S, self._publish_scan)
        self.surroundings = Surroundings(
            self, robot, config.odom_frame_id, before_change=self._stand, after_restart=self._start_again
        )
        self.diagnose_every(_DIAGNOSE_PERIOD_S, self._report)

    def services(self) -> dict[str, Call]:
        """Return those of the world around a simulated robot."""
        return self.surroundings.services()

    def on_stop(self) -> None:
        """Stop the robot, and close it even if it fails at that; one that does not return must not keep us running."""
        end = threading.Thread(target=self._guard, args=("stop", self._end_robot), name="end of robot", daemon=True)
        end.start()
        end.join(_LONGEST_END_S)
        if end.is_alive():
            log.error("the robot was not closed within %g s: it may not have stopped", _LONGEST_END_S)

    def _end_robot(self) -> None:
        try:
            self._robot.command(0.0, 0.0)
        finally:
            self._robot.close()

    def _on_command(self, received: Received[Twist | TwistStamped]) -> None:
        now = self.clock.now()
        self._notice_interruption(now)
        if not is_zero(received.message) and (self._stall_guard.distrusts(now) or self._is_old(received.message, now)):
            return
        self._drive(velocity_in(received.message))

    def _is_old(self, message: Twist | TwistStamped, now: float) -> bool:
        """Return whether a stamped command is too old to be obeyed, as in ROS's diff_drive_controller."""
        stamp = message.header.stamp if isinstance(message, TwistStamped) else NO_STAMP
        age_s = 0.0 if stamp == NO_STAMP else now - self.clock.time_of(stamp)
        is_old = age_s > self._config.cmd_vel_timeout
        if is_old and not self._hears_old:
            log.warning("a command that was stamped %.1f s ago is not obeyed: do the clocks of both ends agree?", age_s)
        self._hears_old = is_old
        return is_old

    def _notice_interruption(self, now: float) -> None:
        if self._stall_guard.note(now):
            self._stand()

    def _stand(self) -> None:
        if isinstance(self._robot, Waiting):
            self._command, self._commanded_s = ZERO, self.clock.now()
            self._robot.stand()
        else:
            self._drive(ZERO)

    def _start_again(self) -> None:
        self.state = self._robot.step(0.0)
        self.path_length_m = 0.0

    def _drive(self, velocity: Velocity) -> None:
        self._command, self._commanded_s = velocity, self.clock.now()
        self._robot.command(velocity.linear_mps, velocity.angular_radps)

    def _step(self) -> None:
        self.surroundings.make_changes()
        now = self.clock.now()
        elapsed_s, self._last_step_s = now - self._last_step_s, now
        self._notice_interruption(now)
        before = self.state
        self.state = self._robot.step(min(elapsed_s, _LONGEST_STEP_S))
        self.path_length_m += _distance_m(before, self.state)
        self.was_located |= self.state.located
        self.surroundings.note(self.state)
        stamp = self.clock.stamp(now)
        header = Header(stamp=stamp, frame_id=self._config.odom_frame_id)
        base = self._config.base_frame_id
        if self._clock_out is not None:
            self._clock_out.publish(ClockMessage(clock=stamp))
        if self.state.located:
            self._odom.publish(_odometry(header, base, self.state))
            self._tf.publish(TFMessage(transforms=[_transform(header, base, self.state.odometry)]))
        self._joint_states.publish(_joint_state(Header(stamp=stamp, frame_id=""), self.state))

    def _publish_scan(self) -> None:
        scan = self._robot.scan() if self._scan.has_subscribers else None
        if scan is not None:
            measured_s = self.clock.now() - scan.age_s
            header = Header(stamp=self.clock.stamp(measured_s), frame_id=scan.frame_id or self._config.scan_frame_id)
            self._scan.publish(scan_message(header, scan), measured_s)

    def _report(self) -> RobotStatus:
        state = self.state
        silence_s = self.clock.now() - self._commanded_s
        is_expired = silence_s > self._config.cmd_vel_timeout and self._command != ZERO
        return RobotStatus(
            collisions=state.collisions,
            path_length_m=round(self.path_length_m, 2),
            truth=Pose2D(round(state.truth.x, 3), round(state.truth.y, 3), round(state.truth.yaw, 3)),
            course=self.surroundings.course,
            world=world.name if (world := self.surroundings.world) is not None else "",
            warning=self._rivals.warning or None,
            trouble=state.trouble,
            touches=state.contacts,
            no_command_s=round(silence_s, 1) if is_expired else None,
        )


def _first_state(robot: Robot) -> RobotState:
    """Return the state of the robot as it was opened.

    Raises:
        PluginError: It gives none.
    """
    try:
        state: object = robot.step(0.0)
    except SystemExit as error:
        raise PluginError(f"the first step of the robot {type(robot).__name__} raised SystemExit: {error}") from error
    if not isinstance(state, RobotState):
        raise PluginError(f"the first step of the robot {type(robot).__name__} gave {quoted(state)}, not a RobotState")
    return state


def _distance_m(before: RobotState, after: RobotState) -> float:
    """Return the distance driven; 0 if the pose was unknown, or if the robot was moved by hand."""
    distance_m = math.hypot(after.truth.x - before.truth.x, after.truth.y - before.truth.y)
    return distance_m if before.located and after.located and distance_m < _LEAP_M else 0.0


def _odometry(header: Header, base: str, state: RobotState) -> Odometry:
    return Odometry(
        header=header,
        child_frame_id=base,
        pose=PoseWithCovariance(
            pose=Pose(
                position=Point(state.odometry.x, state.odometry.y, 0.0), orientation=_about_z(state.odometry.yaw)
            ),
            covariance=_COVARIANCE,
        ),
        twist=TwistWithCovariance(twist=twist(state.linear_mps, state.angular_radps), covariance=_COVARIANCE),
    )


def _transform(header: Header, base: str, pose: Pose2D) -> TransformStamped:
    transform = Transform(translation=Vector3(pose.x, pose.y, 0.0), rotation=_about_z(pose.yaw))
    return TransformStamped(header=header, child_frame_id=base, transform=transform)


def _joint_state(header: Header, state: RobotState) -> JointState:
    return JointState(
        header=header,
        name=list(state.joint_positions),
        position=np.array(list(state.joint_positions.values())),
        velocity=np.array(list(state.joint_velocities.values())),
        effort=np.zeros(0),
    )


def _about_z(yaw: float) -> Quaternion:
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def scan_message(header: Header, scan: RangeScan) -> LaserScan:
    """Return ``scan`` as a message; all rays have the same time."""
    return LaserScan(
        header=header,
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + scan.angle_increment * max(0, len(scan.ranges) - 1),
        angle_increment=scan.angle_increment,
        time_increment=0.0,
        scan_time=_SCAN_PERIOD_S,
        range_min=scan.range_min,
        range_max=scan.range_max,
        ranges=scan.ranges,
        intensities=np.zeros(0, np.float32),
    )
