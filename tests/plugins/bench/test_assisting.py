"""The control's assist on a lap."""

import pytest

from handsteer.config import Config
from handsteer.errors import BenchError
from handsteer.plugins.bench.assisting import Assistance
from handsteer.plugins.bench.cells import Cell
from handsteer.plugins.bench.laps import Conditions, run_lap
from handsteer.plugins.bench.verb import Varied, _conditions
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.world import World
from handsteer.types import Velocity

WALL = {"name": "wall", "shape": "box", "size": [0.2, 1.2, 0.5], "position": [0.9, -0.4]}
WANTED = Velocity(0.6, 0.0)


def admitted(kind: str) -> tuple[Velocity, Velocity | None]:
    robot = SimulatedRobot(Config().robot, World.model_validate({"obstacles": [WALL]}))
    assistance = Assistance(kind, Config(), robot)
    state = robot.step(0.01)
    assistance.note(state)
    return assistance.admit(WANTED, state.time_s)


def test_off_changes_nothing() -> None:
    assert admitted("off") == (WANTED, None)


def test_the_brake_slows_by_the_robot_s_scanner_and_the_control_goes_on_from_there() -> None:
    allowed, goes_on = admitted("brake")
    assert 0.0 < allowed.linear_mps < 0.6
    assert goes_on == allowed


def test_steer_turns_to_the_free_side_and_the_control_does_not() -> None:
    allowed, goes_on = admitted("steer")
    assert allowed.angular_radps > 0.1
    assert goes_on == Velocity(allowed.linear_mps, 0.0)


def test_before_the_first_scan_nothing_moves() -> None:
    robot = SimulatedRobot(Config().robot, World())
    assert Assistance("brake", Config(), robot).admit(WANTED, 0.0)[0].is_zero


def test_each_assist_is_a_condition_of_its_own_and_a_row_of_the_table() -> None:
    assert [each.assist for each in Varied().conditions("brake")] == ["brake"]
    varied = Varied(sweep=["latency=0,250"], assist=["off", "steer"]).conditions("off")
    assert [(each.latency_s, each.assist) for each in varied] == [
        (0.0, "off"),
        (0.0, "steer"),
        (0.25, "off"),
        (0.25, "steer"),
    ]
    assert [_conditions(Cell("maze", "pad", each)) for each in varied] == ["-", "steer", "+250 ms", "+250 ms, steer"]
    (worse,) = Varied(operator="worse").conditions("off")
    assert _conditions(Cell("maze", "pad", worse)) == "errors x2, reacts 400 ms, looks away 2000 ms"
    with pytest.raises(BenchError, match="assist: 'push' should be off, brake, steer"):
        Conditions(assist="push")


@pytest.mark.slow
def test_nobody_who_walks_is_touched_by_a_robot_that_moves() -> None:
    """The operator does not look at them: without assist the robot touches some of them on most laps."""
    off, brake, steer = (run_lap("corridor", "pad", 2, Conditions(assist=each)) for each in ("off", "brake", "steer"))
    assert off.bumps > 0
    assert (brake.bumps, steer.bumps) == (0, 0)
    assert brake.finished
    assert steer.finished


@pytest.mark.slow
def test_who_has_stood_for_the_robot_is_not_touched_when_they_walk_on() -> None:
    """Signs are slow enough for that; on this lap a person sets out when the robot is beside them."""
    assert run_lap("corridor", "signs", 3, Conditions(assist="steer")).bumps == 0


@pytest.mark.slow
@pytest.mark.parametrize(("interface", "seed"), [("keys", 2), ("point", 0)])
def test_steer_does_not_take_the_robot_past_a_post_on_the_other_side(interface: str, seed: int) -> None:
    """Once no such lap ended: what a key is pressed for, or a finger tilted, is not where the person goes."""
    lap = run_lap("slalom", interface, seed, Conditions(assist="steer"))
    assert lap.finished
    assert (lap.missed, lap.bumps) == (0, 0)
