"""The node ``dashboard``: subscribes to everything the page shows, and steers for its viewers."""

import math
import threading
from collections import deque
from dataclasses import replace
from typing import Any, cast

from handsteer.audit import WARN
from handsteer.clock import Clock, to_seconds
from handsteer.errors import TransportError
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    JOINT_STATES,
    ODOM,
    ROBOT_DESCRIPTION,
    SCAN,
    WORLD_MARKERS,
    DiagnosticArray,
    JointState,
    LaserScan,
    Marker,
    MarkerArray,
    Odometry,
    String,
    Topic,
    Twist,
    TwistStamped,
    pose_in,
    velocity_in,
)
from handsteer.nodes.base import Node
from handsteer.nodes.diagnostics import read_status, split_reporter
from handsteer.nodes.status import CameraStatus, ControlStatus, RobotStatus
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.observed import Observed, Person, Report, Task, Viewers
from handsteer.plugins.page.state import COMMAND_HOLDS_S, PageState, compose
from handsteer.plugins.page.viewers import ControlLease, PageAudit
from handsteer.plugins.page.world_state import (
    PERIOD_S,
    Sample,
    VelocityHistory,
    WorldState,
    arc_points,
    place_in_world,
    scan_points,
)
from handsteer.timeouts import HOLD_TIMEOUT_S
from handsteer.transports.base import KnowsTypes, Received, Transport
from handsteer.types import ZERO, Pose2D, Velocity

_WATCH_PERIOD_S = 0.05
_FRAME_COUNTS_KEPT = 6
_ODOMETRY_KEPT = 16
_ODOMETRY_HOLDS_S = 0.5
_SCAN_HOLDS_S = 1.0
# Longer than the control takes to notice that steering has ended, and to report it.
_STEERED_S = 1.0


class DashboardNode(Node):
    """Keeps the newest message of each topic for the page.

    Args:
        steering: Drives when a viewer steers on the page.
        cmd_vel: The topic of the displayed commands. If its type is open and the transport reports types, the commands
            that the control reports are shown instead.
        history: Stores the velocities, including earlier ones; a new one by default.
        audit: Publishes what viewers do; a new one by default.

    Attributes:
        world: The contents of the 3D view.
        history: The velocities of the last 30 s.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        steering: SteeringNode,
        cmd_vel: Topic[Any] = CMD_VEL,
        history: VelocityHistory | None = None,
        *,
        audit: PageAudit | None = None,
    ) -> None:
        super().__init__("dashboard", transport, clock)
        self.world = WorldState()
        self._audit = audit or PageAudit(transport, clock)
        self.lease = ControlLease(self._audit.on_seat)
        self.history = history or VelocityHistory()
        self._observed = Observed()
        self._namespace, _ = split_reporter(transport.full_name(self.name))
        self._frame_counts: deque[tuple[float, float]] = deque(maxlen=_FRAME_COUNTS_KEPT)
        self._odometry: deque[tuple[float, Pose2D]] = deque(maxlen=_ODOMETRY_KEPT)
        self._truth: tuple[Pose2D, Pose2D] | None = None
        self._path_length_m = 0.0
        self._steering = steering
        self._lock = threading.RLock()  # guards the steering viewer and its topic; the server's thread uses them too
        self._holder: tuple[str, float] | None = None
        self._steered: tuple[str, float] | None = None  # who steered last, and when
        self._last_holder: str | None = None
        self._stopper: str | None = None
        self._stopped_for: Task = ""
        self._scan_came_s = -math.inf
        self.subscribe(DIAGNOSTICS, self._on_diagnostics, key=_reporter)
        # A subscriber would count as a robot that takes a Twist, so the control's report is used.
        self._believes_control = cmd_vel.or_type is not None and isinstance(transport, KnowsTypes)
        if not self._believes_control:
            self.subscribe(cmd_vel, self._on_command)
        self.subscribe(ODOM, self._on_odometry)
        self.subscribe(JOINT_STATES, self._on_joints)
        self.subscribe(WORLD_MARKERS, self._on_markers)
        self.subscribe(SCAN, self._on_scan)
        self.subscribe(ROBOT_DESCRIPTION, self._on_description)
        self.every(_WATCH_PERIOD_S, self._watch)
        self.every(PERIOD_S, self._sample)

    def state(self, viewer: str = "") -> PageState:
        """Return the state to show to ``viewer``."""
        now, holder, steered = self.clock.now(), self._holder, self._steered
        may_reset = self.lease.status_of(viewer, now).role != "watcher"
        viewers = Viewers(
            steers=self._person(holder and self._audit.person_of(holder[0]), viewer),
            steered=self._person(steered[0] if steered and now - steered[1] < _STEERED_S else None, viewer),
            stopped=self._person(self._stopper, viewer),
            stopped_for=self._stopped_for,
            may_reset=may_reset,
            topic=self._steering.topic if self._steering.is_direct else "",
            stands=self._steering.is_stopped,
            waits=holder is not None and self._steering.waits,
        )
        return compose(self._observed, now, viewers)

    def steer(self, viewer: str, linear_mps: float, angular_radps: float) -> None:
        """Drive at this velocity if ``viewer`` has the control lease or the lease is free.

        The command holds while the viewer repeats it within :data:`~handsteer.timeouts.HOLD_TIMEOUT_S`. A viewer who
        has not steered last, or who was silent for longer, has to begin with a zero.
        """
        if self.lease.take(viewer, self.clock.now()):
            with self._lock:
                if self._holder is None:
                    self._audit.say("steers", viewer, "steers with pad or keys")
                if viewer != self._last_holder:
                    self._last_holder = viewer
                    self._steering.lose()
                self._holder = (viewer, self.clock.now())
                self._steered = (self._audit.person_of(viewer), self.clock.now())
                self._steering.steer(linear_mps, angular_radps)

    def release(self, viewer: str) -> None:
        """Stop if ``viewer`` is steering."""
        with self._lock:
            if self._holder is not None and self._holder[0] == viewer:
                self._holder = None
                self._steering.release()

    def steer_on(self, viewer: str, topic: str) -> None:
        """Steer on ``topic`` if ``viewer`` has the control lease or the lease is free.

        Raises:
            TransportError: The topic is not valid, another viewer drives, or the robot is stopped.
        """
        if not self.lease.take(viewer, self.clock.now()):
            raise TransportError("only the driver can choose the topic: ask to drive first")
        if self.state().stopped:
            raise TransportError("the robot is stopped: reset it, then choose the topic")
        with self._lock:
            self._holder = None
            self._steering.send_to(topic)
        self._audit.say("steering_topic", viewer, f"steers on {topic}", topic)

    def halt(self, viewer: str = "", task: Task = "") -> None:
        """Stop the robot, whether or not ``viewer`` drives: by its Stop, or for a ``task`` of it on the page."""
        with self._lock:
            self._holder = None
            self._stopper, self._stopped_for = self._audit.person_of(viewer) or None, task
            self._steering.halt()
        done = f"stopped the robot for {task}" if task else "pressed Stop"
        self._audit.say("stop_pressed", viewer, done, level=WARN)

    def reset(self, viewer: str) -> None:
        """Reset Stop if ``viewer`` has the control lease or the lease is free."""
        if self.lease.take(viewer, self.clock.now()):
            with self._lock:
                self._stopper, self._stopped_for = None, ""
                self._steering.reset()
            self._audit.say("reset_pressed", viewer, "pressed Reset")

    def ask_to_drive(self, viewer: str) -> None:
        """Request the control lease; a page of the driver's own browser gets it at once."""
        self.lease.ask(viewer, self.clock.now())
        driver = self.lease.driver
        is_own = driver is not None and self._audit.person_of(driver) == self._audit.person_of(viewer)
        if driver is not None and is_own and self.lease.status_of(viewer, self.clock.now()).asked:
            self.lease.answer(driver, hand_over=True)

    def leave(self, viewer: str) -> None:
        """Stop if ``viewer`` is steering, and release its lease; what is held when it comes back has to be released."""
        with self._lock:
            if self._holder is not None and self._holder[0] == viewer:
                self._lose()
        self.lease.leave(viewer)

    def on_stop(self) -> None:
        """End any motion that was steered from this node."""
        with self._lock:
            if self._holder is not None:
                self.release(self._holder[0])

    def _lose(self) -> None:
        """End steering of which it is not known whether the person has released it."""
        self._holder = None
        self._steering.lose()

    def _person(self, who: str | None, viewer: str) -> Person:
        return "" if not who else "you" if who == self._audit.person_of(viewer) else "another viewer"

    def _watch(self) -> None:
        self.lease.tick(self.clock.now())
        if self.world.scan and self.clock.now() - self._scan_came_s > _SCAN_HOLDS_S:
            self.world = replace(self.world, scan=())
        with self._lock:
            holder, now = self._holder, self.clock.now()
            if holder is not None and (now - holder[1] > HOLD_TIMEOUT_S or not self.lease.drives(holder[0])):
                self._lose()

    def _sample(self) -> None:
        now, observed = self.clock.now(), self._observed
        measured = observed.measured if now - observed.measured_came_s < _ODOMETRY_HOLDS_S else None
        self.history.add(Sample(now, self._command(now), measured))

    def _on_diagnostics(self, received: Received[DiagnosticArray]) -> None:
        now = self.clock.now()
        stamp_s = to_seconds(received.message.header.stamp)
        for message in received.message.status:
            namespace, _ = split_reporter(message.name)
            status = read_status(message) if namespace == self._namespace else None
            if status is None:
                continue  # of another robot, or another program
            before = self._observed.last(ControlStatus)
            if isinstance(status, ControlStatus) and before is not None and before.stopped and not status.stopped:
                self._stopper, self._stopped_for = None, ""  # also where others have reset it
            reports = {**self._observed.reports, type(status): Report(status, now)}
            self._observed = replace(self._observed, reports=reports)
            if isinstance(status, CameraStatus):
                self._frame_counts.append((now, status.frames))
                self._observed = replace(self._observed, frame_counts=tuple(self._frame_counts))
            elif isinstance(status, ControlStatus):
                self._take_command(status)
            elif isinstance(status, RobotStatus):
                self._take_truth(status, stamp_s)
                self._notice_restart(status)

    def _take_truth(self, status: RobotStatus, stamp_s: float) -> None:
        then = self._odometry_at(stamp_s)
        if status.truth is not None and then is not None:
            self._truth = (status.truth, then)

    def _odometry_at(self, stamp_s: float) -> Pose2D | None:
        then = [pose for at_s, pose in self._odometry if at_s <= stamp_s]
        return then[-1] if then else None

    def _notice_restart(self, status: RobotStatus) -> None:
        before_m, self._path_length_m = self._path_length_m, status.path_length_m or 0.0
        if self._path_length_m < before_m:
            self.world = replace(self.world, trail=self.world.trail.restarted())

    def _on_command(self, received: Received[Twist | TwistStamped]) -> None:
        self._note_command(velocity_in(received.message))

    def _take_command(self, status: ControlStatus) -> None:
        if self._believes_control and status.source != "none":
            self._note_command(Velocity(status.linear_mps, status.angular_radps))

    def _command(self, now_s: float) -> Velocity | None:
        """Return the last command; None if it came too long ago."""
        return self._observed.command if now_s - self._observed.command_came_s < COMMAND_HOLDS_S else None

    def _note_command(self, command: Velocity) -> None:
        self._observed = replace(self._observed, command=command, command_came_s=self.clock.now())

    def _on_odometry(self, received: Received[Odometry]) -> None:
        odometry = received.message
        measured, pose = velocity_in(odometry.twist.twist), pose_in(odometry.pose.pose)
        self._observed = replace(self._observed, measured=measured, measured_came_s=self.clock.now())
        self._odometry.append((to_seconds(odometry.header.stamp), pose))
        robot = place_in_world(*self._truth, pose) if self._truth else pose
        arc = arc_points(self._command(self.clock.now()) or ZERO, robot)
        self.world = replace(self.world, robot=robot, trail=self.world.trail.to(robot), arc=arc)

    def _on_joints(self, received: Received[JointState]) -> None:
        names, positions = received.message.name, received.message.position.tolist()
        self.world = replace(self.world, joints=tuple(zip(names, positions, strict=True)))

    def _on_markers(self, received: Received[MarkerArray]) -> None:
        # rosbags types this list with the Marker of an older ROS.
        markers = tuple(cast("list[Marker]", received.message.markers))
        # Markers are repeated with new stamps for late subscribers; views need not compare them again.
        if _drawn(markers) != _drawn(self.world.markers):
            self.world = replace(self.world, markers=markers)

    def _on_scan(self, received: Received[LaserScan]) -> None:
        then = self._odometry_at(to_seconds(received.message.header.stamp))
        self._scan_came_s = self.clock.now()
        if then is not None:
            place = place_in_world(*self._truth, then) if self._truth else then
            self.world = replace(self.world, scan=scan_points(received.message, place))

    def _on_description(self, received: Received[String]) -> None:
        self.world = replace(self.world, description=received.message.data)


def _drawn(markers: tuple[Marker, ...]) -> list[tuple[object, ...]]:
    return [(each.ns, each.id, each.type, each.action, each.pose, each.scale, each.color) for each in markers]


def _reporter(message: DiagnosticArray) -> tuple[str, ...]:
    return tuple(status.name for status in message.status)
