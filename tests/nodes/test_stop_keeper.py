import pytest

from handsteer.config import ControlConfig
from handsteer.messages import CMD_VEL, HAND_SIGN, STOP, STOPPED, Bool, String
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.node import Node
from handsteer.nodes.stop_keeper import StopKeeper
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


def test_it_is_said_once_however_often_stop_is(bench: KeeperBench) -> None:
    for _ in range(20):
        bench.say(True)
    assert [word.data for word in bench.words] == [True]
