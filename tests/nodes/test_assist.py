"""``control.assist: steer`` in the simulated world, driven by the nodes, and what it reports."""

from typing import Any

import numpy as np
import pytest

from handsteer import doors
from handsteer.config import CollisionMonitorConfig, Config, ControlConfig
from handsteer.control import assist
from handsteer.control.obstacles import Hit, ObstacleLimiter
from handsteer.errors import ConfigError
from handsteer.types import Velocity
from tests.about import about
from tests.nodes.test_collision_monitor import Drive, MonitorBench, ahead

STEER = ControlConfig(assist="steer")


def wall(x0: float, y0: float, x1: float, y1: float) -> dict[str, Any]:
    """Return a wall 0.1 m thick along x or y."""
    size = [max(0.1, x1 - x0), max(0.1, y1 - y0), 0.5]
    return {"name": f"wall {x0} {y0}", "shape": "box", "size": size, "position": [(x0 + x1) / 2, (y0 + y1) / 2]}


BEND = (wall(-1, -0.6, 3.9, -0.6), wall(3.9, -0.6, 3.9, 5), wall(-1, 0.6, 2.7, 0.6), wall(2.7, 0.6, 2.7, 5))
CORNER = {"name": "box", "shape": "box", "size": [1.0, 2.0, 0.5], "position": [2.0, -1.15]}


def mirrored(thing: dict[str, Any]) -> dict[str, Any]:
    x, y = thing["position"]
    return {**thing, "position": [x, -y]}


@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
@pytest.mark.parametrize("speed_mps", [0.2, 0.4, 0.7])
def test_forward_follows_a_corridor_s_bend(speed_mps: float, side: int) -> None:
    walls = BEND if side == 1 else tuple(map(mirrored, BEND))
    drive = Drive(*walls, assist="steer")
    drive.run(0.2)
    drive.steer(speed_mps, 0.0, 5.5 / speed_mps + 3.0)
    assert drive.robot.state.collisions == 0
    assert drive.robot.state.truth.y * side > 1.2


@pytest.mark.parametrize("side", [1, -1])
def test_forward_slips_around_a_corner_at_which_the_brake_stops(side: int) -> None:
    corner = CORNER if side == 1 else mirrored(CORNER)
    ends_m = {}
    for kind in ("brake", "steer"):
        drive = Drive(corner, assist=kind)
        drive.run(0.2)
        drive.steer(0.5, 0.0, 9.0)
        assert drive.robot.state.collisions == 0
        ends_m[kind] = drive.robot.state.truth.x
    assert ends_m["brake"] < 1.5
    assert ends_m["steer"] > 3.0


def test_it_says_around_what_it_steers_and_reports_the_turn() -> None:
    bench = MonitorBench(CollisionMonitorConfig(), STEER)
    bench.show("Forward", 40, ahead(7.0))
    assert bench.command == (about(0.4), 0.0)
    bench.show("Forward", 1, ahead(0.72))
    message, values = bench.report()
    assert bench.command[1] != 0.0
    side = "left" if bench.command[1] > 0 else "right"
    assert message == f"driving: Forward, steering {side} of an obstacle 0.46 m ahead"
    assert values["reason_code"] == "sign"
    assert values["reason_steered"] == f"{side} of an obstacle 0.46 m ahead"
    assert float(values["angular_radps"]) == about(bench.command[1], abs=1e-3)


def test_the_turn_that_was_added_is_not_kept() -> None:
    """``Go`` keeps what the person set, and that was to drive straight on."""
    bench = MonitorBench(CollisionMonitorConfig(), STEER)
    bench.show("Forward", 40, ahead(7.0))
    bench.show("Forward", 2, ahead(0.72))
    assert bench.command[1] != 0.0
    bench.show("Go", 2, ahead(7.0))
    assert bench.command[0] > 0.2
    assert bench.command[1] == 0.0


def test_stop_is_at_once() -> None:
    bench = MonitorBench(CollisionMonitorConfig(), STEER)
    bench.show("Forward", 40, ahead(7.0))
    bench.show("Forward", 2, ahead(0.72))
    bench.show("Stop", 1, ahead(0.72))
    assert bench.command == (0.0, 0.0)


def test_without_scans_and_with_old_ones_it_stands_as_the_brake_does() -> None:
    bench = MonitorBench(CollisionMonitorConfig(), STEER)
    bench.show("Forward", 10)
    assert bench.command == (0.0, 0.0)
    assert "no laser scan has come" in bench.report()[0]
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0
    bench.show("Forward", 20, ahead(7.0), age_s=1.0)
    assert bench.command == (0.0, 0.0)


@pytest.mark.parametrize("kind", ["off", "brake", "steer"])
def test_it_can_be_chosen_while_it_runs(kind: str) -> None:
    bench = MonitorBench(CollisionMonitorConfig())
    bench.control.reconfigure(Config(control=ControlConfig(assist=kind)))
    bench.show("Forward", 5)
    assert (bench.command[0] > 0.0) == (kind == "off"), "without a scan"


def test_the_older_parameter_is_the_brake_where_assist_is_off() -> None:
    bench = MonitorBench(CollisionMonitorConfig(enabled=True), ControlConfig())
    bench.show("Forward", 5)
    assert bench.command == (0.0, 0.0)
    assert Config(collision_monitor=CollisionMonitorConfig(enabled=True)).uses_scans
    assert not Config().uses_scans


def test_off_in_yaml_is_false_and_other_names_are_refused() -> None:
    assert ControlConfig.model_validate({"assist": False}).assist == "off"
    with pytest.raises(ValueError, match="'off', 'brake' or 'steer'"):
        ControlConfig.model_validate({"assist": "push"})


class Wild:
    """An assist that returns what it should not, or fails."""

    def __init__(self, made: Velocity | None) -> None:
        self._made = made

    def step(self, wanted: Velocity, *_: Any) -> tuple[Velocity, Hit | None]:
        if self._made is None:
            raise ValueError("no")
        return self._made, Hit(1.0, 0.0, 0.7, 1.0)


@pytest.mark.parametrize(
    "made",
    [
        pytest.param(Velocity(0.9, 0.2), id="faster"),
        pytest.param(Velocity(-0.1, 0.2), id="the other way"),
        pytest.param(Velocity(0.4, -0.1), id="against the turn"),
        pytest.param(Velocity(0.4, 2.5), id="beyond the limit"),
        pytest.param(Velocity(0.4, float("nan")), id="not a number"),
        pytest.param(None, id="raises"),
    ],
)
def test_what_an_assist_may_not_do_is_left_out(made: Velocity | None, caplog: pytest.LogCaptureFixture) -> None:
    bench = MonitorBench(CollisionMonitorConfig(), ControlConfig(assist="brake", max_linear=0.5))
    bench.control._monitor._limiter.assist = Wild(made)
    wanted = Velocity(0.4, 0.2)
    bench.scan(ahead(7.0))
    bench.run(0.01)
    assert bench.control._monitor.admit(wanted) == wanted
    assert "the assist" in caplog.text


def test_the_brake_limits_what_an_assist_makes() -> None:
    limiter = ObstacleLimiter(CollisionMonitorConfig())
    limiter.assist, limiter.max_angular_radps = Wild(Velocity(0.5, 0.1)), 2.0
    limiter.see(np.array([(0.6, y) for y in np.linspace(-1, 1, 99)]), 0.0)
    allowed = limiter.limit(Velocity(0.5, 0.0), 0.0)
    assert 0.0 < allowed.linear_mps < 0.4
    assert limiter.avoided is not None


@pytest.mark.parametrize(
    ("wanted", "allowed", "goes_on"),
    [
        (Velocity(0.4, 0.0), Velocity(0.3, 0.7), Velocity(0.3, 0.0)),
        (Velocity(0.4, 0.2), Velocity(0.3, 0.7), Velocity(0.3, 0.2)),
        (Velocity(0.4, -0.2), Velocity(0.4, -0.1), Velocity(0.4, -0.1)),
        (Velocity(-0.4, 0.01), Velocity(-0.1, -0.3), Velocity(-0.1, 0.0)),
    ],
)
def test_a_turn_that_was_added_is_nothing_to_go_on_from(wanted: Velocity, allowed: Velocity, goes_on: Velocity) -> None:
    assert assist.held_back(wanted, allowed) == goes_on


@pytest.mark.parametrize(
    ("wanted", "made"),
    [
        (Velocity(), Velocity(0.1, 0.0)),
        (Velocity(), Velocity(0.0, 0.3)),
        (Velocity(0.0, 0.5), Velocity(0.1, 0.5)),
        (Velocity(0.0, 0.5), Velocity(0.0, 0.6)),
    ],
)
def test_an_assist_moves_nothing_that_the_person_does_not_move(wanted: Velocity, made: Velocity) -> None:
    assert not assist.is_within(made, wanted, 2.0)


def test_an_assist_that_cannot_be_made_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        def __init__(self) -> None:
            raise ValueError("no scanner")

    monkeypatch.setattr(doors.ASSISTS, "load", lambda name: Broken)
    bench = MonitorBench(CollisionMonitorConfig())
    with pytest.raises(
        ConfigError, match=r"control\.assist: the assist steer of handsteer cannot be made: ValueError: no scanner"
    ):
        bench.control.check(Config(control=STEER))
