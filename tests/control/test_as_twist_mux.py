"""What users of ROS's twist_mux expect of whoever decides who drives, asked of our control by its topics alone.

The expectations are those of twist_mux's tests and configuration (4.3.0, d929f1b), in words and code of our own: the
signs are its input of low priority, steering one of high priority, ``/stop`` a lock above both. docs/safety.md lists
those that we do not share.
"""

from typing import Any

import pytest

from handsteer.config import ControlConfig
from handsteer.messages import CMD_VEL, DIAGNOSTICS, HAND_SIGN, STEERING_CMD_VEL, STOP, Bool, String, twist
from handsteer.nodes.control import HandSignControlNode
from tests.nodes.stepping import Bench

ZERO, SIGNED, STEERED = (0.0, 0.0), (0.5, 0.0), (0.2, 1.0)
PERIOD_S = 0.1
LONGER_THAN_A_TIMEOUT_S = 0.5


class Mux(Bench):
    """The control with all its inputs, each of which speaks ten times a second once it was told to."""

    def __init__(self) -> None:
        super().__init__()
        # One sign takes it to its speed at once, so that what comes out is what went in.
        config = ControlConfig(linear_step=1.0, max_linear=0.5)
        self.nodes = [HandSignControlNode(self.transport, self.clock, config)]
        self._signs = self.transport.advertise("recognition", HAND_SIGN)
        self._steering = self.transport.advertise("joystick", STEERING_CMD_VEL)
        self._lock = self.transport.advertise("lock", STOP)
        self._came = self.record(CMD_VEL)
        self.reports = self.record(DIAGNOSTICS)

    def let_go(self) -> None:
        """Show once that no hand is there, and that the stick is released, and let that time out."""
        self._steering.publish(twist(*ZERO))
        self._signs.publish(String(data="NONE"), self.clock.now())
        self.run(LONGER_THAN_A_TIMEOUT_S)
        self._came.clear()

    def lock(self, *, locked: bool) -> None:
        self._lock.publish(Bool(data=locked))
        self.run(0.0)

    def speak(self, *, signs: str = "", steering: tuple[float, float] | None = None, seconds: float = 1.0) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            if signs:
                self._signs.publish(String(data=signs), self.clock.now())
            if steering is not None:
                self._steering.publish(twist(*steering))
            self.run(PERIOD_S)

    def take(self) -> list[tuple[float, float]]:
        """Return what has come out since the last call."""
        came = [(message.linear.x, message.angular.z) for message in self._came]
        self._came.clear()
        return came


@pytest.fixture
def mux() -> Mux:
    mux = Mux()
    mux.let_go()
    return mux


def test_without_any_input_nothing_comes_out(mux: Mux) -> None:
    mux.run(5.0)
    assert mux.take() == []


@pytest.mark.parametrize(
    ("inputs", "wanted"), [({"signs": "Forward"}, SIGNED), ({"steering": STEERED}, STEERED)], ids=["signs", "steering"]
)
def test_a_single_input_passes(mux: Mux, inputs: dict[str, Any], wanted: tuple[float, float]) -> None:
    mux.speak(**inputs)
    assert mux.take()[-1] == wanted


def test_the_input_of_higher_priority_keeps_the_other_out_and_gives_way_when_it_ends(mux: Mux) -> None:
    mux.speak(signs="Forward")
    assert mux.take()[-1] == SIGNED
    mux.speak(signs="Forward", steering=STEERED)
    assert set(mux.take()) == {STEERED}
    mux.speak(signs="Stop", seconds=LONGER_THAN_A_TIMEOUT_S)
    mux.speak(signs="Forward")
    assert mux.take()[-1] == SIGNED


def test_an_input_of_lower_priority_changes_nothing_while_the_higher_one_speaks(mux: Mux) -> None:
    mux.speak(steering=STEERED)
    mux.take()
    for sign in ("Forward", "Stop", "NONE", "Turn Left"):
        mux.speak(signs=sign, steering=STEERED)
    assert set(mux.take()) == {STEERED}


@pytest.mark.parametrize("inputs", [{"signs": "Forward"}, {"steering": STEERED}], ids=["signs", "steering"])
def test_an_input_that_falls_silent_times_out(mux: Mux, inputs: dict[str, Any]) -> None:
    mux.speak(**inputs)
    mux.take()
    mux.run(LONGER_THAN_A_TIMEOUT_S)
    assert mux.take() == [ZERO]
    mux.run(5.0)
    assert mux.take() == []


@pytest.mark.parametrize("inputs", [{"signs": "Forward"}, {"steering": STEERED}], ids=["signs", "steering"])
def test_a_lock_keeps_every_input_of_lower_priority_out(mux: Mux, inputs: dict[str, Any]) -> None:
    mux.speak(**inputs)
    mux.take()
    mux.lock(locked=True)
    assert mux.take() == [ZERO]
    mux.speak(**inputs, seconds=3.0)
    assert set(mux.take()) == {ZERO}


def test_a_lock_that_was_said_once_does_not_time_out(mux: Mux) -> None:
    mux.lock(locked=True)
    mux.run(60.0)
    mux.take()
    mux.speak(signs="Forward", steering=STEERED)
    assert set(mux.take()) == {ZERO}


def test_a_lock_can_be_given_free_again(mux: Mux) -> None:
    mux.lock(locked=True)
    mux.lock(locked=False)
    mux.run(LONGER_THAN_A_TIMEOUT_S)
    mux.speak(steering=STEERED)
    assert set(mux.take()) == {ZERO}, "unlike twist_mux's, our steering has to be seen released"
    mux.speak(steering=ZERO, seconds=PERIOD_S)
    mux.speak(steering=STEERED)
    assert mux.take()[-1] == STEERED


def test_who_drives_and_whether_it_is_locked_stands_on_diagnostics(mux: Mux) -> None:
    def said() -> tuple[str, str]:
        values = {value.key: value.value for value in mux.reports[-1].status[0].values}
        return values["source"], values["stopped"]

    told = [said()]
    mux.speak(signs="Forward")
    told.append(said())
    mux.speak(signs="Forward", steering=STEERED)
    told.append(said())
    mux.lock(locked=True)
    mux.run(0.2)
    told.append(said())
    assert told == [("none", "False"), ("signs", "False"), ("steering", "False"), ("none", "True")]
