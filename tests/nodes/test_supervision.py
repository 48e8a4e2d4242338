import logging

import pytest

from handsteer.config import Config, ControlConfig, RobotConfig
from handsteer.making import open_robot
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    HAND_SIGN,
    STEERING_CMD_VEL,
    STOP,
    STOPPED,
    Bool,
    DiagnosticStatus,
    String,
    twist,
)
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.robot import RobotNode
from handsteer.nodes.supervision import StopKeeper
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.timeouts import HEAR_STOP_S
from tests.nodes.stepping import Bench


class KeeperBench(Bench):
    def __init__(self) -> None:
        super().__init__()
        self.other = Node("other", self.transport, self.clock)
        StopKeeper(self.other)
        self.nodes = [self.other]
        self.stop = self.transport.advertise("anybody", STOP)
        self.words = self.record(STOPPED)
        self.twists = self.record(CMD_VEL)
        self.signs = self.transport.advertise("recognition", HAND_SIGN)

    def say(self, stopped: bool) -> None:
        self.stop.publish(Bool(data=stopped))
        self.run(0.0)

    def restart_control(self) -> None:
        """As kill -9 and a new start: the old one says nothing."""
        self.nodes = [self.other, HandSignControlNode(self.transport, self.clock, ControlConfig())]
        self.run(0.1)

    def speed_after(self, *signs: str) -> float:
        for sign in signs:
            self.signs.publish(String(data=sign), self.clock.now())
            self.run(1 / 30)
        return float(self.twists[-1].linear.x)


@pytest.fixture
def bench() -> KeeperBench:
    return KeeperBench()


def test_a_control_that_starts_anew_hears_from_others_that_the_robot_was_stopped(bench: KeeperBench) -> None:
    bench.say(True)
    bench.restart_control()
    assert bench.speed_after(*["Stop"] * 30, *["Forward"] * 30) == 0.0
    bench.say(False)
    assert bench.speed_after(*["Forward"] * 30) == 0.0
    assert bench.speed_after("Stop", "Forward") > 0.0
    bench.restart_control()
    assert bench.speed_after("Forward") > 0.0, "the reset is remembered too"


def test_a_reset_that_one_has_missed_undoes_no_stop_and_a_stop_that_one_has_missed_counts(bench: KeeperBench) -> None:
    bench.restart_control()
    word = bench.transport.advertise("someone", STOPPED)
    word.publish(Bool(data=True))
    bench.run(0.1)
    word.publish(Bool(data=False))
    bench.run(0.1)
    assert bench.speed_after("Stop", "Forward") == 0.0


class TestBesideOtherProcesses:
    """The word of others on a Stop may arrive some seconds after the signs do, as over Fast DDS."""

    @pytest.fixture
    def started(self, bench: KeeperBench) -> KeeperBench:
        control = HandSignControlNode(bench.transport, bench.clock, ControlConfig(), others_keep_stop=True)
        bench.nodes = [bench.other, control]
        bench.run(0.1)
        return bench

    def test_nothing_moves_before_their_word_and_a_late_one_still_stops(self, started: KeeperBench) -> None:
        assert started.speed_after(*["Forward"] * 60) == 0.0
        started.transport.advertise("far", STOPPED).publish(Bool(data=True))
        assert started.speed_after(*["Forward"] * 60, "Stop", "Forward") == 0.0

    def test_their_word_that_there_is_no_stop_is_believed_at_once(self, started: KeeperBench) -> None:
        assert started.speed_after("Forward", "Forward") == 0.0
        started.transport.advertise("far", STOPPED).publish(Bool(data=False))
        assert started.speed_after("Forward") > 0.0

    def test_it_waits_no_longer_than_their_word_can_take(self, started: KeeperBench) -> None:
        assert started.speed_after(*["Forward"] * round(30 * (HEAR_STOP_S - 0.2))) == 0.0
        assert started.speed_after(*["Forward"] * 9) > 0.0

    def test_in_a_graph_that_runs_without_a_stop_it_waits_for_a_moment_only(self, bench: KeeperBench) -> None:
        bench.run(HEAR_STOP_S + 0.1)
        for _ in range(2):  # the first one passes the knowledge on
            control = HandSignControlNode(bench.transport, bench.clock, ControlConfig(), others_keep_stop=True)
            bench.nodes = [bench.other, control]
            assert bench.speed_after(*["Forward"] * 6) > 0.0
        assert not any(word.data for word in bench.words)

    def test_a_node_that_has_just_started_says_nothing_of_what_it_does_not_know(self, bench: KeeperBench) -> None:
        bench.run(HEAR_STOP_S - 0.1)
        assert bench.words == []

    def test_the_steering_waits_too(self, started: KeeperBench) -> None:
        steering = started.transport.advertise("steering", STEERING_CMD_VEL)
        for _ in range(5):
            steering.publish(twist(0.2, 0.0))
            started.run(0.05)
        assert started.twists[-1].linear.x == 0.0

    def test_it_waits_while_the_transport_knows_no_publisher(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """As over ROS 1 until the master has answered."""
        bench = Bench()
        twists = bench.record(CMD_VEL)
        signs = bench.transport.advertise("recognition", HAND_SIGN)
        monkeypatch.setattr(bench.transport, "publishers_of", lambda topic: [])
        bench.nodes = [HandSignControlNode(bench.transport, bench.clock, ControlConfig(), others_keep_stop=True)]
        signs.publish(String(data="Forward"), 0.0)
        bench.run(0.01)
        assert twists[-1].linear.x == 0.0

    def test_alone_it_follows_at_once(self) -> None:
        bench = Bench()
        twists = bench.record(CMD_VEL)
        signs = bench.transport.advertise("recognition", HAND_SIGN)
        bench.nodes = [HandSignControlNode(bench.transport, bench.clock, ControlConfig(), others_keep_stop=True)]
        signs.publish(String(data="Forward"), 0.0)
        bench.run(0.01)
        assert twists[-1].linear.x > 0.0


def test_it_is_said_once_however_often_stop_is(bench: KeeperBench) -> None:
    for _ in range(20):
        bench.say(True)
    assert [word.data for word in bench.words] == [True]


SIGNS = "/gesture/hand_sign has 2 publishers (hand_sign_recognition, intruder)"
COMMANDS = "/robot_diff_drive_controller/cmd_vel has 2 publishers (hand_sign_control, intruder)"


class Chain(Bench):
    """A control and a robot, with one recognition."""

    def __init__(self) -> None:
        super().__init__()
        self.reports = self.record(DIAGNOSTICS)
        config = RobotConfig(world="empty")
        self.control = HandSignControlNode(self.transport, self.clock, ControlConfig())
        robot = open_robot(Config(robot=config), self.clock)
        self.nodes = [RobotNode(self.transport, self.clock, robot, config), self.control]
        self.recognition = self.transport.advertise("hand_sign_recognition", HAND_SIGN)

    def said(self, name: str) -> tuple[DiagnosticStatus, str]:
        status = [one for report in self.reports for one in report.status if one.name == name][-1]
        return status, {pair.key: pair.value for pair in status.values}.get("warning", "")


@pytest.fixture
def chain(caplog: pytest.LogCaptureFixture) -> Chain:
    caplog.set_level(logging.INFO)
    return Chain()


def test_one_voice_a_topic_is_as_it_should_be(chain: Chain, caplog: pytest.LogCaptureFixture) -> None:
    chain.run(5.0)
    for name in ("hand_sign_control", "robot"):
        status, warning = chain.said(name)
        assert (status.level, warning) == (0, "")
    assert "publishers" not in caplog.text


def test_a_second_publisher_of_signs_is_said_once_and_no_more_when_it_has_gone(
    chain: Chain, caplog: pytest.LogCaptureFixture
) -> None:
    intruder = chain.transport.advertise("intruder", HAND_SIGN)
    chain.run(5.0)
    status, warning = chain.said("hand_sign_control")
    assert status.level == 1
    assert warning.startswith(SIGNS)
    assert caplog.text.count(SIGNS) == 1
    del intruder
    chain.run(2.0)
    status, warning = chain.said("hand_sign_control")
    assert (status.level, warning) == (0, "")


def test_a_second_publisher_of_commands_is_said_by_control_and_robot(chain: Chain) -> None:
    intruder = chain.transport.advertise("intruder", CMD_VEL)
    chain.run(5.0)
    for name in ("hand_sign_control", "robot"):
        status, warning = chain.said(name)
        assert status.level == 1
        assert warning.startswith(COMMANDS)
    assert chain.said("robot")[0].message == "is commanded by more than one node"
    assert intruder.has_subscribers


def test_a_second_control_is_two_voices(chain: Chain) -> None:
    chain.nodes.append(HandSignControlNode(chain.transport, chain.clock, ControlConfig()))
    chain.run(5.0)
    assert "has 2 publishers (hand_sign_control, hand_sign_control)" in chain.said("robot")[1]


def test_a_node_that_only_passes_by_is_not_said(chain: Chain, caplog: pytest.LogCaptureFixture) -> None:
    chain.run(0.5)
    passing = chain.transport.advertise("passing", HAND_SIGN)
    chain.run(1.0)
    del passing
    chain.run(3.0)
    assert "publishers" not in caplog.text


def test_who_commands_a_real_robot_in_its_own_graph_is_asked_too() -> None:
    class Real(SimulatedRobot):
        def commanders(self) -> list[str]:
            return ["/handsteer", "/teleop"]

    chain = Chain()
    config = RobotConfig(world="empty")
    chain.nodes[0] = RobotNode(chain.transport, chain.clock, Real(config), config)
    chain.run(5.0)
    assert chain.said("robot")[1].startswith("cmd_vel has 2 publishers (/handsteer, /teleop)")


def test_many_may_stop_and_who_could_have_reset_is_logged(chain: Chain, caplog: pytest.LogCaptureFixture) -> None:
    stops = [chain.transport.advertise(name, STOP) for name in ("page", "phone")]
    stops[0].publish(Bool(data=True))
    chain.run(5.0)
    assert chain.said("hand_sign_control")[1] == ""
    stops[1].publish(Bool(data=False))
    chain.run(0.1)
    assert "stop is reset by false on /stop, which is published by page, phone" in caplog.text
