import json
import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from handsteer.config import RobotConfig
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.course import LEAP_M, Referee, crosses
from handsteer.robots.world import Gate, load_world
from handsteer.types import BUMP_S, MISS_S, CourseState, Pose2D, stopwatch

PERIOD_S = 0.02
COURSE = [Gate(name=f"gate {x}", left=(x, 1.0), right=(x, -1.0)) for x in (1.0, 2.0, 3.0, 4.0)]


def walk(referee: Referee, *points: tuple[float, float], bumps: int = 0) -> CourseState:
    """Go from point to point in steps of a tenth of the way, each 0.1 s; end with ``bumps`` collisions more."""
    last = (0.0, 0.0)
    time_s, state = referee.state.time_s, referee.state
    for x, y in points:
        for step in range(1, 11):
            time_s += 0.1
            pose = Pose2D(last[0] + (x - last[0]) * step / 10, last[1] + (y - last[1]) * step / 10, 0.0)
            state = referee.step(pose, bumps, time_s)
        last = (x, y)
    return state


def test_a_clean_run_passes_all_gates_and_scores_its_time() -> None:
    referee = Referee(COURSE)
    referee.step(Pose2D(0.0, 0.0, 0.0), 0, 0.0)
    state = walk(referee, (2.5, 0.0), (5.0, 0.0))
    assert (state.phase, state.passed, state.missed, state.bumps) == ("finished", 4, frozenset(), 0)
    assert state.time_s == pytest.approx(1.2)  # of 2 s: it starts at x = 1 and ends at 4
    assert state.score_s == state.time_s
    assert walk(referee, (2.0, 0.0), (5.0, 0.0), bumps=3) == state, "the finish ends it"


def test_what_goes_before_the_start_does_not_count() -> None:
    referee = Referee(COURSE)
    referee.step(Pose2D(0.0, 0.0, 0.0), 7, 12.0)
    assert walk(referee, (0.5, 0.0), (0.0, 0.0), bumps=9) == CourseState(4)
    assert walk(referee, (0.0, 2.0), (2.5, 2.0), (2.5, 0.0), (3.5, 0.0), bumps=9) == CourseState(4)


def test_a_gate_that_is_driven_around_is_missed_and_a_bump_costs() -> None:
    referee = Referee(COURSE)
    referee.step(Pose2D(0.0, 0.0, 0.0), 0, 0.0)
    walk(referee, (1.5, 0.0))
    state = referee.step(Pose2D(1.5, 0.0, 0.0), 2, 1.1)
    assert (state.passed, state.bumps, state.phase) == (1, 2, "running")
    referee = Referee(COURSE)
    referee.step(Pose2D(0.0, 0.0, 0.0), 0, 0.0)
    state = walk(referee, (1.5, 0.0), (1.5, 1.5), (2.5, 1.5), (2.5, 0.0), (5.0, 0.0))
    assert (state.phase, state.passed, state.missed) == ("finished", 3, frozenset({1}))
    assert state.score_s == pytest.approx(state.time_s + MISS_S)
    assert CourseState(4, bumps=3, time_s=10.0).score_s == 10.0 + 3 * BUMP_S


def test_no_gates_are_no_course() -> None:
    referee = Referee([])
    assert walk(referee, (5.0, 0.0)) == CourseState(0)


points = st.tuples(st.floats(-3, 3), st.floats(-3, 3))
gates = st.tuples(points, points).filter(lambda ends: math.dist(*ends) >= 0.1)


@given(ends=gates, along=st.floats(0.01, 0.99), reach=st.floats(0.01, 0.24), lean=st.floats(-1.4, 1.4))
def test_crossing_between_the_ends_counts_forward_and_not_backward(
    ends: tuple[tuple[float, float], tuple[float, float]], along: float, reach: float, lean: float
) -> None:
    left, right = ends
    gate = Gate(name="g", left=left, right=right)
    x, y = (left[i] + along * (right[i] - left[i]) for i in (0, 1))
    # Forward is a quarter turn to the left of the way from the left end to the right one.
    heading = math.atan2(right[1] - left[1], right[0] - left[0]) + math.pi / 2 + lean
    behind = Pose2D(x - reach * math.cos(heading), y - reach * math.sin(heading), 0.0)
    beyond = Pose2D(x + reach * math.cos(heading), y + reach * math.sin(heading), 0.0)
    assert crosses(gate, behind, beyond)
    assert not crosses(gate, beyond, behind)
    assert not crosses(Gate(name="g", left=right, right=left), behind, beyond)


@given(ends=gates, way=st.lists(points, min_size=2, max_size=40))
def test_a_way_crosses_a_gate_as_often_forward_as_it_comes_to_be_beyond_it(
    ends: tuple[tuple[float, float], tuple[float, float]], way: list[tuple[float, float]]
) -> None:
    """Between two crossings forward there is one backward, or a way around."""
    left, right = ends
    gate = Gate(name="g", left=left, right=right)
    poses = [Pose2D(x / 12, y / 12, 0.0) for x, y in way]  # steps shorter than a leap
    side = [
        (right[0] - left[0]) * (pose.y - left[1]) - (right[1] - left[1]) * (pose.x - left[0]) >= 0 for pose in poses
    ]
    crossed = [crosses(gate, *pair) for pair in pairwise(poses)]
    assert not any(yes and (before or not now) for yes, (before, now) in zip(crossed, pairwise(side), strict=True))


@given(start=points, end=points)
def test_a_leap_crosses_nothing(start: tuple[float, float], end: tuple[float, float]) -> None:
    assume(math.dist(start, end) > LEAP_M)
    gate = Gate(name="g", left=(0.0, 10.0), right=(0.0, -10.0))
    assert not crosses(gate, Pose2D(*start, 0.0), Pose2D(*end, 0.0))


def test_the_shipped_slalom_can_be_driven_cleanly() -> None:
    """Steers for a point beyond each gate's middle, as a person does."""
    world = load_world("slalom")
    robot, referee = SimulatedRobot(RobotConfig(), world), Referee(world.gates)
    state = robot.step(0.0)
    seen = referee.step(state.truth, 0, state.time_s)
    while seen.phase != "finished" and state.time_s < 120:
        gate = world.gates[seen.next_gate]
        dx, dy = gate.right[0] - gate.left[0], gate.right[1] - gate.left[1]
        width = math.hypot(dx, dy)
        middle_x, middle_y = (gate.left[0] + gate.right[0]) / 2, (gate.left[1] + gate.right[1]) / 2
        for ahead in (-0.5, 0.4):  # first to a point before the gate, then through it
            x, y = middle_x - dy / width * ahead, middle_y + dx / width * ahead
            along = (state.truth.x - middle_x) * -dy / width + (state.truth.y - middle_y) * dx / width
            if along < ahead - 0.1:
                break
        error = math.remainder(math.atan2(y - state.truth.y, x - state.truth.x) - state.truth.yaw, math.tau)
        robot.command(0.5 * max(0.0, math.cos(error)), max(-1.5, min(2.5 * error, 1.5)))
        state = robot.step(PERIOD_S)
        seen = referee.step(state.truth, state.collisions or 0, state.time_s)
    assert (seen.phase, seen.passed, seen.missed, seen.bumps) == ("finished", 8, frozenset(), 0)
    assert 10 < seen.time_s < 60


@pytest.mark.parametrize(
    ("time_s", "shown"), [(0.0, "0:00.0"), (23.49, "0:23.4"), (65.3, "1:05.3"), (600.0, "10:00.0")]
)
def test_a_stopwatch_shows_whole_tenths(time_s: float, shown: str) -> None:
    assert stopwatch(time_s) == shown


def test_a_state_in_words_and_in_json() -> None:
    state = CourseState(8, 8, frozenset({3}), 2, 23.4, "finished")
    assert str(state) == "gates 7/8, missed 1, bumps 2, 0:23.4, score 37.4 s"
    assert str(CourseState(8)) == "gates 0/8, bumps 0, 0:00.0"
    assert json.loads(json.dumps(state.as_dict()))["score_s"] == pytest.approx(37.4)
    assert state.as_dict()["missed"] == [3]
