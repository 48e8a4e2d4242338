import math
from statistics import median

import numpy as np
import pytest

from handsteer.plugins.bench.courses import open_course
from handsteer.plugins.bench.laps import Conditions, run_lap
from handsteer.plugins.bench.operator import (
    DECISION_S,
    Attention,
    Operator,
    Seen,
    Skill,
    adapted,
    projected_displacement,
)
from handsteer.types import ZERO, Pose2D, Velocity

EIGHT = open_course("figure-eight")
STRAIGHT = open_course("stop-line")


def off_path_m(latency_s: float, ratio_s: float) -> float:
    skill = Skill(pace_mps=0.5, kp=1.0, kd=ratio_s, projection_s=1.2, reluctance=0.3)
    laps = [run_lap(EIGHT, "pad", seed, Conditions(latency_s), skill=skill, adapts=False) for seed in range(3)]
    return median(lap.cross_track_m for lap in laps)


@pytest.mark.slow
def test_laps_get_worse_with_delay_and_the_best_ratio_of_gains_rises() -> None:
    ratios = (0.15, 0.6)
    prompt, late = ([off_path_m(latency_s, ratio) for ratio in ratios] for latency_s in (0.0, 0.5))
    assert min(prompt) < min(late)
    assert np.argmin(prompt) == 0
    assert np.argmin(late) == 1


def test_the_projected_displacement_is_positive_if_the_path_is_on_the_left() -> None:
    path = STRAIGHT.path
    assert projected_displacement(path, Pose2D(2.0, -0.2, 0.0), 2.0, 0.5) == pytest.approx(0.2, abs=0.02)
    assert projected_displacement(path, Pose2D(2.0, 0.0, 0.1), 2.0, 0.5) == pytest.approx(-0.05, abs=0.01)


def test_the_operator_sees_the_robot_a_delay_later() -> None:
    operator = Operator(STRAIGHT, Skill(), 0.5, np.random.default_rng(0))
    wanted = [operator.decide(Seen(Pose2D(0.0, 0.0, 0.0), ZERO)) for _ in range(round(0.5 / DECISION_S) + 1)]
    assert all(each.is_zero for each in wanted[:-1])
    assert wanted[-1].linear_mps > 0.0


def test_the_operator_backs_off_from_an_obstacle() -> None:
    operator = Operator(STRAIGHT, Skill(), 0.0, np.random.default_rng(0))
    stuck = Seen(Pose2D(2.0, 0.0, 0.0), ZERO, touches=True)
    assert any(operator.decide(stuck).linear_mps < 0.0 for _ in range(40))


@pytest.mark.parametrize("delay_s", [0.0, 0.25])
def test_the_operator_backs_off_where_an_assist_holds_the_robot(delay_s: float) -> None:
    """For six seconds the operator only wants more; then the robot is to go back, and then on."""
    operator = Operator(STRAIGHT, Skill(), delay_s, np.random.default_rng(0))
    held = Seen(Pose2D(2.0, 0.0, 0.0), ZERO)
    wanted = [operator.decide(held).linear_mps for _ in range(round(15.0 / DECISION_S))]
    first = next(number for number, each in enumerate(wanted) if each < 0.0)
    assert 6.0 <= first * DECISION_S <= 6.2 + 2 * delay_s
    assert wanted[first - 1] > wanted[round(delay_s / DECISION_S)] > 0.0
    assert max(wanted[first + round(3.0 / DECISION_S) :]) > 0.0


def test_the_operator_does_not_back_off_while_the_robot_turns_or_is_to_stand() -> None:
    operator = Operator(STRAIGHT, Skill(), 0.0, np.random.default_rng(0))
    turning = [Seen(Pose2D(2.0, 0.0, yaw), Velocity(0.0, 0.5)) for yaw in np.linspace(-2.0, -1.0, 200)]
    assert min(operator.decide(each).linear_mps for each in turning) == 0.0
    assert STRAIGHT.stop_m is not None
    there = Seen(Pose2D(STRAIGHT.stop_m, 0.0, 0.0), ZERO)
    operator = Operator(STRAIGHT, Skill(), 0.0, np.random.default_rng(0))
    operator.decide(Seen(Pose2D(STRAIGHT.stop_m - 0.5, 0.0, 0.0), ZERO))
    assert min(operator.decide(there).linear_mps for _ in range(200)) > -0.25


def test_the_operator_stops_at_the_line() -> None:
    operator = Operator(STRAIGHT, Skill(), 0.0, np.random.default_rng(0))
    x, speed = 0.0, 0.0
    for _ in range(600):
        speed = operator.decide(Seen(Pose2D(x, 0.0, 0.0), Velocity(speed))).linear_mps
        x += DECISION_S * speed
    assert x == pytest.approx(6.0, abs=0.1)
    assert speed == 0.0


def test_an_operator_who_does_not_look_goes_on_as_before() -> None:
    attention = Attention(2.0, np.random.default_rng(0))
    looks = [attention.looks() for _ in range(round(300 / DECISION_S))]
    gaps = [len(gap) * DECISION_S for gap in "".join(".#"[each] for each in looks).split("#") if gap]
    assert 10 <= len(gaps) <= 60
    assert set(np.round(gaps, 2)) <= {1.95, 2.0, 2.05}
    operator = Operator(STRAIGHT, Skill(), 0.0, np.random.default_rng(0), Attention(2.0, np.random.default_rng(0)))
    away = Pose2D(2.0, 0.3, 0.2)
    wanted = [operator.decide(Seen(Pose2D(1.0, 0.0, 0.0), ZERO)) for _ in range(looks.index(False))]
    assert {operator.decide(Seen(away, ZERO)) for _ in range(30)} == {wanted[-1]}
    assert [Attention(0.0, np.random.default_rng(0)).looks() for _ in range(1000)] == [True] * 1000


def test_with_delay_the_pace_falls_and_the_ratio_of_gains_rises() -> None:
    usual, late = Skill(), adapted(Skill(), 0.5)
    assert late.pace_mps < usual.pace_mps
    assert late.kd / late.kp > usual.kd / usual.kp
    assert adapted(usual, 0.0) == usual
    assert math.isfinite(adapted(usual, 5.0).pace_mps)
