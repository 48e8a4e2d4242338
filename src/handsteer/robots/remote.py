"""A robot behind a topic: publishes its commands, and subscribes to its odometry."""

import logging
import math
import time
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from handsteer.config import RobotConfig
from handsteer.messages import (
    CMD_VEL,
    SAME_SCANNER_RAD,
    LaserScan,
    Odometry,
    Topic,
    TurtlePose,
    pose_in,
    type_name,
    velocity_in,
)
from handsteer.robots import Obstacle, RangeScan, RobotState
from handsteer.robots.command_limiter import CommandLimiter
from handsteer.robots.description import robot_description
from handsteer.transports.base import Received, Session
from handsteer.transports.commands import Commands
from handsteer.transports.timing import Repeats
from handsteer.types import ZERO, Pose2D, Velocity

log = logging.getLogger(__name__)

_NODE = "robot"
# Discovery takes a tenth of a second on one machine, and up to a second or two over a network.
_LOOK_FOR_IT_S = 2.0
_LOOK_AGAIN_S = 0.02
_ZEROS_AT_THE_END = 5
_BETWEEN_ZEROS_S = 0.02
_ODOMETRY_DUE_S = 3.0
_MOST_SCANNERS = 3
_IN_ROS2 = "is its ROS_DOMAIN_ID the same, and, if it is another machine, ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET set?"
_ADVICE = {
    "zenoh": "is it connected to the same Zenoh router?",
    "ros1": "is its ROS_MASTER_URI the same?",
}


@dataclass(frozen=True)
class _Seen:
    """The robot's last odometry, and when it was received, in seconds of its graph's clock."""

    pose: Pose2D
    velocity: Velocity
    at_s: float


class RemoteRobot:
    """A :class:`~handsteer.robots.Robot` in another process, reached by topics.

    :class:`~handsteer.robots.command_limiter.CommandLimiter` computes what is sent. Its odometry counts as the truth,
    and contacts are unknown.

    Args:
        config: Topics, types, limits and timeouts.
        cmd_vel: Topic of its commands, with Twist, TwistStamped or the one that it subscribes to.
        frame_id: Coordinate frame of a TwistStamped.
        session: This process in the robot's graph; the caller closes it, which delivers the last zeros.

    Attributes:
        description: URDF of the robot that represents it in pictures.
    """

    def __init__(self, config: RobotConfig, cmd_vel: Topic[Any], frame_id: str, session: Session) -> None:
        self.description = robot_description()
        self._config = config
        self._session = session
        self._limiter = CommandLimiter(config)
        topic: Topic[Any] = _topic(config.cmd_vel_topic, cmd_vel.type, CMD_VEL.depth)
        self._topic = replace(topic, or_type=cmd_vel.or_type)
        self._odom_topic = _full_name(session, config.odom_topic)
        self._seen: _Seen | None = None
        self._repeats = Repeats()
        self._scanned: list[tuple[LaserScan, float]] = []
        self._scan_frame_id: str | None = None
        self._listens_to_scans = False
        self._senseless = False
        self._linked_s = 0.0
        self._time_s = 0.0
        self._closed = False
        transport = session.transport
        self._cmd_vel = Commands(transport, partial(transport.advertise, _NODE), self._topic, session.clock, frame_id)
        if config.odom_topic:
            kind = TurtlePose if config.odom_type == "turtlesim_pose" else Odometry
            transport.subscribe(_NODE, _topic(config.odom_topic, kind, 1), self._on_odometry)
        self._look_for_it()

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Command a velocity in m/s and rad/s; a slower one is sent at once, a faster one with the next steps."""
        self._send(self._limiter.command(Velocity(linear_mps, angular_radps)))

    def stand(self) -> None:
        """Stop, as :class:`~handsteer.robots.Waiting` has it."""
        self._send(self._limiter.stand())

    def step(self, dt_s: float) -> RobotState:
        """Advance time by ``dt_s`` seconds, send what is due, and return the last known state."""
        self._time_s += dt_s
        changed = self._cmd_vel.follow()
        listens = self._cmd_vel.has_subscribers and not changed
        self._linked_s = self._linked_s + dt_s if listens else 0.0
        seen = self._seen
        is_silent = seen is not None and self._session.clock.now() - seen.at_s > self._config.odom_timeout
        self._send(self._limiter.step(dt_s, linked=listens and not is_silent))
        pose, velocity = (seen.pose, seen.velocity) if seen else (Pose2D(0.0, 0.0, 0.0), ZERO)
        return RobotState(
            time_s=self._time_s,
            odometry=pose,
            linear_mps=0.0 if is_silent else velocity.linear_mps,
            angular_radps=0.0 if is_silent else velocity.angular_radps,
            truth=pose,
            located=seen is not None and not is_silent,
            trouble=self._trouble(listens=listens, is_silent=is_silent),
        )

    def obstacles(self) -> list[Obstacle]:
        """Return an empty list: obstacles are unknown."""
        return []

    def scan(self) -> RangeScan | None:
        """Return a scan received since the last call, the newest of each scanner in turn; the first call subscribes."""
        if self._config.scan_topic and not self._listens_to_scans:
            self._listens_to_scans = True
            topic = _topic(self._config.scan_topic, LaserScan, 1)
            self._session.transport.subscribe(_NODE, topic, self._on_scan)
        if not self._scanned:
            return None
        message, measured_s = self._scanned.pop(0)
        frame_id = message.header.frame_id
        if self._scan_frame_id is None:
            self._scan_frame_id = frame_id
        return RangeScan(
            message.angle_min,
            message.angle_increment,
            message.range_min,
            message.range_max,
            message.ranges,
            max(0.0, self._session.clock.now() - measured_s),
            "" if frame_id == self._scan_frame_id else frame_id,
        )

    def commanders(self) -> list[str]:
        """Return the nodes that publish on its command topic."""
        return self._session.transport.publishers_of(self._topic)

    def close(self) -> None:
        """Send several zeros; may be called twice."""
        if self._closed:
            return
        self._closed = True
        for _ in range(_ZEROS_AT_THE_END):
            self._send(ZERO)
            time.sleep(_BETWEEN_ZEROS_S)

    def _look_for_it(self) -> None:
        deadline_s = time.monotonic() + _LOOK_FOR_IT_S
        while not self._cmd_vel.has_subscribers and time.monotonic() < deadline_s:
            self._cmd_vel.follow()
            time.sleep(_LOOK_AGAIN_S)
        if not self._cmd_vel.has_subscribers:
            log.warning("the robot is not there: %s", self._no_subscriber())

    def _send(self, velocity: Velocity | None) -> None:
        if velocity is not None:
            self._cmd_vel.send(velocity.linear_mps, velocity.angular_radps)

    def _on_odometry(self, received: Received[Any]) -> None:
        message = received.message
        if isinstance(message, Odometry) and self._repeats.has(message.header.stamp, self._session.clock.now()):
            return  # it says nothing of now
        read = _of_turtle if self._config.odom_type == "turtlesim_pose" else _of_odometry
        seen = read(message, self._session.clock.now())
        pose = seen.pose
        self._senseless = not (seen.velocity.is_finite and all(map(math.isfinite, (pose.x, pose.y, pose.yaw))))
        if not self._senseless:
            self._seen = seen

    def _on_scan(self, received: Received[LaserScan]) -> None:
        now = self._session.clock.now()
        scan = received.message
        # Of several scanners on one topic, or sectors, each is passed on: the collision monitor refuses the mixture.
        others = [waiting for waiting in self._scanned if not _is_of_one_scanner(waiting[0], scan)]
        newest = scan, now if received.captured_s is None else received.captured_s
        self._scanned = [*others[-_MOST_SCANNERS:], newest]

    def _trouble(self, *, listens: bool, is_silent: bool) -> str:
        if not listens:
            return f"is not there: {self._no_subscriber()}"
        if self._senseless:
            return f"sends odometry on {self._odom_topic} that is not a number; it is not used"
        if is_silent:
            return f"is silent: {self._odom_topic} has stopped, so the robot is commanded to stop"
        if self._seen is None and self._config.odom_topic and self._linked_s > _ODOMETRY_DUE_S:
            return f"does not report where it is: nothing comes on {self._odom_topic} (robot.odom_topic)"
        return "waits until Stop is shown, or no hand" if self._limiter.waits else ""

    def _no_subscriber(self) -> str:
        name = _full_name(self._session, self._config.cmd_vel_topic)
        kind = " or ".join(type_name(kind) for kind in (self._topic.type, self._topic.or_type) if kind)
        advice = _ADVICE.get(self._config.kind, _IN_ROS2)
        return f"no node subscribes to {name} with {kind}; is it on, are topic and type right, {advice}"


def _is_of_one_scanner(one: LaserScan, other: LaserScan) -> bool:
    return one.header.frame_id == other.header.frame_id and abs(one.angle_min - other.angle_min) <= SAME_SCANNER_RAD


def _topic(name: str, kind: type[Any], depth: int) -> Topic[Any]:
    """Return the topic of this ROS name; a leading slash makes it independent of the node's namespace."""
    return Topic(f"/{name.removeprefix('/')}", kind, is_global=name.startswith("/"), depth=depth)


def _full_name(session: Session, name: str) -> str:
    return name if name.startswith("/") else f"{session.name.rpartition('/')[0]}/{name}"


def _of_odometry(message: Odometry, at_s: float) -> _Seen:
    return _Seen(pose_in(message.pose.pose), velocity_in(message.twist.twist), at_s)


def _of_turtle(message: TurtlePose, at_s: float) -> _Seen:
    velocity = Velocity(message.linear_velocity, message.angular_velocity)
    return _Seen(Pose2D(message.x, message.y, message.theta), velocity, at_s)
