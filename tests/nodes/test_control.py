import logging
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import SimulatedClock
from handsteer.config import Config, ControlConfig, JoyConfig
from handsteer.messages import (
    AUDIT,
    CAMERA_CHANGED,
    CMD_VEL,
    DIAGNOSTICS,
    GESTURE_JOY,
    HAND_SIGN,
    JOY,
    ODOM,
    SELECT_ROBOT,
    SELECTED_ROBOT,
    STEERING_CMD_VEL,
    STOP,
    Bool,
    Header,
    Joy,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    String,
    Time,
    Twist,
    TwistWithCovariance,
    cmd_vel,
    is_released,
    joy_of,
    stick_in,
    twist,
)
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.steering import SteeringNode
from handsteer.transports.base import Publisher, Received
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import RELEASED, Stick
from tests.nodes.stepping import Bench

HEADER = Header(stamp=Time(0, 0), frame_id="camera")
JOYSTICK = ControlConfig(mode="joystick")
AHEAD, LEFT = Stick(held=True, forward=0.5), Stick(held=True, left=1.0)


class ControlBench(Bench):
    def __init__(
        self,
        config: ControlConfig | None = None,
        *,
        arming: bool = False,
        engage: bool = False,
        renew: bool = False,
    ) -> None:
        super().__init__()
        config = config or ControlConfig()
        self.control = HandSignControlNode(
            self.transport,
            self.clock,
            config,
            arming=arming,
            engage=engage,
            renew=renew,
            camera_changed=CAMERA_CHANGED,
        )
        self.steering = SteeringNode(self.transport, self.clock)
        self.nodes = [self.steering, self.control]
        self.signs = self.transport.advertise("recognition", HAND_SIGN)
        self.joys = self.transport.advertise("recognition", GESTURE_JOY)
        self.gamepad = self.transport.advertise("gamepad", JOY)
        self.stop = self.transport.advertise("red_button", STOP)
        self.twists = self.record(CMD_VEL)

    def make_gesture(self, *, sign: str = "Stop", is_new: bool = True) -> None:
        """Publish what recognition does at the end of the gesture that engages."""
        for engages in ([False] if is_new else []) + [True] * 3:
            self.signs.publish(String(data=sign), self.clock.now())
            self.joys.publish(joy_of(RELEASED, HEADER, engages=engages), self.clock.now())
            self.run(1 / 30)

    def show(self, *signs: str, age_s: float = 0.0) -> None:
        for sign in signs:
            self.signs.publish(String(data=sign), self.clock.now() - age_s)
            self.run(1 / 30)

    def hold(self, *sticks: Stick, age_s: float = 0.0, on: Publisher[Joy] | None = None) -> None:
        """Publish states of a joystick, by default of the hand, 30 a second."""
        for stick in sticks:
            (on or self.joys).publish(joy_of(stick, HEADER), self.clock.now() - age_s)
            self.run(1 / 30)

    def last(self) -> tuple[float, float]:
        """Return the last command."""
        return self.commands[-1]

    @property
    def commands(self) -> list[tuple[float, float]]:
        return [(round(t.linear.x, 6), round(t.angular.z, 6)) for t in self.twists]


@pytest.fixture
def bench() -> ControlBench:
    return ControlBench()


def test_exactly_one_twist_a_sign(bench: ControlBench) -> None:
    bench.show("Forward", "Forward", "Turn Left", "Go", "Dance", "Stop", "NONE")
    assert bench.commands == [(0.01, 0), (0.02, 0), (0.02, 0.1), (0.02, 0.1), (0.02, 0.1), (0, 0), (0, 0)]


def test_when_signs_stop_one_zero_within_the_timeout_then_silence(bench: ControlBench) -> None:
    bench.show("Forward", "Forward")
    bench.twists.clear()
    bench.run(0.31)
    assert bench.commands == []
    bench.run(0.1)
    assert bench.commands == [(0, 0)]
    bench.run(5.0)
    assert bench.commands == [(0, 0)]


def test_a_sign_from_a_stale_frame_moves_nothing(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 30, age_s=0.6)
    assert bench.commands == []


def test_a_stop_from_a_stale_frame_stops(bench: ControlBench) -> None:
    bench.show("Forward")
    bench.show("Stop", "Forward", age_s=0.6)
    assert bench.commands == [(0.01, 0), (0, 0)]


def test_a_sign_that_the_transport_delivers_late_moves_and_arms_nothing() -> None:
    """The guard: ``is_late`` in ``_is_stale``, for signs, which have no stamp over ROS."""
    bench = ControlBench(arming=True)
    bench.run(2.0)
    for sign in ("Stop", *["Forward"] * 10):
        bench.control._on_sign(Received(String(data=sign), is_late=True))
        bench.run(1 / 30)
    assert set(bench.commands) <= {(0, 0)}
    bench.show(*["Forward"] * 10)
    assert set(bench.commands) <= {(0, 0)}, "the late Stop was no neutral"
    bench.show("Stop", "Forward")
    assert bench.last() == (0.01, 0)


def test_a_late_zero_is_not_a_release(bench: ControlBench) -> None:
    """The guard: a late input only stops in ``_take``."""
    bench.control._on_steering(Received(twist(0.0, 0.0), is_late=True))
    bench.control._on_steering(Received(twist(0.3, 0.0)))
    assert bench.last() == (0, 0)
    bench.control._on_steering(Received(twist(0.0, 0.0)))
    bench.control._on_steering(Received(twist(0.3, 0.0)))
    assert bench.last() == (0.3, 0)


def test_one_zero_at_the_end(bench: ControlBench) -> None:
    bench.show("Forward")
    bench.control.stop()
    assert bench.commands == [(0.01, 0), (0, 0)]


def test_steering_goes_before_signs_and_is_repeated_until_released(bench: ControlBench) -> None:
    bench.show("Forward")
    bench.steering.steer(0.0, 0.0)
    bench.steering.steer(0.5, -1.0)
    bench.run(0.0)
    bench.twists.clear()
    bench.show(*["Forward"] * 60)
    assert set(bench.commands) == {(0.5, -1.0)}
    bench.steering.release()
    bench.run(0.1)
    assert bench.commands[-1] == (0.0, 0.0)
    bench.run(0.5)
    bench.show("Forward")
    assert bench.commands[-1] == (0.01, 0)


def test_steering_that_falls_silent_stops_the_robot(bench: ControlBench) -> None:
    slider = bench.transport.advertise("slider", STEERING_CMD_VEL)
    slider.publish(twist(0.0, 0.0))
    slider.publish(twist(0.5, 0.0))
    bench.run(1.0)
    assert bench.commands == [(0, 0), (0.5, 0), (0, 0)]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_steering_that_is_no_number_means_zero(bench: ControlBench, bad: float) -> None:
    bench.steering.steer(bad, 0.5)
    bench.run(0.05)
    assert set(bench.commands) == {(0, 0)}


def test_latency_and_reason_are_told(bench: ControlBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(*["Forward"] * 9, age_s=0.02)
    status = statuses[-1].status[0]
    values = {value.key: value.value for value in status.values}
    assert status.message == "driving: Forward"
    assert values["source"] == "signs"
    assert float(values["latency_median_ms"]) == pytest.approx(20.0, abs=0.1)


def test_after_it_was_held_up_nothing_that_waited_is_obeyed(bench: ControlBench) -> None:
    bench.show("Forward", "Forward")
    for _ in range(5):
        bench.signs.publish(String(data="Forward"))
    bench.transport.advertise("slider", STEERING_CMD_VEL).publish(twist(0.5, 0.0))
    bench.clock.advance(5.0)
    bench.run(0.02)
    bench.signs.publish(String(data="Forward"))  # came out of a socket a moment later
    bench.run(0.3)
    assert bench.commands == [(0.01, 0), (0.02, 0), (0, 0)]
    bench.show("Forward")
    assert bench.commands[-1] == (0.01, 0)


def test_signs_that_come_all_at_once_count_each(bench: ControlBench) -> None:
    for sign in ("Forward", "Forward", "Turn Left", "Forward"):
        bench.signs.publish(String(data=sign))
    bench.run(0.01)
    assert bench.commands == [(0.01, 0), (0.02, 0), (0.02, 0.1), (0.03, 0)]


def test_no_latency_is_told_where_signs_come_without_the_time_of_their_frame(bench: ControlBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    for _ in range(9):
        bench.signs.publish(String(data="Forward"))
        bench.run(1 / 30)
    assert "latency_median_ms" not in {value.key for value in statuses[-1].status[0].values}


def reconfigure(bench: ControlBench, **control: object) -> None:
    bench.control.reconfigure(Config.model_validate({"control": control}))
    bench.run(0.0)


def test_a_lower_limit_is_commanded_before_the_next_sign(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 10)
    reconfigure(bench, max_linear=0.05)
    assert bench.commands[-2:] == [(0.1, 0), (0.05, 0)]
    bench.show("Forward")
    assert bench.commands[-1] == (0.05, 0)


def test_a_new_configuration_of_a_robot_that_stands_says_nothing(bench: ControlBench) -> None:
    reconfigure(bench, max_linear=5.0, linear_step=1.0)
    assert bench.commands == []
    bench.show("Forward")
    assert bench.commands == [(1.0, 0)]


def test_a_shorter_timeout_counts_at_once(bench: ControlBench) -> None:
    bench.show("Forward")
    reconfigure(bench, sign_timeout=0.1)
    bench.run(0.1)
    assert bench.commands[-1] == (0, 0)


def test_a_longer_timeout_is_no_interruption(bench: ControlBench) -> None:
    reconfigure(bench, sign_timeout=2.0)
    bench.show("Forward")
    bench.clock.advance(1.0)  # longer than the timeout of before
    bench.show("Forward")
    assert bench.commands == [(0.01, 0), (0.02, 0)]


def test_the_newest_of_several_configurations_counts(bench: ControlBench) -> None:
    bench.show("Forward")
    for limit in (0.5, 0.3, 0.005):
        bench.control.reconfigure(Config.model_validate({"control": {"max_linear": limit}}))
    bench.run(0.0)
    assert bench.commands == [(0.01, 0), (0.005, 0)]


def test_a_stamped_command_has_the_time_of_the_command_and_a_frame() -> None:
    bench = Bench()
    bench.clock.advance(7.0)
    topic, config = cmd_vel("twist_stamped"), ControlConfig(cmd_vel_frame_id="r1/base_link")
    bench.nodes = [HandSignControlNode(bench.transport, bench.clock, config, topic)]
    commands = bench.record(topic)
    bench.transport.advertise("recognition", HAND_SIGN).publish(String(data="Forward"), 6.8)
    bench.run(0.0)
    (command,) = commands
    assert (command.header.stamp.sec, command.header.stamp.nanosec) == (7, 0)
    assert (command.header.frame_id, command.twist.linear.x) == ("r1/base_link", 0.01)
    bench.nodes[0].stop()
    assert commands[-1].twist == twist(0.0, 0.0)


def stop(bench: ControlBench, value: bool) -> None:
    bench.transport.advertise("page", STOP).publish(Bool(data=value))
    bench.run(0.0)


def test_stop_holds_against_signs_and_steering(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 3)
    stop(bench, True)
    assert bench.commands[-1] == (0.0, 0.0)
    bench.show(*["Forward"] * 3)
    bench.transport.advertise("slider", STEERING_CMD_VEL).publish(twist(0.5, 0.0))
    bench.run(0.0)
    assert set(bench.commands[3:]) == {(0, 0)}


def test_a_reset_alone_moves_nothing(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 3)
    stop(bench, True)
    stop(bench, False)
    bench.show(*["Forward"] * 5)
    assert set(bench.commands[3:]) == {(0, 0)}
    bench.show(*["NONE"] * 8, *["Forward"] * 5)
    assert set(bench.commands[3:]) == {(0, 0)}, "a hand that is missed for a few frames was not let go"
    bench.show(*["NONE"] * 16, "Forward")
    assert bench.commands[-1] == (0.01, 0)


def test_a_none_that_a_fault_made_is_not_a_hand_let_go(bench: ControlBench) -> None:
    stop(bench, True)
    stop(bench, False)
    for _ in range(10):  # as recognition has it when frames come by fits and starts
        bench.show(*["Forward"] * 5)
        bench.run(0.35)
        bench.show("NONE")
    for _ in range(5):  # and while none come
        bench.run(0.5)
        bench.show("NONE")
    bench.show(*["Forward"] * 5)
    assert set(bench.commands) == {(0, 0)}


@pytest.mark.parametrize("after_s", [0.0, 2.1, 30.0])
def test_steering_that_is_held_when_it_starts_has_to_let_go_and_the_reason_says_that(after_s: float) -> None:
    bench = ControlBench()
    statuses = bench.record(DIAGNOSTICS)
    slider = bench.transport.advertise("slider", STEERING_CMD_VEL)
    bench.run(after_s)
    for _ in range(50):
        slider.publish(twist(0.3, 0.0))
        bench.run(0.1)
    assert set(bench.commands) == {(0, 0)}
    assert statuses[-1].status[0].message == "standing: the steering is held: release it first"
    slider.publish(twist(0.0, 0.0))
    slider.publish(twist(0.3, 0.0))
    bench.run(0.1)
    assert bench.last() == (0.3, 0)


def test_a_gamepad_that_is_held_when_it_starts_has_to_let_go() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(*[AHEAD] * 90, on=bench.gamepad)
    assert set(bench.commands) == {(0, 0)}
    bench.hold(RELEASED, AHEAD, on=bench.gamepad)
    assert bench.last() == (0.5, 0)


def test_a_gamepad_at_rest_was_seen_released_and_leaves_a_held_pad_waiting() -> None:
    bench = ControlBench(JOYSTICK)
    slider = bench.transport.advertise("slider", STEERING_CMD_VEL)
    for _ in range(30):
        bench.hold(RELEASED, on=bench.gamepad)
        slider.publish(twist(0.3, 0.0))
        bench.run(0.05)
    assert set(bench.commands) == {(0, 0)}
    bench.run(1.0)
    bench.hold(RELEASED, AHEAD, on=bench.gamepad)
    assert bench.last() == (0.5, 0)


def test_steering_that_was_held_through_a_reset_has_to_let_go(bench: ControlBench) -> None:
    slider = bench.transport.advertise("slider", STEERING_CMD_VEL)
    slider.publish(twist(0.0, 0.0))

    def steer(speed: float) -> None:
        slider.publish(twist(speed, 0.0))
        bench.run(0.1)

    steer(0.5)
    stop(bench, True)
    steer(0.5)
    stop(bench, False)
    steer(0.5)
    assert bench.commands[-1] == (0.0, 0.0)
    steer(0.0)
    steer(0.5)
    assert bench.commands[-1] == (0.5, 0)


def test_its_services_stop_and_reset_as_the_topic_does(bench: ControlBench) -> None:
    services = bench.control.services()
    bench.show("Forward")
    assert services["stop"]() == "stopped, until it is reset"
    bench.show("Forward", "Stop", "Forward")
    assert set(bench.commands[1:]) == {(0, 0)}
    assert services["reset"]() == "reset"
    bench.show("Stop", "Forward")
    assert bench.commands[-1] == (0.01, 0)


def test_says_that_it_is_stopped_and_then_disarmed_and_how_it_moves_again(bench: ControlBench) -> None:
    statuses = bench.record(DIAGNOSTICS)

    def says() -> str:
        bench.run(0.1)
        return statuses[-1].status[0].message

    bench.show(*["Forward"] * 3)
    stop(bench, True)
    assert says() == "standing: stopped, until it is reset"
    stop(bench, False)
    bench.show("Forward")
    assert says() == "ready: show Stop or lower your hand to begin"
    bench.steering.steer(0.0, 0.0)
    bench.steering.steer(0.5, 0.0)
    stop(bench, True)
    stop(bench, False)
    assert says() == "standing: the steering is held: release it first"
    bench.steering.release()
    assert says() == "standing: steered directly, at zero"


def test_tells_its_limits(bench: ControlBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.run(0.2)
    values = {value.key: value.value for value in statuses[-1].status[0].values}
    assert (values["max_linear"], values["max_angular"]) == ("1.0", "2.0")


def test_a_reset_without_a_stop_changes_nothing(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 3)
    stop(bench, False)
    bench.show("Forward")
    assert bench.commands[-1] == (0.04, 0)


STOP_EVENTS = st.lists(
    st.sampled_from(["Forward", "Backward", "NONE", "Stop", "steer", "let go", "pause", "stop", "reset"])
)


@given(events=STOP_EVENTS)
def test_whatever_happens_a_stopped_robot_stands(events: list[str]) -> None:
    bench, is_stopped = ControlBench(), False
    for event in events:
        if event in {"stop", "reset"}:
            before = bench.commands[-1:]
            is_stopped = event == "stop"
            stop(bench, is_stopped)
            if event == "reset":
                assert bench.commands[-1:] == before
        elif event == "pause":
            bench.run(1.0)
        elif event in {"steer", "let go"}:
            speed_mps = 0.5 if event == "steer" else 0.0
            bench.transport.advertise("slider", STEERING_CMD_VEL).publish(twist(speed_mps, 0.0))
            bench.run(0.0)
        else:
            bench.show(event)
        if is_stopped:
            assert bench.commands[-1] == (0, 0)


class FleetBench(Bench):
    NAMES = ("r1", "r2", "r3")

    def __init__(self, *, arming: bool = False) -> None:
        super().__init__()
        self.reports = self.record(DIAGNOSTICS)
        config = ControlConfig.model_validate({"robots": self.NAMES, "actions": {"Peace": "next_robot"}})
        self.control = HandSignControlNode(self.transport, self.clock, config, arming=arming)
        self.steering = SteeringNode(self.transport, self.clock)
        self.nodes = [self.steering, self.control]
        self.signs = self.transport.advertise("recognition", HAND_SIGN)
        self.select = self.transport.advertise("operator", SELECT_ROBOT)
        self.selected = self.record(SELECTED_ROBOT)
        self.told = {name: self.record(replace(CMD_VEL, name=f"/{name}{CMD_VEL.name}")) for name in self.NAMES}

    def show(self, sign: str, count: int = 1) -> None:
        for _ in range(count):
            self.signs.publish(String(data=sign), self.clock.now())
            self.run(1 / 30)

    def choose(self, name: str) -> None:
        self.select.publish(String(data=name))
        self.run(0.02)

    def reason(self) -> str:
        self.run(0.1)
        return str(self.reports[-1].status[0].message)

    def moving(self) -> list[str]:
        return [name for name, told in self.told.items() if told and told[-1].linear.x != 0.0]


def test_one_robot_of_several_is_driven_and_the_first_is_the_first() -> None:
    bench = FleetBench()
    bench.show("Forward", 5)
    assert bench.moving() == ["r1"]
    assert (bench.told["r2"], bench.told["r3"]) == ([], [])
    assert bench.selected[-1].data == "r1"


def test_the_old_robot_is_told_to_stand_and_the_new_one_moves_after_stop_only() -> None:
    bench = FleetBench()
    bench.show("Forward", 5)
    bench.choose("r3")
    assert bench.selected[-1].data == "r3"
    bench.show("Forward", 20)
    assert bench.moving() == []
    assert bench.told["r1"][-10:] == [twist(0.0, 0.0)] * 10
    assert all(message == twist(0.0, 0.0) for message in bench.told["r3"])
    bench.show("Stop")
    bench.show("Forward")
    assert bench.moving() == ["r3"]
    assert bench.told["r3"][-1].linear.x == pytest.approx(0.01)


def test_while_it_is_deactivated_a_selection_commands_nothing() -> None:
    bench = FleetBench()
    bench.show("Forward", 5)
    bench.choose("r2")
    bench.control.set_active(False)
    sent = {name: len(told) for name, told in bench.told.items()}
    assert bench.told["r1"][-1] == twist(0.0, 0.0)
    bench.choose("r3")
    bench.run(0.2)
    assert bench.selected[-1].data == "r3"
    assert {name: len(told) for name, told in bench.told.items()} == sent
    bench.control.set_active(True)
    bench.run(0.2)
    assert {name: len(told) for name, told in bench.told.items() if name != "r3"} == {
        "r1": sent["r1"],
        "r2": sent["r2"],
    }


def test_a_sign_that_is_held_selects_the_next_robot_once() -> None:
    bench = FleetBench()
    bench.show("Peace", 30)
    assert [message.data for message in bench.selected] == ["r1", "r2"]
    for _ in range(2):
        bench.show("NONE", 3)
        bench.show("Peace", 3)
    assert [message.data for message in bench.selected] == ["r1", "r2", "r3", "r1"]


def test_steering_has_to_let_go_too_before_it_drives_the_next_robot() -> None:
    bench = FleetBench()
    bench.steering.steer(0.0, 0.0)
    bench.steering.steer(0.2, 0.0)
    bench.run(0.5)
    assert bench.moving() == ["r1"]
    bench.choose("next")
    bench.run(1.0)
    assert bench.moving() == []
    bench.steering.release()
    bench.run(0.05)
    bench.steering.steer(0.2, 0.0)
    bench.run(0.5)
    assert bench.moving() == ["r2"]


def test_it_says_whether_another_robot_was_selected_or_something_failed() -> None:
    bench = FleetBench(arming=True)
    bench.show("NONE", 60)
    bench.show("Forward", 5)
    assert bench.reason() == "driving: Forward"
    bench.choose("r2")
    bench.show("Forward", 5)
    assert bench.reason() == "ready: show Stop or lower your hand to begin with r2 (it was selected)"
    bench.show("NONE", 30)
    bench.show("Forward", 5)
    assert bench.moving() == ["r2"]
    bench.run(1.0)
    assert bench.reason() == "ready: show Stop or lower your hand to begin with r2 (no sign came)"


def test_a_robot_that_is_not_there_is_not_selected(caplog: pytest.LogCaptureFixture) -> None:
    bench = FleetBench()
    bench.show("Forward", 5)
    bench.choose("r9")
    assert bench.moving() == ["r1"]
    assert "there is no robot 'r9' to select; there are r1, r2, r3" in caplog.text


EVENTS = st.lists(
    st.sampled_from(
        ["Forward", "Turn Left", "Stop", "NONE", "Peace", "select r1", "select r2", "select next", "steer", "let go"]
    ),
    max_size=40,
)


@given(events=EVENTS)
def test_only_one_robot_is_ever_driven_and_none_before_its_hand_let_go(events: list[str]) -> None:
    bench = FleetBench()
    for event in events:
        before = bench.selected[-1].data
        if event in {"steer", "let go"}:
            bench.steering.steer(0.2 if event == "steer" else 0.0, 0.0)
        elif event.startswith("select"):
            bench.choose(event.removeprefix("select "))
        else:
            bench.show(event, 3)
        bench.run(0.05)
        assert set(bench.moving()) <= {bench.selected[-1].data}
        if bench.selected[-1].data != before:
            assert bench.moving() == []
    bench.control.stop()
    assert bench.moving() == []


def test_who_has_no_page_reads_in_the_log_that_it_waits_for_neutral(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    bench = Bench()
    robot = bench.record(CMD_VEL)
    bench.nodes = [HandSignControlNode(bench.transport, bench.clock, ControlConfig(), arming=True)]
    signs = bench.transport.advertise("recognition", HAND_SIGN)

    def show(sign: str, count: int) -> None:
        for _ in range(count):
            signs.publish(String(data=sign), bench.clock.now())
            bench.run(1 / 30)

    show("Forward", 60)
    assert set(map(str, robot)) == {str(twist(0.0, 0.0))}
    show("NONE", 20)
    show("Forward", 3)
    assert robot[-1].linear.x > 0.0
    bench.run(1.0)
    show("Forward", 30)
    assert robot[-1] == twist(0.0, 0.0)
    assert [record.message for record in caplog.records if "armed" in record.message] == [
        "disarmed (has just started): nothing moves by signs before Stop was shown, or no hand",
        "armed: signs count again",
        "disarmed (no sign came): nothing moves by signs before Stop was shown, or no hand",
    ]


@pytest.mark.parametrize("word", ["x" * 100_000, "Go\x1b[2J", "Forward\n"], ids=["long", "escape", "line"])
def test_what_cannot_be_the_name_of_a_sign_stops_and_is_no_neutral(word: str) -> None:
    bench = ControlBench(arming=True)
    bench.show(*["Stop"] * 40, *["Forward"] * 10)
    assert bench.twists[-1].linear.x > 0.0
    bench.show(word)
    assert bench.twists[-1] == twist(0.0, 0.0)
    bench.show(*[word] * 60)
    bench.show(*["Forward"] * 3)
    assert bench.twists[-1] == twist(0.0, 0.0), "neutral has to be shown"


@pytest.mark.parametrize("robots", [(), ("r1", "r2")], ids=["one robot", "several"])
def test_neutral_that_no_robot_can_follow_does_not_count(
    robots: tuple[str, ...], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    bench = Bench()
    config = ControlConfig(robots=robots)
    bench.nodes = [control := HandSignControlNode(bench.transport, bench.clock, config, arming=True)]
    signs = bench.transport.advertise("recognition", HAND_SIGN)
    for _ in range(90):
        signs.publish(String(data="Stop"), bench.clock.now())
        bench.run(1 / 30)
        assert not control._report().armed
    assert len([record for record in caplog.records if "arm" in record.message]) == 1


def test_who_has_no_page_reads_in_the_log_that_the_hand_has_to_engage(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    bench = ControlBench(arming=True, engage=True)
    bench.show(*["Stop"] * 20, *["Forward"] * 20)
    bench.make_gesture()
    bench.show(*["Forward"] * 5)
    assert bench.twists[-1].linear.x > 0.0
    bench.run(1.0)
    assert [record.message for record in caplog.records if "arm" in record.message or "engaged" in record.message] == [
        "disarmed (has just started): nothing moves by signs before Stop was shown, or no hand",
        "disengaged: open, close and open your hand to begin",
        "armed: signs count once the hand has engaged",
        "engaged: the hand drives",
        "disarmed (no sign came): nothing moves by signs before Stop was shown, or no hand",
        "disengaged: open, close and open your hand to begin",
    ]


def test_a_robot_that_is_let_grow_slowly_is_not_said_to_stand() -> None:
    bench = Bench()
    config = ControlConfig(max_linear_acceleration=0.05)
    bench.nodes = [HandSignControlNode(bench.transport, bench.clock, config, arming=True)]
    twists, statuses = bench.record(CMD_VEL), bench.record(DIAGNOSTICS)
    odom = bench.transport.advertise("robot", ODOM)
    steering = bench.transport.advertise("slider", STEERING_CMD_VEL)
    for _ in range(40):
        steering.publish(twist(0.0, 0.0))
        bench.run(0.05)
    for _ in range(60):
        steering.publish(twist(1.0, 0.0))
        odom.publish(odometry(twists[-1]))
        bench.run(0.05)
    assert statuses[-1].status[0].message == "driving: steered directly"
    assert twists[-1].linear.x == pytest.approx(0.15, abs=0.02)
    for speed_mps, says in ((0.1, "stopping"), (0.01, "standing")):
        steering.publish(twist(0.0, 0.0))
        odom.publish(odometry(twist(speed_mps, 0.0)))
        bench.run(0.12)
        assert statuses[-1].status[0].message == f"{says}: steered directly, at zero"


def odometry(moving: Twist, stamp: Time | None = None) -> Odometry:
    origin = Pose(position=Point(0.0, 0.0, 0.0), orientation=Quaternion(0.0, 0.0, 0.0, 1.0))
    return Odometry(
        header=Header(stamp=stamp or Time(0, 0), frame_id="odom"),
        child_frame_id="base_link",
        pose=PoseWithCovariance(pose=origin, covariance=np.zeros(36)),
        twist=TwistWithCovariance(twist=moving, covariance=np.zeros(36)),
    )


def test_a_robot_that_nobody_hears_is_not_driven_on() -> None:
    bench = Bench()
    node = HandSignControlNode(bench.transport, bench.clock, ControlConfig(), arming=True)
    bench.nodes = [node]
    statuses = bench.record(DIAGNOSTICS)
    signs = bench.transport.advertise("recognition", HAND_SIGN)
    for sign in ["Stop"] * 60 + ["Forward"] * 60:
        signs.publish(String(data=sign), bench.clock.now())
        bench.run(1 / 30)
    values = {value.key: value.value for value in statuses[-1].status[0].values}
    assert values["linear_mps"] == "0.0"
    assert "no robot listens" in statuses[-1].status[0].message


@pytest.mark.parametrize("repeats", [False, True])
@pytest.mark.parametrize("arming", [False, True])
def test_odometry_that_falls_silent_stops_the_ramp_and_disarms(arming: bool, repeats: bool) -> None:
    """A robot whose process slept must not wake to what was shown meanwhile, wherever it is simulated."""
    bench = ControlBench(arming=arming)
    odom = bench.transport.advertise("robot", ODOM)
    said: list[Odometry] = []

    def show(sign: str, count: int, *, is_heard: bool) -> None:
        for _ in range(count):
            if is_heard:
                stamp = bench.clock.stamp(1.0 + bench.clock.now())
                said.append(odometry(bench.twists[-1] if bench.twists else twist(0.0, 0.0), stamp))
            if is_heard or repeats:
                odom.publish(said[-1])
            bench.show(sign)

    show("NONE", 60, is_heard=True)
    show("Forward", 30, is_heard=True)
    assert bench.last() == (0.3, 0)
    show("Forward", 90, is_heard=False)
    assert bench.last() == (0, 0)
    show("Forward", 30, is_heard=True)
    assert bench.last() == (0, 0)
    assert bench.control._report().message.endswith("to begin (the robot's odometry has stopped)")
    show("Stop", 1, is_heard=True)
    show("Forward", 1, is_heard=True)
    assert bench.last() == (0.01, 0)


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("stands", [False, True])
@pytest.mark.parametrize("where", ["x", "w"])
def test_odometry_whose_pose_is_not_a_number_counts_as_none(where: str, *, stands: bool, value: float) -> None:
    bench = ControlBench(arming=True)
    odom = bench.transport.advertise("robot", ODOM)

    def show(sign: str, count: int, *, is_number: bool) -> None:
        for _ in range(count):
            moves = twist(0.0, 0.0) if stands or not bench.twists else bench.twists[-1]
            message = odometry(moves, bench.clock.stamp(1.0 + bench.clock.now()))
            pose = message.pose.pose
            if not is_number:
                setattr(pose.position if where == "x" else pose.orientation, where, value)
            odom.publish(message)
            bench.show(sign)

    show("NONE", 60, is_number=True)
    show("Forward", 90, is_number=False)
    assert bench.last() == (0, 0)
    assert bench.control._report().message.endswith("to begin (the robot's odometry has stopped)")


def test_odometry_that_comes_while_the_node_starts_has_not_stopped() -> None:
    """To subscribe takes seconds on a busy machine."""
    bench = ControlBench()
    bench.clock.advance(1.5)
    odom = bench.transport.advertise("robot", ODOM)
    odom.publish(odometry(twist(0.0, 0.0), bench.clock.stamp(1.0 + bench.clock.now())))
    bench.run(0.01)
    bench.show(*["Forward"] * 10)
    assert bench.last()[0] > 0.0


def test_nothing_ramps_while_no_robot_listens() -> None:
    bench = Bench()
    bench.nodes = [HandSignControlNode(bench.transport, bench.clock, ControlConfig())]
    signs = bench.transport.advertise("recognition", HAND_SIGN)
    for number in range(60):
        if number == 50:
            twists = bench.record(CMD_VEL)
        signs.publish(String(data="Forward"), bench.clock.now())
        bench.run(1 / 30)
    assert twists[0].linear.x <= 0.02


def test_topics_may_be_others() -> None:
    bench = Bench()
    sign, steering = replace(HAND_SIGN, name="/my_sign"), replace(STEERING_CMD_VEL, name="/my_steering")
    topic = replace(CMD_VEL, name="/my_cmd_vel")
    pad = SteeringNode(bench.transport, bench.clock, steering=steering)
    bench.nodes = [
        HandSignControlNode(bench.transport, bench.clock, ControlConfig(), topic, sign=sign, steering=steering),
        pad,
    ]
    commands, steered = bench.record(topic), bench.record(steering)
    bench.transport.advertise("recognition", sign).publish(String(data="Forward"))
    bench.run(0.05)
    assert [command.linear.x for command in commands] == [0.01]
    pad.steer(0.0, 0.0)
    pad.steer(0.2, 0.0)
    bench.run(0.05)
    assert not pad.is_direct
    assert (steered[-1].linear.x, commands[-1].linear.x) == (0.2, 0.2)


def test_the_hand_as_a_joystick_is_one_twist_a_frame_in_proportion() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, Stick(held=True), AHEAD, LEFT, Stick(held=True, forward=-1.0, left=-0.5), RELEASED)
    assert bench.commands == [(0, 0), (0, 0), (0.5, 0), (0, 2), (-1, -1), (0, 0)]


def test_a_joystick_that_is_held_from_the_start_moves_nothing() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(*[AHEAD] * 60)
    assert set(bench.commands) == {(0, 0)}


def test_when_the_joystick_falls_silent_one_zero_and_it_must_be_released_first() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, AHEAD)
    bench.twists.clear()
    bench.run(1.0)
    assert bench.commands == [(0, 0)]
    bench.hold(*[AHEAD] * 10)
    assert set(bench.commands) == {(0, 0)}
    bench.hold(RELEASED, AHEAD)
    assert bench.last() == (0.5, 0)


def test_a_joystick_from_a_stale_frame_moves_nothing_but_stops() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED)
    bench.hold(AHEAD, age_s=0.6)
    assert bench.commands == [(0, 0)]
    bench.hold(AHEAD)
    bench.hold(RELEASED, age_s=0.6)
    assert bench.commands == [(0, 0), (0.5, 0), (0, 0)]


@pytest.mark.parametrize(
    ("axes", "buttons"),
    [([], []), ([0.0, 1.0], []), ([0.0], [1]), ([math.nan, 1.0], [1]), ([0.0, math.inf], [1])],
)
def test_an_incomplete_joystick_stops_the_robot(axes: list[float], buttons: list[int]) -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, AHEAD)
    bench.joys.publish(Joy(HEADER, np.array(axes, np.float32), np.array(buttons, np.int32)), bench.clock.now())
    bench.run(0.05)
    assert bench.last() == (0, 0)


def test_axes_beyond_one_are_full_deflection() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, Stick(held=True, forward=50.0, left=-1e30))
    assert bench.last() == (1, -2)


@pytest.mark.parametrize(
    ("axes", "buttons", "is_release"),
    [
        ([0.0, 0.0], [0], True),  # of a recogniser that knows no pointing
        ([0.0, 1.0], [1], False),
        ([0.0, 0.0, 0.5, 1.0], [0, 0, 1], False),
        ([0.0, 0.0, 0.0, 0.0], [0, 0, 0], True),
    ],
)
def test_a_hand_that_neither_holds_nor_points_is_released(
    axes: list[float], buttons: list[int], is_release: bool
) -> None:
    message = Joy(header=HEADER, axes=np.array(axes, np.float32), buttons=np.array(buttons, np.int32))
    assert is_released(message) == is_release


@pytest.mark.parametrize("limit", ["max_linear", "max_angular"])
@pytest.mark.parametrize("mode", ["joystick", "signs"])
def test_a_higher_limit_makes_what_is_held_no_faster(mode: str, limit: str) -> None:
    bench = ControlBench(ControlConfig(mode=mode, max_linear=0.5, max_angular=0.5))
    control, steering = bench.control, bench.transport.advertise("pad", STEERING_CMD_VEL)

    def hold(forward: float) -> None:
        if mode == "joystick":
            bench.hold(Stick(forward > 0.0, forward, forward))
        else:
            steering.publish(twist(9.0 * forward, 9.0 * forward))
            bench.run(1 / 30)

    hold(0.0)
    hold(1.0)
    assert bench.last() == (0.5, 0.5)
    control.reconfigure(Config(control=ControlConfig(mode=mode, **{"max_linear": 0.5, "max_angular": 0.5, limit: 1.0})))
    for _ in range(10):
        hold(1.0)
    assert bench.last() == (0, 0)
    for _ in range(20):
        hold(0.0)
    hold(1.0)
    assert max(bench.last()) == 1.0


def test_while_a_stop_is_in_force_the_audit_has_nothing_that_is_followed() -> None:
    bench = ControlBench()
    audit = bench.record(AUDIT)
    bench.show("Forward", "Forward")
    for _ in range(20):
        bench.stop.publish(Bool(data=True))
        bench.show("Forward", "Forward", "Forward")
    said = [each.msg for each in audit if "follows" in each.msg]
    assert said == ["follows signs", "follows nothing"]


def test_signs_do_not_drive_in_the_mode_of_the_joystick_nor_the_joystick_in_that_of_signs() -> None:
    bench = ControlBench(JOYSTICK)
    bench.show(*["Forward"] * 10)
    assert bench.commands == []
    bench = ControlBench()
    bench.hold(RELEASED, AHEAD, AHEAD)
    assert bench.commands == []
    assert not bench.joys.has_subscribers


def test_the_mode_can_change_and_then_neutral_comes_first(bench: ControlBench) -> None:
    bench.show("Forward", "Forward")
    bench.control.reconfigure(Config(control=JOYSTICK))
    bench.hold(*[AHEAD] * 10)
    assert set(bench.commands[2:]) == {(0, 0)}
    bench.hold(*[RELEASED] * 20, AHEAD)
    assert bench.last() == (0.5, 0)
    bench.control.reconfigure(Config())
    bench.show("Forward")
    assert bench.last() == (0, 0)
    bench.show("Stop", "Forward")
    assert bench.last() == (0.01, 0)


def change_camera(bench: ControlBench) -> None:
    bench.transport.advertise("my_camera", CAMERA_CHANGED).publish(String(data="webcam 0"), bench.clock.now())
    bench.run(0.0)


def test_another_camera_stops_the_robot_until_neutral_is_seen_by_it(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 3)
    change_camera(bench)
    assert bench.last() == (0, 0)
    bench.show(*["Forward"] * 5)
    assert set(bench.commands[3:]) == {(0, 0)}
    assert bench.control._report().message == ("ready: show Stop or lower your hand to begin (the camera was changed)")
    bench.show("Stop", "Forward")
    assert bench.last() == (0.01, 0)


def test_a_neutral_of_the_camera_before_is_not_one_of_the_other(bench: ControlBench) -> None:
    bench.show(*["Forward"] * 3)
    change_camera(bench)
    bench.show(*["Stop"] * 2, age_s=0.2)  # their frames were captured before the change
    bench.show(*["Forward"] * 5)
    assert set(bench.commands[3:]) == {(0, 0)}


def test_another_camera_stops_steering_and_the_joystick_too() -> None:
    for joystick in (False, True):
        bench = ControlBench(JOYSTICK)
        if joystick:
            bench.hold(RELEASED, AHEAD, AHEAD)
        else:
            bench.steering.steer(0.0, 0.0)
            bench.steering.steer(0.3, 0.0)
            bench.run(0.1)
        assert bench.last()[0] > 0
        change_camera(bench)
        done = len(bench.commands)
        bench.hold(*[AHEAD] * 5) if joystick else bench.run(0.2)
        assert set(bench.commands[done - 1 :]) == {(0, 0)}


def test_a_gamepad_goes_before_the_hand_while_its_button_is_held() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, AHEAD)
    bench.hold(RELEASED, LEFT, LEFT, on=bench.gamepad)
    assert bench.last() == (0, 2)
    bench.hold(AHEAD)
    assert bench.last() == (0, 2)
    bench.hold(RELEASED, RELEASED, on=bench.gamepad)
    assert bench.last() == (0, 0)
    count = len(bench.commands)
    bench.hold(*[RELEASED] * 30, on=bench.gamepad)
    assert set(bench.commands[count:]) <= {(0, 0)}
    bench.hold(RELEASED, AHEAD)
    assert bench.last() == (0.5, 0), "a gamepad at rest leaves the robot to the hand"


@pytest.mark.parametrize("age_s", [0.6, 3600.0, -3600.0], ids=["a moment ago", "an hour ago", "in an hour"])
def test_a_gamepad_with_a_stamp_of_another_time_is_not_followed(age_s: float, caplog: pytest.LogCaptureFixture) -> None:
    bench = ControlBench(JOYSTICK)
    bench.clock.advance(7200.0)
    bench.run(0.5)
    bench.hold(RELEASED, *[AHEAD] * 10, age_s=age_s, on=bench.gamepad)
    assert set(bench.commands) <= {(0, 0)}
    assert caplog.text.count("/joy is stamped") == 1
    bench.hold(*[AHEAD] * 10, on=bench.gamepad)
    assert set(bench.commands) <= {(0, 0)}, "its release was of another time too"
    bench.hold(RELEASED, AHEAD, on=bench.gamepad)
    assert bench.last() == (0.5, 0)


def test_a_gamepad_whose_stamp_stands_is_one_message() -> None:
    bench = ControlBench(JOYSTICK)
    bench.hold(RELEASED, AHEAD, on=bench.gamepad)
    stamped_s = bench.clock.now()
    for _ in range(13):  # longer than the timeout, less than the age at which it is stale and then times out
        bench.gamepad.publish(joy_of(AHEAD, HEADER), stamped_s)
        bench.run(1 / 30)
    assert bench.last() == (0, 0)
    bench.hold(*[AHEAD] * 3, on=bench.gamepad)
    assert bench.last() == (0, 0), "it may have been held since long"
    bench.hold(RELEASED, AHEAD, on=bench.gamepad)
    assert bench.last() == (0.5, 0)


def test_a_gamepad_without_stamps_counts_on_arrival() -> None:
    bench = ControlBench(JOYSTICK)
    for stick in (RELEASED, *[AHEAD] * 60):
        bench.gamepad.publish(joy_of(stick, HEADER))
        bench.run(1 / 30)
    assert bench.last() == (0.5, 0)
    bench.run(0.5)
    assert bench.last() == (0, 0)


def test_button_and_axes_of_the_gamepad_are_those_of_the_configuration() -> None:
    bench = ControlBench(JOYSTICK)
    rule = JoyConfig(enable_button=5, axis_linear=3, axis_angular=2)
    bench.nodes = [HandSignControlNode(bench.transport, bench.clock, JOYSTICK, gamepad=rule)]
    axes, buttons = np.array([1, 1, 0, 0.25], np.float32), np.array([0, 0, 0, 0, 0, 1], np.int32)
    for pressed in (0 * buttons, buttons):
        bench.gamepad.publish(Joy(HEADER, axes, pressed), bench.clock.now())
        bench.run(0.05)
    assert bench.last() == (0.25, 0)


def test_nothing_moves_before_the_gesture_engaged_the_hand() -> None:
    bench = ControlBench(engage=True)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.show(*["Stop"] * 60)
    bench.show(*["Forward"] * 3)
    assert set(bench.commands) == {(0, 0)}, "a palm that is held does not engage"
    assert diagnostics[-1].status[0].message == "disengaged: open, close and open your hand to begin"
    bench.make_gesture()
    bench.show("Stop", "Forward")
    assert bench.last() == (0.01, 0)
    bench.run(1.0)
    bench.show("Stop", "Forward")
    assert bench.last() == (0, 0), "a fault disengages"


def test_a_gesture_that_is_old_or_was_made_before_engages_nothing() -> None:
    bench = ControlBench(engage=True)
    bench.show("Stop", "Stop")
    for engages in (False, True, True):
        bench.joys.publish(joy_of(RELEASED, HEADER, engages=engages), bench.clock.now() - 0.6)
        bench.show("Stop")
    assert not bench.control._report().engaged, "it is old"
    bench.make_gesture()
    assert bench.control._report().engaged
    for is_stopped in (True, False):
        bench.stop.publish(Bool(data=is_stopped))
        bench.run(0.01)
    bench.make_gesture(is_new=False)
    assert not bench.control._report().engaged, "it was made before the Stop"
    bench.make_gesture()
    assert bench.control._report().engaged


def test_an_old_message_makes_no_old_gesture_new() -> None:
    bench = ControlBench(engage=True)
    bench.make_gesture()
    bench.stop.publish(Bool(data=True))
    bench.run(0.1)
    bench.stop.publish(Bool(data=False))
    bench.run(0.1)
    bench.joys.publish(joy_of(RELEASED, HEADER, engages=True), bench.clock.now() - 0.5)
    bench.run(0.01)
    bench.make_gesture(is_new=False)
    assert not bench.control._safety.engagement.engaged


@pytest.mark.parametrize("ahead_s", [0.1, 1000.0])
def test_a_hand_whose_stamp_does_not_advance_is_one_message(ahead_s: float) -> None:
    bench = ControlBench(ControlConfig(mode="joystick"))
    stamped_s = bench.clock.now() + ahead_s
    header = replace(HEADER, stamp=bench.clock.stamp(stamped_s))
    bench.hold(RELEASED)
    for _ in range(60):
        bench.joys.publish(joy_of(AHEAD, header), stamped_s)
        bench.run(1 / 30)
    assert [velocity for velocity in bench.commands if velocity != (0, 0)] == [(0.5, 0)]
    assert bench.last() == (0, 0)


def test_a_sign_whose_action_changes_while_it_is_shown_starts_nothing() -> None:
    bench = ControlBench(ControlConfig(actions={"Peace": "stop"}), arming=True)
    bench.show(*["Peace"] * 60)
    bench.control.reconfigure(Config(control=ControlConfig(actions={"Peace": "forward"})))
    bench.show(*["Peace"] * 60)
    assert set(bench.commands) == {(0, 0)}
    bench.show(*["Stop"] * 30, *["Peace"] * 30)
    assert bench.last()[0] > 0


def test_while_the_simulators_clock_stands_still_nothing_moves() -> None:
    real_s = 0.0
    clock, transport = SimulatedClock(lambda: real_s), InProcessTransport()
    clock.tell(100.0)
    control = HandSignControlNode(transport, clock, ControlConfig(), arming=True)
    sign, commands = transport.advertise("another_recognition", HAND_SIGN), list[float]()
    transport.subscribe("robot", CMD_VEL, lambda received: commands.append(received.message.linear.x))

    def show(what: str, seconds: float, *, pace: float = 1.0) -> None:
        nonlocal real_s
        for _ in range(round(seconds * 30)):
            real_s += 1 / 30
            if pace:
                clock.tell(100.0 + real_s)
            sign.publish(String(data=what))
            control.spin_once()

    show("Stop", 2.0)
    show("Forward", 1.0)
    assert commands[-1] > 0.0
    show("Forward", 0.5, pace=0.0)
    assert commands[-1] == 0.0, "within half a second, as after each fault"
    show("Forward", 2.5, pace=0.0)
    assert commands[-1] == 0.0
    heard = len(commands)
    show("Stop", 1.0, pace=0.0)
    show("Forward", 1.0, pace=0.0)
    show("Forward", 1.0)
    assert set(commands[heard:]) <= {0.0}, "neutral that was shown meanwhile does not count"
    show("Stop", 1.0)
    show("Forward", 1.0)
    assert commands[-1] > 0.0


def test_where_no_signs_come_the_finger_points_nowhere() -> None:
    bench = ControlBench(ControlConfig(rule="point"))

    def point(sign: str, stick: Stick) -> None:
        if sign:
            bench.signs.publish(String(data=sign), bench.clock.now())
        bench.joys.publish(joy_of(RELEASED, HEADER, pointing=stick), bench.clock.now())
        bench.run(1 / 30)

    for _ in range(30):
        point("NONE", RELEASED)
    for _ in range(30):
        point("Forward", AHEAD)
    assert bench.last()[0] > 0
    for _ in range(30):
        point("", AHEAD)
    assert bench.last() == (0, 0)


def test_a_gesture_while_it_is_stopped_engages_nothing() -> None:
    bench = ControlBench(engage=True)
    bench.stop.publish(Bool(data=True))
    bench.make_gesture()
    assert not bench.control._report().engaged


def test_a_gesture_without_an_open_palm_engages_nothing() -> None:
    bench = ControlBench(engage=True)
    bench.show("Stop", "Forward")
    bench.make_gesture(sign="NONE")
    assert not bench.control._report().engaged


def test_the_hand_as_a_joystick_moves_nothing_while_signs_drive() -> None:
    bench = ControlBench(engage=True)
    bench.make_gesture()
    bench.show("Stop")
    bench.hold(RELEASED, AHEAD, AHEAD)
    assert set(bench.commands) == {(0, 0)}
    bench.show("Forward", "Forward")
    bench.hold(RELEASED, age_s=0.6)
    bench.show("Forward")
    assert bench.last() == (0.03, 0), "nor does an old release stop them"


def test_how_the_hand_engages_may_be_changed() -> None:
    bench = ControlBench(engage=True)
    bench.control.reconfigure(Config(control=ControlConfig(engage_by="hold")))
    bench.run(0.02)
    bench.make_gesture()
    assert not bench.control._report().engaged
    bench.show(*["Stop"] * 32)
    assert bench.control._report().engaged


def test_nothing_moves_before_an_open_palm_that_is_held_engaged_the_hand() -> None:
    bench = ControlBench(ControlConfig(engage_by="hold"), engage=True)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.show(*["Forward"] * 30)
    assert set(bench.commands) == {(0, 0)}
    reported = {pair.key: pair.value for pair in diagnostics[-1].status[0].values}
    assert diagnostics[-1].status[0].message == "disengaged: hold an open palm for 1 s to begin"
    assert reported["engaged"] == "False"
    bench.show(*["Stop"] * 32, "Forward")
    assert bench.last() == (0.01, 0)
    bench.run(1.0)
    bench.show("NONE", "Forward")
    assert bench.last() == (0, 0), "a fault disengages"


def test_a_sign_that_does_not_change_ends_after_a_warning_and_has_to_be_shown_anew() -> None:
    bench = ControlBench(ControlConfig(renew_time=6.0), renew=True)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.show(*["Forward"] * 60)
    assert bench.last()[0] > 0.0
    bench.show(*["Forward"] * 90)
    assert diagnostics[-1].status[0].message == "driving: Forward; stops in 2 s unless it changes"
    bench.show(*["Forward"] * 60)
    assert bench.last() == (0, 0)
    reported = {pair.key: pair.value for pair in diagnostics[-1].status[0].values}
    assert reported["reason_code"] == "renew"
    words = "ready: the same sign for 6 s: show Stop or lower your hand, then show it again"
    assert diagnostics[-1].status[0].message == words
    bench.show("Stop", "Forward")
    assert bench.last() == (0.01, 0)


def test_a_stick_that_is_stuck_ends_and_has_to_be_released() -> None:
    bench = ControlBench(JOYSTICK.model_copy(update={"renew_time": 2.0}), renew=True)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.hold(RELEASED, *[AHEAD] * 70)
    assert bench.last() == (0, 0)
    assert diagnostics[-1].status[0].message == "standing: the stick has not moved for 2 s: release it first"
    bench.hold(RELEASED, AHEAD)
    assert bench.last() == (0.5, 0)


def test_steering_that_never_changes_ends_and_has_to_be_released() -> None:
    bench = ControlBench(ControlConfig(renew_time=2.0), renew=True)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.steering.steer(0.0, 0.0)
    bench.run(0.1)
    for _ in range(25):
        bench.steering.steer(0.3, 0.0)
        bench.run(0.1)
    assert bench.last() == (0, 0)
    assert diagnostics[-1].status[0].message == "standing: the stick has not moved for 2 s: release it first"
    bench.steering.steer(0.0, 0.0)
    bench.run(0.1)
    bench.steering.steer(0.3, 0.0)
    bench.run(0.1)
    assert bench.last() == (0.3, 0)


def test_the_gesture_engages_the_joystick_too() -> None:
    bench = ControlBench(JOYSTICK, arming=True, engage=True)
    for frame in range(40):
        if frame == 35:
            bench.make_gesture()
        bench.signs.publish(String(data="Stop"), bench.clock.now())
        bench.hold(RELEASED)
    bench.hold(AHEAD)
    assert bench.last() == (0.5, 0)


def test_steering_that_was_held_while_the_control_was_stalled_has_to_let_go() -> None:
    """The guard: ``stall`` in ``_elapsed``."""
    bench = ControlBench(ControlConfig(steering_timeout=2.0))
    slider = bench.transport.advertise("slider", STEERING_CMD_VEL)

    def steer(speed: float) -> None:
        slider.publish(twist(speed, 0.0))
        bench.run(0.1)

    steer(0.0)
    steer(0.5)
    assert bench.last() == (0.5, 0)
    bench.clock.advance(0.5)  # the process stood still
    bench.run(0.2)  # and what comes in the next moment is ignored anyway
    steer(0.5)
    assert bench.last() == (0, 0)
    steer(0.0)
    steer(0.5)
    assert bench.last() == (0.5, 0)


NO_JOYS = {
    "not a number": Joy(HEADER, np.array([0.0, math.nan], np.float32), np.array([1, 0, 1], np.int32)),
    "infinite": Joy(HEADER, np.array([0.0, math.inf, 0.0, math.inf], np.float32), np.array([1, 0, 1], np.int32)),
    "no axes": Joy(HEADER, np.zeros(0, np.float32), np.array([1, 0, 1], np.int32)),
    "empty": Joy(HEADER, np.zeros(0, np.float32), np.zeros(0, np.int32)),
}


@pytest.mark.parametrize("wrong", NO_JOYS)
def test_a_message_of_a_gamepad_that_is_not_valid_is_not_a_release(wrong: str) -> None:
    bench = ControlBench(ControlConfig(mode="joystick"), arming=True)
    bench.hold(*[AHEAD] * 60, on=bench.gamepad)  # held since the start
    bench.gamepad.publish(NO_JOYS[wrong])
    bench.run(1 / 30)
    bench.hold(*[AHEAD] * 10, on=bench.gamepad)
    assert set(bench.commands) == {(0, 0)}
    bench.hold(RELEASED, *[AHEAD] * 5, on=bench.gamepad)
    assert bench.last()[0] > 0
    bench.gamepad.publish(NO_JOYS[wrong])  # and while it drives, it stops
    bench.run(1 / 30)
    bench.hold(*[AHEAD] * 10, on=bench.gamepad)
    assert bench.last() == (0, 0)


@pytest.mark.parametrize("wrong", NO_JOYS)
def test_a_gamepad_that_says_nothing_valid_leaves_the_robot_to_the_hand(wrong: str) -> None:
    bench = ControlBench(ControlConfig(mode="joystick"))
    bench.hold(RELEASED, AHEAD)
    for _ in range(10):
        bench.gamepad.publish(NO_JOYS[wrong])
        bench.hold(AHEAD)
    assert bench.last()[0] > 0


@pytest.mark.parametrize("wrong", NO_JOYS)
@pytest.mark.parametrize("config", [ControlConfig(mode="joystick"), ControlConfig(rule="point")])
def test_a_message_of_the_hand_that_is_not_valid_is_not_a_release(wrong: str, config: ControlConfig) -> None:
    bench = ControlBench(config)

    def show(*sticks: Stick) -> None:
        for stick in sticks:
            joy = joy_of(RELEASED, HEADER, pointing=stick) if config.points else joy_of(stick, HEADER)
            bench.signs.publish(String(data="Forward" if stick.held else "NONE"), bench.clock.now())
            bench.joys.publish(joy, bench.clock.now())
            bench.run(1 / 30)

    show(*[RELEASED] * 30, *[AHEAD] * 30)
    assert bench.last()[0] > 0
    bench.joys.publish(NO_JOYS[wrong], bench.clock.now())
    bench.run(1 / 30)
    show(*[AHEAD] * 10)
    assert bench.last() == (0, 0)
    show(*[RELEASED] * 30, *[AHEAD] * 30)
    assert bench.last()[0] > 0


def test_the_axes_of_any_joystick_are_read_within_one() -> None:
    """The guard: the limits in ``stick_in``."""
    assert stick_in(joy_of(Stick(held=True, forward=50.0, left=-1e30), HEADER)) == Stick(True, 1.0, -1.0)


@pytest.mark.parametrize("arming", [False, True])
def test_while_it_is_deactivated_it_commands_nothing_and_then_waits_for_neutral(arming: bool) -> None:
    bench = ControlBench(arming=arming)
    twists = bench.record(CMD_VEL)
    bench.show(*["Stop"] * 40, *["Forward"] * 10)
    assert twists[-1].linear.x > 0.0
    assert bench.control.set_active(False)
    assert twists[-1].linear.x == 0.0
    silent = len(twists)
    bench.show("NONE", *["Forward"] * 20)
    bench.run(1.0)
    bench.control.reconfigure(Config(control=ControlConfig(max_linear=0.5)))
    assert len(twists) == silent
    assert bench.control.set_active(True)
    bench.show(*["Forward"] * 20)
    assert {twist.linear.x for twist in twists[silent:]} == {0.0}
    bench.show(*["Stop"] * 20, *["Forward"] * 5)
    assert twists[-1].linear.x > 0.0


def test_a_stop_while_it_is_deactivated_commands_nothing() -> None:
    bench = ControlBench()
    twists = bench.record(CMD_VEL)
    bench.control.set_active(False)
    silent = len(twists)
    for is_stopped in (True, False):  # each commands zero while it is active
        bench.stop.publish(Bool(data=is_stopped))
        bench.run(0.1)
    assert len(twists) == silent


def test_steering_that_was_held_while_it_was_deactivated_must_be_released() -> None:
    bench = ControlBench()
    twists = bench.record(CMD_VEL)
    bench.steering.steer(0.0, 0.0)
    bench.run(0.1)
    bench.control.set_active(False)
    bench.control.set_active(True)
    bench.steering.steer(0.3, 0.0)
    bench.run(0.1)
    assert {twist.linear.x for twist in twists} == {0.0}
    bench.steering.steer(0.0, 0.0)
    bench.run(0.1)
    bench.steering.steer(0.3, 0.0)
    bench.run(0.1)
    assert twists[-1].linear.x == 0.3


def test_a_stop_while_it_is_deactivated_is_remembered() -> None:
    bench = ControlBench()
    bench.control.set_active(False)
    bench.stop.publish(Bool(data=True))
    bench.run(0.1)
    bench.control.set_active(True)
    twists = bench.record(CMD_VEL)
    bench.show("Stop", *["Forward"] * 5)
    assert {twist.linear.x for twist in twists} == {0.0}


def test_whether_the_hand_drives_can_be_asked() -> None:
    bench = ControlBench(engage=True)
    assert bench.control.services()["engage_state"]() == "disengaged: open, close and open your hand to begin"
    assert ControlBench().control.services()["engage_state"]() == "engaged"


def test_who_asks_whether_the_hand_drives_hears_of_a_stop() -> None:
    bench = ControlBench()
    call = bench.control.services()
    call["stop"]()
    bench.run(0.1)
    assert call["engage_state"]() == "engaged; stopped, until it is reset"
    call["reset"]()
    bench.run(0.1)
    assert call["engage_state"]() == "engaged"
