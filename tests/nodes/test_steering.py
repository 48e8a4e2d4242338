import math
from typing import Any

import pytest

from handsteer.clock import SteppedClock
from handsteer.config import Config, ControlConfig
from handsteer.errors import TransportError
from handsteer.messages import (
    CMD_VEL,
    STEERING_CMD_VEL,
    STOP,
    STOPPED,
    Bool,
    Topic,
    Twist,
    TwistStamped,
    cmd_vel,
    twist_in,
)
from handsteer.nodes.steering import SteeringNode
from handsteer.transports.base import Received
from handsteer.transports.in_process import InProcessTransport

ROBOT = Topic("/cmd_vel", Twist)


class Bench:
    """The steering on a stepped clock, and what is heard of it on two topics."""

    def __init__(
        self, config: ControlConfig | None = None, robot: Topic[Any] = ROBOT, kind: Topic[Any] = CMD_VEL
    ) -> None:
        self.clock = SteppedClock()
        self.transport = InProcessTransport()
        self.node = SteeringNode(self.transport, self.clock, config, kind)
        self.mux = self._record(STEERING_CMD_VEL)
        self.robot = self._record(robot)
        self.node.release()  # what steers was seen released

    def _record(self, topic: Topic[Any]) -> list[tuple[float, float]]:
        said: list[tuple[float, float]] = []

        def note(received: Received[Any]) -> None:
            twist = twist_in(received.message)
            said.append((twist.linear.x, twist.angular.z))

        self.transport.subscribe("test", topic, note)
        return said

    def stop(self, *, on: bool) -> None:
        self.transport.advertise("test", STOP).publish(Bool(data=on))
        self.node.spin_once()

    def step(self, seconds: float = 0.1) -> None:
        self.clock.advance(seconds)
        self.node.spin_once()


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_after_it_was_held_up_whoever_steers_has_to_let_go_once(bench: Bench) -> None:
    bench.node.steer(0.5, 0.0)
    bench.step(10.0)  # the process was frozen
    for _ in range(5):
        bench.node.steer(0.5, 0.0)  # what a browser had sent meanwhile, and goes on to send
        bench.step()
    assert bench.mux == [(0.5, 0.0)], "nothing is sent, as the control would take a zero for letting go"
    bench.node.release()
    bench.node.steer(0.5, 0.0)
    assert bench.mux[1:] == [(0.0, 0.0), (0.5, 0.0)]


def test_what_is_held_when_it_starts_has_to_be_released() -> None:
    clock, transport = SteppedClock(), InProcessTransport()
    node, heard = SteeringNode(transport, clock), list[float]()
    transport.subscribe("test", STEERING_CMD_VEL, lambda received: heard.append(received.message.linear.x))
    for _ in range(40):
        node.steer(0.3, 0.0)
        clock.advance(0.1)
    assert set(heard) == {0.0}
    assert node.waits
    node.steer(0.0, 0.0)
    node.steer(0.3, 0.0)
    assert heard[-1] == 0.3


def test_what_was_lost_has_to_be_released(bench: Bench) -> None:
    bench.node.steer(0.3, 0.0)
    bench.node.lose()
    bench.node.steer(0.3, 0.0)
    assert bench.mux == [(0.3, 0.0), (0.0, 0.0), (0.0, 0.0)]
    bench.node.release()
    bench.node.steer(0.3, 0.0)
    assert bench.mux[-1] == (0.3, 0.0)


def let_go_once(bench: Bench) -> None:
    bench.node.steer(0.0, 0.0)


def test_the_old_topic_is_told_to_stand_before_the_new_one_is_used(bench: Bench) -> None:
    bench.node.steer(0.3, 0.1)
    bench.node.send_to("/cmd_vel")
    assert bench.mux == [(0.3, 0.1), (0.0, 0.0)]
    assert (bench.node.topic, bench.node.is_direct, bench.robot) == ("/cmd_vel", True, [])


def test_who_steers_begins_anew_on_another_topic(bench: Bench) -> None:
    bench.node.steer(0.3, 0.0)
    bench.node.send_to("/cmd_vel")
    for _ in range(5):
        bench.step()
        bench.node.steer(0.3, 0.0)
    assert set(bench.robot) == {(0.0, 0.0)}
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.3, 0.0)


@pytest.mark.parametrize("name", ["/steering/cmd_vel", "steering/cmd_vel"])
def test_it_goes_back_to_the_control(bench: Bench, name: str) -> None:
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    bench.node.send_to(name)
    assert bench.robot[-1] == (0.0, 0.0)
    let_go_once(bench)
    bench.node.steer(0.2, 0.0)
    assert (bench.mux, bench.node.is_direct) == ([(0.0, 0.0), (0.2, 0.0)], False)


def test_past_the_control_it_keeps_to_the_limits_itself() -> None:
    bench = Bench(ControlConfig(max_linear=0.5, max_angular=1.0))
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    for wanted in ((9.0, -9.0), (math.nan, 0.2), (0.1, math.inf)):
        bench.node.steer(*wanted)
    assert bench.robot == [(0.0, 0.0), (0.5, -1.0), (0.0, 0.0), (0.0, 0.0)]


def test_stop_holds_past_the_control_until_it_is_reset_and_steering_begins_anew(bench: Bench) -> None:
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    bench.node.halt()
    assert bench.robot[-1] == (0.0, 0.0)
    heard = len(bench.robot)
    for _ in range(5):
        bench.step()
        bench.node.steer(0.3, 0.0)
    assert set(bench.robot[heard:]) == {(0.0, 0.0)}
    let_go_once(bench)
    bench.node.reset()
    bench.step()
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.0, 0.0), "a release during the Stop does not count"
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.3, 0.0)


@pytest.mark.parametrize("topic", [STOP, STOPPED])
def test_a_stop_from_before_another_topic_was_chosen_holds_there(bench: Bench, topic: Topic[Bool]) -> None:
    bench.transport.advertise("test", topic).publish(Bool(data=True))
    bench.step()
    bench.node.send_to("/cmd_vel")
    for velocity in (0.0, 0.3, 0.3):
        bench.node.steer(velocity, 0.0)
        bench.step()
    assert bench.node.is_stopped
    assert set(bench.robot) == {(0.0, 0.0)}
    bench.stop(on=False)
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.0, 0.0)


def test_a_stop_of_others_holds_past_the_control_too(bench: Bench) -> None:
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    bench.stop(on=True)
    assert bench.node.is_stopped
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.0, 0.0)
    bench.stop(on=False)
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    assert bench.robot[-1] == (0.3, 0.0)


@pytest.mark.parametrize("name", ["", "/", "cmd vel", "/cmd_vel/", "//cmd_vel", "9lives", "~x", "/a" * 200, "<b>x</b>"])
def test_a_name_that_ros_does_not_know_changes_nothing(bench: Bench, name: str) -> None:
    bench.node.steer(0.3, 0.0)
    with pytest.raises(TransportError, match="is not a valid topic name"):
        bench.node.send_to(name)
    assert (bench.node.topic, bench.mux) == ("/steering/cmd_vel", [(0.3, 0.0)])


def test_a_topic_of_another_type_changes_nothing(bench: Bench) -> None:
    with pytest.raises(TransportError, match="carries std_msgs/msg/Bool"):
        bench.node.send_to("/stop")
    assert bench.node.topic == "/steering/cmd_vel"


def test_names_do_not_pile_up(bench: Bench) -> None:
    for n in range(8):
        bench.node.send_to(f"/robot{n}/cmd_vel")
    with pytest.raises(TransportError, match="start it again"):
        bench.node.send_to("/another")
    bench.node.send_to("/robot3/cmd_vel")


def test_it_says_twist_stamped_to_robots_that_take_that() -> None:
    robot = Topic("/cmd_vel", TwistStamped)
    bench = Bench(ControlConfig(), robot, cmd_vel("twist_stamped"))
    bench.node.steer(0.1, 0.0)
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    bench.node.steer(0.2, 0.0)
    assert (bench.mux[0], bench.robot[-1]) == ((0.1, 0.0), (0.2, 0.0))


def test_ends_at_zero_on_the_topic_that_it_steers(bench: Bench) -> None:
    bench.node.send_to("/cmd_vel")
    let_go_once(bench)
    bench.node.steer(0.2, 0.0)
    bench.node.stop()
    assert bench.robot[-1] == (0.0, 0.0)


def test_after_a_stop_it_stands_also_where_its_own_topic_was_given_to_a_robot(bench: Bench) -> None:
    bench.node.steer(0.3, 0.0)
    bench.node.halt()
    heard = len(bench.mux)
    bench.node.steer(0.3, 0.0)
    bench.node.reset()
    bench.node.steer(0.3, 0.0)
    assert set(bench.mux[heard:]) == {(0.0, 0.0)}
    let_go_once(bench)
    bench.node.steer(0.3, 0.0)
    assert bench.mux[-1] == (0.3, 0.0)


def test_its_stop_is_repeated_until_it_is_reset(bench: Bench) -> None:
    """The guard: ``_halted`` in ``_repeat``; false from elsewhere must not undo it."""
    said: list[bool] = []
    bench.transport.subscribe("test", STOP, lambda received: said.append(received.message.data))
    bench.node.halt()
    for _ in range(10):
        bench.step()
    assert said == [True] * 11
    bench.node.reset()
    for _ in range(10):
        bench.step()
    assert said == [*[True] * 11, False]


@pytest.mark.parametrize("topic", [ROBOT.name, STEERING_CMD_VEL.name])
@pytest.mark.parametrize(
    ("change", "goes_on"),
    [
        ({"max_linear": 1.0}, False),
        ({"max_linear_acceleration": 0.0}, False),
        ({"max_linear": 0.2}, True),
        ({"linear_step": 0.5}, True),
    ],
    ids=str,
)
def test_a_change_that_would_make_it_faster_ends_what_is_held(
    topic: str, change: dict[str, float], *, goes_on: bool
) -> None:
    limits = ControlConfig(max_linear=0.3, max_linear_acceleration=0.1)
    bench = Bench(limits)
    bench.node.send_to(topic)
    said = bench.robot if topic == ROBOT.name else bench.mux
    for linear_mps in (0.0, 1.0, 1.0):
        bench.node.steer(linear_mps, 0.0)
        bench.step()
    assert said[-1][0] > 0
    bench.node.reconfigure(Config(control=limits.model_copy(update=change)))
    bench.step(0.0)
    bench.node.steer(1.0, 0.0)
    assert (said[-1][0] > 0) is goes_on
    bench.node.steer(0.0, 0.0)
    bench.node.steer(1.0, 0.0)
    bench.step()
    bench.node.steer(1.0, 0.0)
    assert said[-1][0] > 0
