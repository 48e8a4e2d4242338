import logging
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import Config, RobotConfig
from handsteer.errors import WorldError
from handsteer.making import open_robot
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RobotState
from handsteer.robots.world import World, load_world

PERIOD_S = 0.02


def make(*obstacles: dict[str, object], **config: object) -> SimulatedRobot:
    world = World.model_validate({"obstacles": obstacles})
    return SimulatedRobot(RobotConfig.model_validate(config), world)


def drive(robot: SimulatedRobot, linear_mps: float, angular_radps: float, seconds: float) -> Iterator[RobotState]:
    for _ in range(round(seconds / PERIOD_S)):
        robot.command(linear_mps, angular_radps)
        yield robot.step(PERIOD_S)


def end_of(states: Iterator[RobotState]) -> RobotState:
    *_, last = states
    return last


def turned_by(states: Iterator[RobotState]) -> float:
    yaws = np.array([state.truth.yaw for state in states])
    return float(np.unwrap(yaws)[-1])


def tilt_deg(robot: SimulatedRobot) -> float:
    qx, qy = robot.data.qpos[4:6]
    return math.degrees(math.acos(1 - 2 * (qx * qx + qy * qy)))


def wall(**fields: object) -> dict[str, object]:
    return {"name": "wall", "shape": "box", "size": [0.2, 4, 0.5], "position": [1.5, 0], **fields}


def test_half_a_metre_a_second_for_four_seconds_is_two_metres() -> None:
    robot = make()
    for _ in drive(robot, 0.5, 0.0, 4.0):
        pass
    state = end_of(drive(robot, 0.0, 0.0, 1.0))
    assert state.truth.x == pytest.approx(2.0, rel=0.005)
    assert abs(state.truth.y) < 0.005
    assert state.odometry.x == pytest.approx(state.truth.x, rel=0.005)


def test_four_seconds_at_a_steady_half_metre_a_second() -> None:
    robot = make()
    before = end_of(drive(robot, 0.5, 0.0, 1.0)).truth.x
    assert end_of(drive(robot, 0.5, 0.0, 4.0)).truth.x - before == pytest.approx(2.0, rel=0.005)


@pytest.mark.parametrize("angular_radps", [0.5, -0.5, 1.0, -2.0, 6.0])
def test_a_turn_in_place_is_as_told(angular_radps: float) -> None:
    """Scrubbing takes 1 to 5 %; the ramp up is made up for by the ramp down."""
    robot = make()
    told = angular_radps * 6.0
    states = [*drive(robot, 0.0, angular_radps, 6.0), *drive(robot, 0.0, 0.0, 3.5)]
    assert turned_by(iter(states)) == pytest.approx(told, rel=0.07)
    assert math.hypot(states[-1].truth.x, states[-1].truth.y) < 0.01


def test_left_is_positive() -> None:
    state = end_of(drive(make(), 0.3, 0.5, 2.0))
    assert state.truth.yaw > 0.5
    assert state.truth.y > 0
    assert state.angular_radps > 0
    assert state.joint_velocities["front_right_wheel_joint"] > state.joint_velocities["front_left_wheel_joint"]


def test_a_gentle_curve_ends_near_its_odometry() -> None:
    state = end_of(drive(make(), 0.5, 0.5, 6.0))
    assert math.hypot(state.truth.x - state.odometry.x, state.truth.y - state.odometry.y) < 0.1


def test_it_stands_still() -> None:
    robot = make()
    end_of(drive(robot, 0.5, 0.5, 2.0))
    before = end_of(drive(robot, 0.0, 0.0, 2.0))
    after = robot.step(10.0)
    assert math.hypot(after.truth.x - before.truth.x, after.truth.y - before.truth.y) < 1e-5
    assert abs(after.truth.yaw - before.truth.yaw) < 1e-5
    assert abs(after.linear_mps) < 1e-6


def test_it_does_not_tip_when_braking_from_full_speed() -> None:
    robot = make()
    end_of(drive(robot, 2.0, 0.0, 3.0))
    assert robot.step(0.0).linear_mps == pytest.approx(2.0, rel=0.01)
    assert max(tilt_deg(robot) for _ in drive(robot, 0.0, 0.0, 2.5)) < 0.5
    assert abs(robot.step(0.0).linear_mps) < 0.01


def test_it_brakes_when_commands_stop_coming_by_its_own_time() -> None:
    robot = make()
    end_of(drive(robot, 0.5, 0.0, 1.0))
    assert robot.step(0.3).linear_mps == pytest.approx(0.5, rel=0.02)
    assert 0.2 < robot.step(0.3).linear_mps < 0.4
    assert abs(robot.step(0.5).linear_mps) < 0.01


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_brakes(bad: float) -> None:
    robot = make()
    end_of(drive(robot, 0.5, 0.0, 1.0))
    assert abs(end_of(drive(robot, bad, 0.0, 1.0)).linear_mps) < 0.01
    assert abs(end_of(drive(robot, 0.5, bad, 1.0)).linear_mps) < 0.01


def test_a_wall_at_full_speed_does_not_throw_it_over() -> None:
    robot = make(wall(position=[2.5, 0]))
    assert max(tilt_deg(robot) for _ in drive(robot, 2.0, 0.0, 6.0)) < 20
    state = end_of(drive(robot, 0.0, 0.0, 1.0))
    assert state.truth.x < 2.15
    assert abs(state.truth.yaw) < 0.1
    assert tilt_deg(robot) < 0.1


@pytest.mark.parametrize("speed_mps", [0.3, 0.5, -1.0])
def test_a_wall_stops_it_and_counts_once(speed_mps: float) -> None:
    robot = make(wall(position=[math.copysign(2.5, speed_mps), 0]))
    states, tilts = zip(*((state, tilt_deg(robot)) for state in drive(robot, speed_mps, 0.0, 9.0)), strict=True)
    state = states[-1]
    assert state.contacts == ("wall",)
    assert state.collisions == 1
    assert abs(state.truth.x) == pytest.approx(2.4 - 0.26, abs=0.03)
    assert abs(state.truth.x) < abs(state.odometry.x)
    assert max(tilts) < 5
    state = end_of(drive(robot, -speed_mps, 0.0, 3.0))
    assert state.contacts == ()
    assert state.collisions == 1


def test_bumping_again_counts_again() -> None:
    robot = make(wall())
    for _ in range(2):
        end_of(drive(robot, 0.5, 0.0, 3.5))
        end_of(drive(robot, -0.5, 0.0, 1.5))
    assert robot.step(0.0).collisions == 2


@pytest.mark.parametrize("shape", [{"shape": "box", "size": [0.3] * 3}, {"shape": "sphere", "radius": 0.15}])
def test_it_pushes_what_is_movable(shape: dict[str, object]) -> None:
    robot = make({"name": "it", "position": [1.0, 0.0], "movable": True, **shape})
    state = end_of(drive(robot, 0.5, 0.0, 4.0))
    (thing,) = robot.obstacles()
    assert thing.name == "it"
    assert thing.position[0] > 1.5
    assert (state.collisions or 0) >= 1
    assert state.truth.x > 1.4
    robot.step(20.0)
    before = robot.obstacles()[0].position
    robot.step(1.0)
    assert robot.obstacles()[0].position == pytest.approx(before, abs=0.005)


def test_obstacles_are_told_where_they_are() -> None:
    robot = make(wall(yaw=1.0), {"name": "can", "shape": "cylinder", "radius": 0.1, "height": 0.6, "position": [0, 2]})
    board, can = robot.obstacles()
    assert (board.size, board.position) == ((0.2, 4.0, 0.5), (1.5, 0.0, 0.25))
    assert board.orientation == pytest.approx((0.0, 0.0, math.sin(0.5), math.cos(0.5)))
    assert (can.shape, can.size, can.position) == ("cylinder", (0.2, 0.2, 0.6), (0.0, 2.0, 0.3))


def walker(**fields: object) -> dict[str, object]:
    found = {"name": "Ada", "shape": "cylinder", "radius": 0.25, "height": 1.7, "position": [3, 1], "speed": 0.5}
    return {**found, "route": [[3, -1], [4, -1]], **fields}


def place_of(robot: SimulatedRobot) -> tuple[float, float]:
    (ada,) = (each for each in robot.obstacles() if each.name == "Ada")
    return ada.position[0], ada.position[1]


def test_a_thing_with_a_route_goes_along_it_and_back() -> None:
    robot = make(walker())
    seen = []
    for _ in range(13):
        seen.append(place_of(robot))
        robot.step(1.0)
    there = [(3, 1), (3, 0.5), (3, 0), (3, -0.5), (3, -1), (3.5, -1), (4, -1)]
    assert np.allclose(seen, [*there, *reversed(there[:-1])], atol=0.02)


def test_who_walks_is_seen_by_the_scanner_where_they_are() -> None:
    robot = make(walker(route=[[1, 1]]))
    before = robot.scan().ranges
    robot.step(4.0)
    after = robot.scan().ranges
    assert np.isfinite(before).sum() > 3
    assert float(np.min(after)) == pytest.approx(math.hypot(1, 1) - 0.25, abs=0.02)


def test_who_meets_the_robot_stops_before_it_and_turns_round() -> None:
    robot = make(walker(position=[2, 0], route=[[-2, 0]]))
    met = [(robot.step(0.1), place_of(robot)[0]) for _ in range(60)]
    assert min(x for _, x in met) == pytest.approx(0.9, abs=0.02)
    assert met[-1][1] > 1.3
    assert met[-1][0].collisions == 0


def test_a_robot_that_drives_into_somebody_touches_them() -> None:
    robot = make(walker(position=[1.5, 0.05], route=[[1.5, 0.06]]))
    state = end_of(drive(robot, 0.5, 0.0, 4.0))
    assert state.collisions
    assert state.contacts == ("Ada",)
    assert state.truth.x < 1.1


def test_who_walks_goes_on_from_there_when_the_world_changes_and_begins_again_with_the_lap() -> None:
    robot = make(walker(route=[[3, -1]]))
    robot.step(1.0)
    robot.change(World.model_validate({"obstacles": [wall(position=[-3, 0]), walker(route=[[3, -1]])]}))
    assert place_of(robot) == pytest.approx((3.0, 0.5), abs=0.02)
    robot.step(1.0)
    assert place_of(robot) == pytest.approx((3.0, 0.0), abs=0.02)
    robot.reset()
    assert place_of(robot) == pytest.approx((3.0, 1.0))


def test_reset_puts_everything_back_but_time_goes_on() -> None:
    robot = make({"name": "ball", "shape": "sphere", "radius": 0.15, "position": [0.8, 0], "movable": True})
    at_start = robot.obstacles()
    first = [state.truth for state in drive(robot, 0.5, 0.2, 4.0)]
    robot.reset()
    state = robot.step(0.0)
    assert robot.obstacles() == at_start
    assert (state.truth.x, state.truth.y, state.odometry.x, state.linear_mps, state.collisions) == (0, 0, 0, 0, 0)
    assert state.time_s == pytest.approx(4.0)
    assert [state.truth for state in drive(robot, 0.5, 0.2, 4.0)] == first


def test_the_same_commands_give_the_same_path_bit_for_bit() -> None:
    def path() -> list[RobotState]:
        random = np.random.default_rng(7)
        robot = open_robot(Config(), SteppedClock())
        states = []
        for linear_mps, angular_radps in random.uniform(-1, 1, (150, 2)).tolist():
            robot.command(linear_mps, angular_radps)
            states.append(robot.step(0.05))
        return states

    assert path() == path()


def test_the_length_of_steps_does_not_matter() -> None:
    coarse, fine = make(), make()
    coarse.command(0.5, 0.5)
    fine.command(0.5, 0.5)
    for _ in range(128):
        state = fine.step(1 / 128)
    assert state == coarse.step(1.0)
    assert state.time_s == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(4))
def test_whatever_it_is_told_it_stays_finite(seed: int) -> None:
    """Jerked about at speeds and accelerations far beyond any such robot's, between loose things."""
    random = np.random.default_rng(seed)
    things = [
        {"name": f"{i}", "shape": "box", "size": [0.3] * 3, "position": [x, y], "movable": True, "mass": mass}
        for i, (x, y, mass) in enumerate([(0.6, 0.0, 0.01), (-0.6, 0.2, 1000), (0.62, 0.1, 50), (0.0, 0.7, 0.1)])
    ]
    limits = {"max_linear": 20, "max_linear_acceleration": 50, "max_angular": 50, "max_angular_acceleration": 50}
    robot = make(*things, wheel_radius=0.001, **limits)
    for linear_mps, angular_radps in random.uniform(-50, 50, (60, 2)).tolist():
        robot.command(linear_mps, angular_radps)
        state = robot.step(0.1)
        numbers = [state.truth.x, state.truth.y, state.truth.yaw, state.odometry.x, state.odometry.y, state.linear_mps]
        assert np.isfinite([*numbers, *state.joint_velocities.values()]).all()
        assert all(np.isfinite(thing.position).all() for thing in robot.obstacles())


@pytest.mark.parametrize("bad", [math.nan, 1e300])
def test_a_simulation_that_blows_up_leaves_the_robot_standing(bad: float, caplog: pytest.LogCaptureFixture) -> None:
    robot = make(wall())
    before = end_of(drive(robot, 0.4, 0.0, 1.0)).truth
    robot.data.qvel[:] = bad
    with caplog.at_level(logging.WARNING):
        state = robot.step(0.01)
    assert "unstable" in caplog.text
    assert state.truth == before
    assert state.linear_mps == pytest.approx(0.0, abs=0.02)
    assert end_of(drive(robot, 0.4, 0.0, 1.0)).truth.x == pytest.approx(before.x + 0.32, abs=0.02)


def test_close_stops_it_at_once() -> None:
    robot = make()
    end_of(drive(robot, 0.5, 0.0, 1.0))
    robot.close()
    robot.close()
    assert abs(robot.step(0.01).linear_mps) < 1e-3


def test_an_obstacle_on_the_robot_is_refused() -> None:
    with pytest.raises(WorldError, match="position of obstacle 'wall' overlaps the robot"):
        make(wall(position=[0.3, 0]))


def test_an_unknown_world_is_refused() -> None:
    with pytest.raises(WorldError, match="no world 'moon'"):
        open_robot(Config(robot=RobotConfig(world="moon")), SteppedClock())


def test_first_drive_in_the_shipped_world_is_free() -> None:
    robot = SimulatedRobot(RobotConfig(world="obstacles"))
    state = end_of(drive(robot, 0.5, 0.0, 5.2))
    assert state.truth.x > 2.4
    assert state.collisions == 0
    assert len(robot.obstacles()) == len(load_world("obstacles").obstacles)


def test_things_of_the_shipped_world_stay_where_they_are() -> None:
    robot = SimulatedRobot(RobotConfig(world="obstacles"))
    before = [thing.position for thing in robot.obstacles()]
    robot.step(20.0)
    assert np.allclose([thing.position for thing in robot.obstacles()], before, atol=2e-3)


def test_nothing_is_printed_or_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    robot = make()
    robot.data.qvel[:] = math.nan
    robot.step(0.1)
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []
