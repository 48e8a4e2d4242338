import math
from typing import Any, TypeVar

import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import ControlConfig
from handsteer.control.explain import Reason
from handsteer.errors import TransportError
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    JOINT_STATES,
    ODOM,
    ROBOT_DESCRIPTION,
    SCAN,
    STEERING_CMD_VEL,
    DiagnosticArray,
    DiagnosticStatus,
    Header,
    JointState,
    KeyValue,
    LaserScan,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    String,
    Topic,
    Twist,
    TwistWithCovariance,
    cmd_vel,
    twist,
)
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.viewers import OnDemandNode, PageAudit
from handsteer.robots.description import robot_description
from handsteer.timeouts import HOLD_TIMEOUT_S
from handsteer.transports.base import Publisher, Received
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import CourseState, Pose2D, Velocity
from tests.about import about

M = TypeVar("M")


class Bench:
    """The page's node with real steering on a stepped clock."""

    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.transport = InProcessTransport()
        self.steering = SteeringNode(self.transport, self.clock)
        self.node = DashboardNode(self.transport, self.clock, self.steering)
        self.steered: list[tuple[float, float]] = []
        self.transport.subscribe("test", STEERING_CMD_VEL, self._on_steered)

    def _on_steered(self, received: Received[Twist]) -> None:
        self.steered.append((received.message.linear.x, received.message.angular.z))

    def publish(self, topic: Topic[M], message: M) -> None:
        self.transport.advertise("test", topic).publish(message)
        self.node.spin_once()

    def report(self, status: Status, name: str = "") -> None:
        self.publish(DIAGNOSTICS, write_status(status, name or status.node, self.clock.stamp(self.clock.now())))

    def odometry(self, x: float, yaw: float = 0.0, speed: float = 0.0) -> None:
        pose = Pose(Point(x, 0.0, 0.0), Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))
        self.publish(
            ODOM,
            Odometry(
                Header(self.clock.stamp(self.clock.now()), "odom"),
                "base_link",
                PoseWithCovariance(pose, np.zeros(36)),
                TwistWithCovariance(twist(speed, 0.0), np.zeros(36)),
            ),
        )

    def step(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self.node.spin_once()
        self.steering.spin_once()


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_keeps_the_newest_report_of_every_node_that_reports(bench: Bench) -> None:
    bench.report(RecognitionStatus("Go", seen="Go", confidence=0.9, handedness="Left"))
    bench.report(RecognitionStatus("Stop", seen="Stop", confidence=0.8, handedness="Left"))
    bench.report(ControlStatus(Reason("stop_sign", "Stop"), "signs"))
    state = bench.node.state()
    assert (state.recognition.sign, state.recognition.confidence, state.reason) == (
        "Stop",
        0.8,
        "the Stop sign is shown",
    )


def test_tells_the_cameras_frames_a_second(bench: Bench) -> None:
    for frames in (0, 12, 24):
        bench.report(CameraStatus("a clip", "delivers", frames=frames))
        bench.step(0.5)
    assert bench.node.state().fps == pytest.approx(24.0)


class TellingTransport(InProcessTransport):
    """Stands for a graph that tells the types of subscribers."""

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        return set()

    def withdraw(self, publisher: Publisher[Any]) -> None: ...


def test_where_a_subscriber_would_pass_for_a_robot_it_shows_what_the_control_says_that_it_commands(
    bench: Bench,
) -> None:
    bench.transport = TellingTransport()
    bench.node = DashboardNode(bench.transport, bench.clock, bench.steering, cmd_vel("auto"))
    assert not bench.transport.advertise("test", cmd_vel("auto")).has_subscribers
    bench.report(ControlStatus(source="signs", linear_mps=0.5, angular_radps=0.25))
    assert bench.node.state().commanded == Velocity(0.5, 0.25)
    bench.step(1.0)
    bench.report(ControlStatus(source="none", linear_mps=0.5, angular_radps=0.25))
    assert bench.node.state().commanded == Velocity()


def test_shows_commanded_and_measured_velocity(bench: Bench) -> None:
    bench.publish(CMD_VEL, twist(0.5, 0.25))
    bench.odometry(0.0, speed=0.4)
    state = bench.node.state()
    assert (state.commanded.linear_mps, state.commanded.angular_radps) == (0.5, 0.25)
    assert state.measured.linear_mps == 0.4


def test_places_the_robot_by_odometry_when_no_truth_is_known(bench: Bench) -> None:
    bench.odometry(1.0, yaw=0.5)
    assert bench.node.world.robot.x == 1.0
    assert bench.node.world.robot.yaw == pytest.approx(0.5)


def test_places_the_robot_by_its_true_pose_and_odometry_since_then(bench: Bench) -> None:
    bench.odometry(1.0)
    bench.report(RobotStatus(truth=Pose2D(5.0, 2.0, math.pi / 2)))
    bench.step(0.02)
    bench.odometry(1.5)
    assert bench.node.world.robot == Pose2D(
        about(5.0), about(2.5), about(math.pi / 2)
    )  # half a metre on, which is along y there


def test_keeps_the_way_until_the_robot_is_put_back(bench: Bench) -> None:
    bench.report(RobotStatus(path_length_m=0.0))
    for x in (0.0, 0.1, 0.2, 0.2):
        bench.odometry(x)
    points = bench.node.world.trail.points
    assert points == ((0.0, 0.0), (0.1, 0.0), (0.2, 0.0))
    bench.report(RobotStatus(path_length_m=0.2))
    points = bench.node.world.trail.points
    assert len(points) == 3
    bench.report(RobotStatus(path_length_m=0.0))
    bench.odometry(0.0)
    assert bench.node.world.trail.points == ((0.0, 0.0),)


def test_knows_how_far_the_robot_is_on_its_course(bench: Bench) -> None:
    bench.report(RobotStatus())
    assert bench.node.state().robot.course is None
    course = CourseState(8, 2, frozenset({1}), 3, 12.5, "running")
    bench.report(RobotStatus(course=course))
    assert bench.node.state().robot.course == course


def test_a_truth_that_is_none_is_not_taken(bench: Bench) -> None:
    bench.odometry(1.0)
    bench.report(RobotStatus(truth=Pose2D(math.nan, 0.0, 0.0)))
    bench.odometry(2.0)
    assert bench.node.world.robot.x == 2.0


def test_knows_the_robots_shape_and_joints(bench: Bench) -> None:
    bench.publish(ROBOT_DESCRIPTION, String(robot_description()))
    bench.publish(
        JOINT_STATES,
        JointState(Header(bench.clock.stamp(0.0), ""), ["wheel"], np.array([0.5]), np.zeros(1), np.zeros(0)),
    )
    assert bench.node.world.description == robot_description()
    assert dict(bench.node.world.joints) == {"wheel": 0.5}


def test_steers_as_long_as_the_pad_is_held(bench: Bench) -> None:
    bench.node.steer("me", 0.0, 0.0)
    for _ in range(10):
        bench.node.steer("me", 0.3, -0.2)
        bench.step(HOLD_TIMEOUT_S / 2)
    assert set(bench.steered[1:]) == {(0.3, -0.2)}


def test_a_pad_that_was_held_already_has_to_be_released_and_the_page_says_that(bench: Bench) -> None:
    for _ in range(10):
        bench.node.steer("me", 0.3, 0.0)  # the page's process has started again, say
        bench.step(HOLD_TIMEOUT_S / 2)
    assert set(bench.steered) == {(0.0, 0.0)}
    assert bench.node.state("me").reason == "the steering is held: release it first"
    bench.node.release("me")
    press(bench, "me", 0.3)
    assert bench.steered[-1] == (0.3, 0.0)


def test_a_pad_whose_messages_were_held_up_has_to_be_released(bench: Bench) -> None:
    press(bench, "me", 0.3)
    for _ in range(5):
        bench.step(0.1)
    for _ in range(5):
        bench.node.steer("me", 0.3, 0.0)
        bench.step(0.1)
        assert bench.steered[-1] == (0.0, 0.0)


def press(bench: Bench, viewer: str, linear_mps: float) -> None:
    """Touch the pad: the page sends a zero first."""
    bench.node.steer(viewer, 0.0, 0.0)
    bench.node.steer(viewer, linear_mps, 0.0)
    bench.steered.remove((0.0, 0.0))


def test_stops_at_once_when_the_pad_is_let_go(bench: Bench) -> None:
    press(bench, "me", 0.3)
    bench.node.release("me")
    assert bench.steered == [(0.3, 0.0), (0.0, 0.0)]


def test_stops_when_the_page_falls_silent_with_the_pad_held(bench: Bench) -> None:
    press(bench, "me", 0.3)
    for _ in range(6):
        bench.step(0.1)
    assert bench.steered[-1] == (0.0, 0.0)
    heard = len(bench.steered)
    bench.step(1.0)
    assert len(bench.steered) == heard  # then silence, so that others can drive


def test_one_viewer_cannot_stop_what_another_one_steers(bench: Bench) -> None:
    press(bench, "me", 0.3)
    bench.node.release("you")
    assert bench.steered == [(0.3, 0.0)]


def test_who_watches_cannot_steer_until_the_driver_has_left(bench: Bench) -> None:
    press(bench, "driver", 0.3)
    bench.node.steer("watcher", -0.4, 0.0)
    assert bench.steered == [(0.3, 0.0)]
    bench.node.release("driver")
    bench.node.leave("driver")
    assert bench.steered[-1] == (0.0, 0.0)
    bench.node.steer("watcher", -0.4, 0.0)
    assert bench.steered[-1] == (0.0, 0.0), "that pad was held before"
    press(bench, "watcher", -0.4)
    assert bench.steered[-1] == (-0.4, 0.0)


def test_who_watches_cannot_reset(bench: Bench) -> None:
    """The guard: the control lease in ``reset``."""
    press(bench, "driver", 0.3)
    bench.node.halt("watcher")
    bench.node.reset("watcher")
    assert bench.steering.is_stopped
    bench.node.reset("driver")
    assert not bench.steering.is_stopped


def test_the_robot_stops_when_another_takes_over(bench: Bench) -> None:
    press(bench, "driver", 0.3)
    bench.node.lease.ask("watcher", bench.clock.now())
    bench.node.lease.answer("driver", hand_over=True)
    bench.node.steer("driver", 0.3, 0.0)
    bench.step(0.1)
    assert bench.steered[-1] == (0.0, 0.0)


def test_what_a_page_held_when_its_connection_ended_has_to_be_released(bench: Bench) -> None:
    bench.node.steer("driver", 0.0, 0.0)
    bench.node.steer("driver", 0.3, 0.0)
    bench.node.leave("driver")
    bench.step(2.0)
    bench.node.steer("driver", 0.3, 0.0)  # it is connected again, with the pad held as before
    assert bench.steered[-1] == (0.0, 0.0)
    bench.node.steer("driver", 0.0, 0.0)
    bench.node.steer("driver", 0.3, 0.0)
    assert bench.steered[-1] == (0.3, 0.0)


def test_leaves_nothing_in_motion_when_it_stops(bench: Bench) -> None:
    press(bench, "me", 0.3)
    bench.node.stop()
    assert bench.steered[-1] == (0.0, 0.0)


def test_understands_what_control_really_says(bench: Bench) -> None:
    control = HandSignControlNode(bench.transport, bench.clock, ControlConfig())
    press(bench, "me", 0.3)
    for node in (control, control, bench.node):
        bench.clock.advance(0.1)
        node.spin_once()
    state = bench.node.state()
    assert (state.headline, state.reason, state.control.source) == ("Driving", "steered directly", "steering")


def test_a_node_runs_only_while_somebody_watches() -> None:
    transport, clock = InProcessTransport(), SteppedClock()
    reports = transport.advertise("test", DIAGNOSTICS)
    watched = OnDemandNode(lambda: DashboardNode(transport, clock, SteeringNode(transport, clock)))
    wanted = reports.has_subscribers
    assert not wanted
    first = watched.join("me")
    assert watched.join("you") is first
    assert not watched.is_watched_only_by("me")
    assert watched.join("me") is first
    watched.leave("me")
    assert watched.is_watched_only_by("you")
    wanted = reports.has_subscribers
    assert wanted
    watched.leave("you")
    assert not reports.has_subscribers
    watched.leave("you")
    assert watched.join("me") is not first
    watched.close()
    assert not watched.is_watched_by("me")
    assert watched.join("me") is None  # a page that does not know yet must not start it again
    assert not reports.has_subscribers


def test_nodes_of_processes_are_known_by_their_role_and_those_of_other_namespaces_are_left_out(bench: Bench) -> None:
    bench.report(CameraStatus("webcam 0"), "left_camera: my_camera")
    assert bench.node.state().camera == "webcam 0"
    bench.report(CameraStatus("webcam 9"), "r2/my_camera: my_camera")
    assert bench.node.state().camera == "webcam 0"


def test_tells_each_viewer_who_steers_and_who_stopped(bench: Bench) -> None:
    bench.report(ControlStatus(Reason("stopped"), stopped=True))
    bench.node.steer("me", 0.1, 0.0)
    assert [bench.node.state(who).viewers.steers for who in ("me", "you")] == ["you", "another viewer"]
    bench.node.halt("you")
    assert bench.node.state("you").reason == "by you, until the driver resets it"
    assert bench.node.state("me").reason == "by another viewer, until you reset it"
    bench.node.reset("me")
    assert bench.node.state("me").viewers.stopped == ""


def test_what_the_page_stops_the_robot_for_is_not_said_to_be_the_viewers_stop(bench: Bench) -> None:
    bench.report(ControlStatus(Reason("stopped"), stopped=True))
    bench.node.halt("me", "the lesson")
    assert bench.node.state("me").reason == "for the lesson, until you reset it"
    bench.node.halt("me")
    assert bench.node.state("me").reason == "by you, until you reset it"


def test_a_stop_that_others_have_reset_is_not_laid_to_who_stopped_before(bench: Bench) -> None:
    bench.node.halt("me")
    for is_stopped in (True, False, True):
        bench.report(ControlStatus(Reason("stopped"), stopped=is_stopped))
    assert bench.node.state("me").reason == "until you reset it"


def test_who_has_just_let_go_is_who_steered_until_the_control_has_noticed(bench: Bench) -> None:
    bench.node.steer("me", 0.1, 0.0)
    bench.node.release("me")
    assert bench.node.state("me").viewers.steers == ""
    assert bench.node.state("me").viewers.steered == "you"
    bench.step(1.1)
    assert bench.node.state("me").viewers.steered == ""


def test_a_page_of_the_drivers_own_browser_gets_the_seat_at_once() -> None:
    bench = Bench()
    audit = PageAudit(bench.transport, bench.clock)
    bench.node = DashboardNode(bench.transport, bench.clock, bench.steering, audit=audit)
    for page, session in (("drive", "one"), ("settings", "one"), ("other", "two")):
        audit.introduce(page, session, "192.0.2.7")
    bench.node.ask_to_drive("drive")
    bench.node.ask_to_drive("other")
    assert bench.node.lease.driver == "drive"
    bench.node.lease.answer("drive", hand_over=False)
    bench.node.ask_to_drive("settings")
    assert bench.node.lease.driver == "settings"


def test_who_pressed_stop_on_another_page_of_the_same_browser_is_you() -> None:
    bench = Bench()
    audit = PageAudit(bench.transport, bench.clock)
    bench.node = DashboardNode(bench.transport, bench.clock, bench.steering, audit=audit)
    for page, session in (("drive", "one"), ("settings", "one"), ("other", "two")):
        audit.introduce(page, session, "192.0.2.7")
    bench.node.halt("drive")
    audit.forget("drive")
    assert [bench.node.state(page).viewers.stopped for page in ("settings", "other")] == ["you", "another viewer"]


def test_keeps_the_velocities_and_gaps_where_nothing_was_said(bench: Bench) -> None:
    bench.publish(CMD_VEL, twist(0.5, 0.25))
    bench.odometry(0.0, speed=0.4)
    for _ in range(20):
        bench.step(0.1)
    _, samples = bench.node.history.since(0, bench.clock.now())
    assert samples[0].commanded == Velocity(0.5, 0.25)
    assert samples[1].measured == Velocity(0.4, 0.0)
    assert (samples[-1].commanded, samples[-1].measured) == (None, None)


def test_only_who_drives_chooses_the_topic_and_not_while_stopped(bench: Bench) -> None:
    bench.node.steer("me", 0.1, 0.0)
    with pytest.raises(TransportError, match="only the driver"):
        bench.node.steer_on("you", "/cmd_vel")
    bench.report(ControlStatus(Reason("stopped"), stopped=True))
    with pytest.raises(TransportError, match="is stopped"):
        bench.node.steer_on("me", "/cmd_vel")
    bench.report(ControlStatus(Reason("no_sign")))
    bench.node.steer_on("me", "/cmd_vel")
    assert bench.steered[-1] == (0.0, 0.0)
    assert bench.node.state("me").viewers.topic == "/cmd_vel"


def scan_of(bench: Bench, *ranges: float) -> LaserScan:
    header = Header(bench.clock.stamp(bench.clock.now()), "base_scan")
    figures = (0.0, 3.0, 1.0, 0.0, 0.1, 0.05, 8.0)
    return LaserScan(header, *figures, np.array(ranges, np.float32), np.zeros(0, np.float32))


def test_a_scan_is_drawn_where_the_robot_was_when_it_was_measured(bench: Bench) -> None:
    bench.odometry(1.0)
    scan = scan_of(bench, 2.0)
    bench.step(0.05)
    bench.odometry(1.5)
    bench.publish(SCAN, scan)
    assert bench.node.world.scan == ((3.0, 0.0),)


def test_a_scanner_that_falls_silent_is_drawn_no_more(bench: Bench) -> None:
    bench.odometry(0.0)
    bench.publish(SCAN, scan_of(bench, 2.0))
    bench.step(0.5)
    assert bench.node.world.scan
    bench.step(0.6)
    assert bench.node.world.scan == ()


def test_a_report_of_anything_does_not_break_the_page(bench: Bench) -> None:
    header = Header(bench.clock.stamp(0.0), "")
    values = [KeyValue("frames", "nan"), KeyValue("truth_x", ""), KeyValue("reason_code", "why"), KeyValue("", "x")]
    for node in ("my_camera", "hand_sign_recognition", "hand_sign_control", "robot", "somebody", ""):
        bench.publish(DIAGNOSTICS, DiagnosticArray(header, [DiagnosticStatus(7, node, "", "", values)]))
    state = bench.node.state()
    assert (state.headline, state.camera, state.robot.course) == ("Standing", "", None)
    assert bench.node.callback_errors == 0
