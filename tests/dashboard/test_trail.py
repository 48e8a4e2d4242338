import math

from hypothesis import given
from hypothesis import strategies as st

from handsteer.dashboard.trail import LEAP_M, MOST_POINTS, STEP_M, Trail
from handsteer.types import Pose2D


def gone(*xs: float) -> Trail:
    trail = Trail()
    for x in xs:
        trail = trail.to(Pose2D(x, 0.0, 0.0))
    return trail


def test_a_robot_that_stands_leaves_one_point() -> None:
    assert gone(1.0, 1.0, 1.01).points == ((1.0, 0.0),)


@given(st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=200))
def test_points_are_neither_close_nor_far(moves: list[float]) -> None:
    trail, x = Trail(), 0.0
    for move in moves:
        x += move
        trail = trail.to(Pose2D(x, 0.0, 0.0))
    for before, after in zip(trail.points, trail.points[1:], strict=False):
        assert STEP_M <= math.dist(before, after) <= LEAP_M


@given(st.lists(st.sampled_from([0.01, 0.1, 0.2, 3.0]), max_size=60), st.lists(st.booleans(), min_size=60, max_size=60))
def test_what_is_shown_piece_by_piece_is_the_whole(moves: list[float], looks: list[bool]) -> None:
    trail, shown, x = Trail(), Trail(), 0.0
    drawn: list[tuple[float, float]] = []
    for move, looked in zip(moves, [*looks, True], strict=False):
        x += move
        trail = trail.to(Pose2D(x, 0.0, 0.0))
        if looked:
            if trail.number != shown.number:
                drawn, shown = [], Trail()
            drawn += trail.since(shown)
            shown = trail
    if trail is shown:
        assert tuple(drawn) == trail.points


def test_a_leap_and_a_restart_begin_a_new_trail() -> None:
    leapt = gone(0.0, 0.1, 5.0)
    assert (leapt.points, leapt.number) == (((5.0, 0.0),), 1)
    assert (leapt.anew().points, leapt.anew().number) == ((), 2)


def test_old_points_are_forgotten() -> None:
    trail = gone(*(0.1 * step for step in range(MOST_POINTS + 50)))
    assert len(trail.points) == MOST_POINTS
    assert trail.count == MOST_POINTS + 50
    assert trail.since(Trail()) == trail.points
