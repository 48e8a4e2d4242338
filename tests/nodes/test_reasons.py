"""Every reason for what is commanded, made by its situation; docs/safety.md has the same in a table."""

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from handsteer.config import ControlConfig
from handsteer.control.explain import Reason, ReasonCode
from handsteer.messages import CAMERA_CHANGED, DIAGNOSTICS, Bool, String, joy_of
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.diagnostics import read_status
from handsteer.nodes.status import ControlStatus
from handsteer.nodes.supervision import StopKeeper
from handsteer.teleop import Teleop
from handsteer.types import RELEASED, Stick
from tests.nodes.stepping import Bench
from tests.nodes.test_collision_monitor import MonitorBench, ahead
from tests.nodes.test_control import HEADER, ControlBench

DOCS = Path(__file__).parents[2] / "docs"
JOYSTICK = ControlConfig(mode="joystick")
AHEAD = Stick(held=True, forward=0.5)


class Reports:
    """What the control of ``bench`` reports on ``/diagnostics`` from now on."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._arrays = bench.record(DIAGNOSTICS)

    def next(self) -> Reason:
        """Return the reason that it reports next."""
        before = len(self._arrays)
        self._bench.run(0.12)
        found = [read_status(status) for array in self._arrays[before:] for status in array.status]
        reasons = [each.reason for each in found if isinstance(each, ControlStatus)]
        assert reasons[-1] is not None
        return reasons[-1]


def shown(
    *signs: str, config: ControlConfig | None = None, arming: bool = False, engage: bool = False, renew: bool = False
) -> Reason:
    """Return the reason while the last of ``signs`` is shown."""
    bench = ControlBench(config, arming=arming, engage=engage, renew=renew)
    reports = Reports(bench)
    bench.show(*signs)
    return reports.next()


def held(stick: Stick, times: int = 5, *, renew: bool = False) -> Reason:
    bench = ControlBench(JOYSTICK, renew=renew)
    reports = Reports(bench)
    bench.hold(RELEASED, RELEASED, *[stick] * times)
    return reports.next()


def steered(linear_mps: float) -> Reason:
    bench = ControlBench()
    reports = Reports(bench)
    steer(bench, 0.0, linear_mps)
    return reports.next()


def steer(bench: ControlBench, *speeds_mps: float) -> None:
    for speed_mps in speeds_mps:
        bench.steering.steer(speed_mps, 0.0)
        bench.run(0.1)


def silent() -> Reason:
    bench = ControlBench()
    reports = Reports(bench)
    bench.show("Forward")
    bench.run(1.0)
    return reports.next()


def stopped() -> Reason:
    bench = ControlBench()
    reports = Reports(bench)
    bench.stop.publish(Bool(data=True))
    bench.show("Forward")
    return reports.next()


def started_next_to_others() -> Reason:
    bench = Bench()
    reports = Reports(bench)
    other = Node("far", bench.transport, bench.clock)
    StopKeeper(other)
    bench.nodes = [other, HandSignControlNode(bench.transport, bench.clock, ControlConfig(), others_keep_stop=True)]
    return reports.next()


def deactivated() -> Reason:
    bench = ControlBench()
    reports = Reports(bench)
    bench.show("Forward")
    bench.control.set_active(False)
    return reports.next()


def camera_changed() -> Reason:
    bench = ControlBench(arming=True)
    reports = Reports(bench)
    bench.show("NONE", "Forward")
    bench.transport.advertise("camera", CAMERA_CHANGED).publish(String(data="webcam 1"), bench.clock.now())
    bench.run(0.1)
    bench.show("Forward", "Forward")
    return reports.next()


def steered_through_a_stop() -> Reason:
    bench = ControlBench(arming=True)
    reports = Reports(bench)
    steer(bench, 0.0, 0.3)
    for is_stopped in (True, False):
        bench.stop.publish(Bool(data=is_stopped))
        bench.run(0.1)
    bench.steering.steer(0.3, 0.0)
    return reports.next()


def without_scans() -> Reason:
    bench = MonitorBench()
    reports = Reports(bench)
    bench.show("Forward", times=3)
    return reports.next()


def before_an_obstacle() -> Reason:
    bench = MonitorBench()
    reports = Reports(bench)
    bench.show("Forward", times=30, scan=ahead(0.7))
    bench.show("Forward", times=5, scan=ahead(0.4))
    return reports.next()


def without_an_image() -> Reason:
    teleop = Teleop()
    teleop.step(np.zeros((48, 64, 3), np.uint8), 1 / 30)
    return teleop._reason()


def pointed() -> Reason:
    bench = ControlBench(ControlConfig(rule="point"))
    reports = Reports(bench)
    for sign, stick in [("NONE", RELEASED), *[("Forward", AHEAD)] * 5]:
        bench.signs.publish(String(data=sign), bench.clock.now())
        bench.joys.publish(joy_of(RELEASED, HEADER, pointing=stick), bench.clock.now())
        bench.run(1 / 30)
    return reports.next()


SITUATIONS: dict[ReasonCode, Callable[[], Reason]] = {
    "sign": lambda: shown("Forward", "Forward"),
    "steered": lambda: steered(0.3),
    "joystick": lambda: held(AHEAD),
    "pointed": pointed,
    "stopped": stopped,
    "inactive": deactivated,
    "starting": started_next_to_others,
    "disarmed": camera_changed,
    "disengaged": lambda: shown("Forward", engage=True),
    "steering_disarmed": steered_through_a_stop,
    "renew": lambda: shown("NONE", *["Forward"] * 640, renew=True),
    "renew_stick": lambda: held(AHEAD, 640, renew=True),
    "no_image": without_an_image,
    "no_scan": without_scans,
    "obstacle": before_an_obstacle,
    "steered_at_zero": lambda: steered(0.0),
    "not_held": lambda: held(RELEASED),
    "held": lambda: held(Stick(held=True)),
    "no_input": silent,
    "no_sign": lambda: shown("Forward", "NONE"),
    "stop_sign": lambda: shown("Forward", "Stop"),
    "not_started": lambda: shown("NONE", "Go"),
}


def documented() -> dict[str, str]:
    """Return the sentence of each code in the table of docs/safety.md."""
    section = (DOCS / "safety.md").read_text(encoding="utf-8").split("## Reasons\n")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:2] == "| "]
    return {code.strip("`"): sentence.replace("*", "") for code, sentence, _ in rows if code.startswith("`")}


@pytest.mark.parametrize("code", get_args(ReasonCode))
def test_each_reason_comes_from_its_situation_and_is_documented(code: ReasonCode) -> None:
    reason = SITUATIONS[code]()
    assert reason.code == code
    assert documented()[code] == reason.explanation


def test_the_table_has_the_reasons_that_there_are() -> None:
    assert list(documented()) == list(get_args(ReasonCode))
