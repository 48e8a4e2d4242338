import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import RobotConfig
from handsteer.plugins.sim.diff_drive import DriveState, integrate, step, velocity_of, wheel_speeds
from handsteer.types import Pose2D, Velocity

CONFIG = RobotConfig()
STILL = Velocity()
NOT_FINITE = [math.nan, math.inf, -math.inf]

any_float = st.floats(allow_nan=True, allow_infinity=True)
commands = st.none() | st.builds(Velocity, any_float, any_float)
steps = st.lists(st.tuples(commands, st.floats(0.0, 1.0)), max_size=30)


def run(state: DriveState, command: Velocity | None, seconds: float, dt_s: float = 0.01) -> DriveState:
    state = step(state, command, dt_s, CONFIG)
    for _ in range(round(seconds / dt_s) - 1):
        state = step(state, None, dt_s, CONFIG)
    return state


@given(steps)
def test_no_command_makes_it_leave_its_limits(inputs: list[tuple[Velocity | None, float]]) -> None:
    state = DriveState()
    for command, dt_s in inputs:
        before, state = state.velocity, step(state, command, dt_s, CONFIG)
        now = state.velocity
        assert abs(now.linear_mps) <= 2.0
        assert abs(now.angular_radps) <= 8.0
        assert abs(now.linear_mps - before.linear_mps) <= 1.0 * dt_s + 1e-12
        assert abs(now.angular_radps - before.angular_radps) <= 2.0 * dt_s + 1e-12
        assert all(math.isfinite(speed) for speed in wheel_speeds(now, CONFIG))


@given(steps)
def test_backward_and_right_are_the_mirror_of_forward_and_left(inputs: list[tuple[Velocity | None, float]]) -> None:
    state = mirrored = DriveState()
    for command, dt_s in inputs:
        opposite = command and Velocity(-command.linear_mps, -command.angular_radps)
        state, mirrored = step(state, command, dt_s, CONFIG), step(mirrored, opposite, dt_s, CONFIG)
        assert mirrored.velocity.linear_mps == -state.velocity.linear_mps
        assert mirrored.velocity.angular_radps == -state.velocity.angular_radps


@pytest.mark.parametrize("bad", NOT_FINITE)
def test_a_command_that_is_not_finite_brakes_both_ways(bad: float) -> None:
    state = DriveState(velocity=Velocity(0.5, 0.5), target=Velocity(0.5, 0.5))
    for command in (Velocity(bad, 0.5), Velocity(0.5, bad)):
        assert run(state, command, 0.49).velocity.linear_mps == pytest.approx(0.01)
        assert run(state, command, 0.49).velocity.angular_radps == 0.0


def test_it_accelerates_and_reaches_the_command() -> None:
    state = DriveState()
    state = run(state, Velocity(0.3, 0.4), 0.1)
    assert state.velocity.linear_mps == pytest.approx(0.1)
    assert state.velocity.angular_radps == pytest.approx(0.2)
    assert run(state, Velocity(0.3, 0.4), 0.4).velocity == Velocity(0.3, 0.4)


def test_a_command_beyond_its_limits_is_clamped() -> None:
    """The guard: ``clamped`` in ``step``."""
    state = DriveState()
    for _ in range(1000):
        state = step(state, Velocity(9.0, -99.0), 0.01, CONFIG)
    assert state.velocity == Velocity(CONFIG.max_linear, -CONFIG.max_angular)


def test_without_a_new_command_it_brakes_after_the_timeout() -> None:
    state = run(DriveState(velocity=Velocity(1.0, 0.0)), Velocity(1.0, 0.0), 0.38)
    assert state.velocity.linear_mps == 1.0
    assert run(state, None, 0.28).velocity.linear_mps == pytest.approx(0.75, abs=0.03)
    assert run(state, None, 1.2).velocity == STILL


def test_a_repeated_command_keeps_it_going() -> None:
    state = DriveState()
    for _ in range(20):
        state = run(state, Velocity(0.2, 0.0), 0.4)
    assert state.velocity.linear_mps == 0.2


def test_wheel_speeds_of_straight_and_turn() -> None:
    assert wheel_speeds(Velocity(0.6, 0.0), CONFIG) == pytest.approx((10.0, 10.0))
    assert wheel_speeds(Velocity(0.0, 2.0), CONFIG) == pytest.approx((-7.5, 7.5))


@given(st.floats(-2, 2), st.floats(-8, 8))
def test_wheel_speeds_tell_the_velocity_again(linear_mps: float, angular_radps: float) -> None:
    velocity = velocity_of(*wheel_speeds(Velocity(linear_mps, angular_radps), CONFIG), CONFIG)
    assert velocity.linear_mps == pytest.approx(linear_mps, abs=1e-12)
    assert velocity.angular_radps == pytest.approx(angular_radps, abs=1e-12)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_odometry_of_one_long_arc_is_that_of_many_short_ones(left: float, right: float) -> None:
    start = Pose2D(1.0, 2.0, 0.5)
    once, many = integrate(start, left, right, CONFIG), start
    for _ in range(50):
        many = integrate(many, left / 50, right / 50, CONFIG)
    assert (many.x, many.y) == pytest.approx((once.x, once.y), abs=1e-9)
    assert math.remainder(many.yaw - once.yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_odometry_of_a_quarter_circle_to_the_left() -> None:
    left, right = wheel_speeds(Velocity(math.pi / 2, math.pi / 2), CONFIG)
    pose = integrate(Pose2D(0.0, 0.0, 0.0), left, right, CONFIG)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, 1.0, math.pi / 2))
