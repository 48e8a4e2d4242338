import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.messages import Header, LaserScan, Time
from handsteer.plugins.page.drive_page import rows_of
from handsteer.plugins.page.world_panel import driver_words
from handsteer.plugins.page.world_state import (
    LEAP_M,
    PERIOD_S,
    SCAN_POINTS,
    SPAN_S,
    STEP_M,
    TRAIL_POINTS,
    Sample,
    Trail,
    VelocityHistory,
    arc_points,
    place_in_world,
    scan_points,
)
from handsteer.types import Pose2D, Velocity

FINITE = st.floats(-100, 100)
POSES = st.builds(Pose2D, FINITE, FINITE, st.floats(-7, 7))


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
    assert (leapt.restarted().points, leapt.restarted().number) == ((), 2)


def test_old_points_are_forgotten() -> None:
    trail = gone(*(0.1 * step for step in range(TRAIL_POINTS + 50)))
    assert len(trail.points) == TRAIL_POINTS
    assert trail.count == TRAIL_POINTS + 50
    assert trail.since(Trail()) == trail.points


def scan(*ranges: float, increment: float = math.pi / 2) -> LaserScan:
    header = Header(Time(0, 0), "base_scan")
    figures = (0.0, math.tau, increment, 0.0, 0.1, 0.1, 8.0)
    return LaserScan(header, *figures, np.array(ranges, np.float32), np.zeros(0, np.float32))


def test_points_are_in_the_world_where_the_robot_was() -> None:
    assert scan_points(scan(1.0, 2.0), Pose2D(1.0, 2.0, math.pi / 2)) == ((1.0, 3.0), (-1.0, 2.0))


def test_what_is_no_reading_is_no_point() -> None:
    assert scan_points(scan(math.inf, math.nan, -math.inf, 9.0, 0.01, 1.0), Pose2D(0, 0, 0)) == ((0.0, 1.0),)
    assert scan_points(scan(1.0, increment=math.nan), Pose2D(0, 0, 0)) == ()
    assert scan_points(scan(), Pose2D(0, 0, 0)) == ()


@given(speed=st.floats(-1, 1), turn=st.floats(-2, 2), yaw=st.floats(-3, 3))
def test_the_arc_is_the_way_of_the_next_second(speed: float, turn: float, yaw: float) -> None:
    points, x, y, heading = arc_points(Velocity(speed, turn), Pose2D(1.0, 2.0, yaw)), 1.0, 2.0, yaw
    if abs(speed) < 0.02:
        assert points == ()
        return
    for step in range(1, 1001):
        x += speed * 0.001 * math.cos(heading)
        y += speed * 0.001 * math.sin(heading)
        heading += turn * 0.001
        if step % 100 == 0:
            assert points[step // 100 - 1] == pytest.approx((x, y), abs=0.01)


def test_a_robot_that_turns_in_place_has_no_arc() -> None:
    assert arc_points(Velocity(0.0, 1.0), Pose2D(0.0, 0.0, 0.0)) == ()


def test_a_long_scan_is_drawn_in_part() -> None:
    points = scan_points(scan(*[2.0] * 10_000, increment=math.tau / 10_000), Pose2D(0, 0, 0))
    assert 0.9 * SCAN_POINTS < len(points) <= SCAN_POINTS


@given(truth=POSES, then=POSES, forward=FINITE)
def test_the_robot_goes_on_from_its_true_pose_as_its_wheels_count(truth: Pose2D, then: Pose2D, forward: float) -> None:
    now = Pose2D(then.x + forward * math.cos(then.yaw), then.y + forward * math.sin(then.yaw), then.yaw)
    placed = place_in_world(truth, then, now)
    assert placed.x == pytest.approx(truth.x + forward * math.cos(truth.yaw), abs=1e-6)
    assert placed.y == pytest.approx(truth.y + forward * math.sin(truth.yaw), abs=1e-6)
    assert placed.yaw == pytest.approx(truth.yaw, abs=1e-9)


def driven(history: VelocityHistory, seconds: float, begin_s: float = 0.0) -> float:
    for n in range(round(seconds / PERIOD_S)):
        history.add(Sample(begin_s + n * PERIOD_S, Velocity(0.5, 0.0), None))
    return begin_s + seconds


def test_gives_each_sample_once() -> None:
    history = VelocityHistory()
    now_s = driven(history, 1.0)
    count, first = history.since(0, now_s)
    assert len(first) == round(1.0 / PERIOD_S)
    assert history.since(count, now_s) == (count, [])
    now_s = driven(history, 0.2, now_s)
    assert [sample.at_s for sample in history.since(count, now_s)[1]] == [1.0 + n * PERIOD_S for n in range(4)]


def test_keeps_no_more_than_the_last_30_s() -> None:
    history = VelocityHistory()
    now_s = driven(history, 100.0)
    _, samples = history.since(0, now_s)
    assert len(samples) == round(SPAN_S / PERIOD_S)
    assert samples[0].at_s >= now_s - SPAN_S
    assert history.since(0, now_s + 10.0)[1][0].at_s >= now_s + 10.0 - SPAN_S
    assert history.since(0, now_s + 60.0)[1] == []


def test_two_who_sample_at_once_fill_it_no_faster() -> None:
    history = VelocityHistory()
    for n in range(100):
        history.add(Sample(n * PERIOD_S / 2.5, None, None))
    assert len(history.since(0, 0.0)[1]) <= 50


def test_rows_are_short_and_tell_a_gap_from_zero() -> None:
    samples = [Sample(1.23456, Velocity(0.12345, -1.0), None), Sample(1.3, None, Velocity(0.0, 0.25))]
    assert rows_of(samples) == ([(1.23, 0.123, None), (1.3, None, 0.0)], [(1.23, -1.0, None), (1.3, None, 0.25)])


@pytest.mark.parametrize(
    ("source", "camera", "words"),
    [
        ("signs", "virtual hand", "the demo hand"),
        ("joystick", "virtual hand", "the demo hand"),
        ("steering", "virtual hand", "pad and keys"),
        ("signs", "webcam 0", "signs"),
        ("joystick", "webcam 0", "the hand"),
        ("none", "webcam 0", "none"),
        ("other", "webcam 0", "other"),
    ],
)
def test_what_drives_is_not_the_viewers_hand_while_the_demo_is_shown(source: str, camera: str, words: str) -> None:
    assert driver_words(source, camera) == words
