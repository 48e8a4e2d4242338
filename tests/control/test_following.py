"""Whether a robot does what is commanded, by its odometry."""

import math

import pytest

from handsteer.control.following import Following
from handsteer.types import ZERO, Velocity

STEP_S = 0.02
AGAINST = "the robot moved against its commands"


def test_a_robot_whose_odometry_stops_is_not_there() -> None:
    following = Following()
    assert following.step(10.0, Velocity(0.5, 0.0)) is None, "it never gave any"
    following.note(Velocity(0.5, 0.0))
    assert following.step(0.35, Velocity(0.5, 0.0)) is None
    assert following.step(0.06, Velocity(0.5, 0.0)) == "the robot's odometry has stopped"
    following.note(Velocity(0.5, 0.0))
    assert following.step(0.02, Velocity(0.5, 0.0)) is None


def test_the_first_odometry_is_no_older_for_a_late_step() -> None:
    following = Following()
    following.note(Velocity(0.5, 0.0), since_step_s=1.5)
    assert following.step(1.5, Velocity(0.5, 0.0)) is None
    assert following.step(0.35, Velocity(0.5, 0.0)) is None
    assert following.step(0.06, Velocity(0.5, 0.0)) == "the robot's odometry has stopped"


def test_later_odometry_does_not_hide_that_the_control_was_stalled() -> None:
    following = Following()
    following.note(Velocity(0.5, 0.0))
    following.note(Velocity(0.5, 0.0), since_step_s=0.5)
    assert following.step(0.5, Velocity(0.5, 0.0)) == "the robot's odometry has stopped"


@pytest.mark.parametrize("checks_motion", [True, False])
def test_a_robot_whose_odometry_has_never_been_a_number_is_not_there(checks_motion: bool) -> None:
    following = Following(checks_motion=checks_motion)
    following.note(Velocity(math.nan, 0.0))
    assert following.step(0.35, Velocity(0.5, 0.0)) is None
    following.note(Velocity(math.nan, 0.0))
    assert following.step(0.06, Velocity(0.5, 0.0)) == "the robot's odometry has stopped"


def test_where_motion_is_not_checked_silence_still_is() -> None:
    following = Following(checks_motion=False)
    for _ in range(200):
        following.note(ZERO)
        assert following.step(0.02, Velocity(1.0, 0.0)) is None
    assert not following.is_silent
    assert following.step(0.5, Velocity(1.0, 0.0)) == "the robot's odometry has stopped"
    assert following.is_silent


@pytest.mark.parametrize("commanded", [Velocity(0.5, 0.0), Velocity(-0.5, 0.0), Velocity(0.0, 1.0)])
def test_a_robot_that_stands_though_it_is_told_to_move_does_not_follow(commanded: Velocity) -> None:
    following, said = Following(), []
    for _ in range(60):
        following.note(ZERO)
        said.append(following.step(0.02, commanded))
    assert "the robot did not follow its commands" in said[49:]
    assert set(said[:49]) == {None}


def test_a_robot_that_has_followed_and_stands_does_not_hear() -> None:
    following, forward = Following(), Velocity(0.5, 0.0)
    following.note(Velocity(0.4, 0.0))
    assert following.step(0.02, forward) is None
    said = []
    for _ in range(6):
        following.note(ZERO)
        said.append(following.step(0.02, forward))
    assert said[-2] == "the robot did not follow its commands"


def test_a_robot_that_turns_round_stands_for_a_moment() -> None:
    following = Following()
    following.note(Velocity(0.5, 0.0))
    assert following.step(0.02, Velocity(0.5, 0.0)) is None
    for number in range(50):
        following.note(Velocity(0.5 - 0.02 * number, 0.0))
        assert following.step(0.02, Velocity(-0.5, 0.0)) is None


def test_a_robot_that_moves_or_is_told_little_follows() -> None:
    for commanded, measured in ((Velocity(0.5, 0.0), Velocity(0.3, 0.0)), (Velocity(0.02, 0.0), ZERO), (ZERO, ZERO)):
        following = Following()
        for _ in range(200):
            following.note(measured)
            assert following.step(0.02, commanded) is None


def test_odometry_that_is_no_number_is_none() -> None:
    """The guard: ``is_finite`` in ``Following.note``."""
    following, said = Following(), []
    following.note(Velocity(0.5, 0.0))
    for _ in range(30):
        following.note(Velocity(math.nan, 0.0))
        said.append(following.step(0.02, Velocity(0.5, 0.0)))
    assert said[-1] == "the robot's odometry has stopped"


def drive(following: Following, commanded: Velocity, measured: list[Velocity]) -> float | None:
    """Return after how many seconds it is said to move against its commands; None if it is not."""
    for number, one in enumerate(measured, 1):
        following.note(one)
        if following.step(STEP_S, commanded) == AGAINST:
            return number * STEP_S
    return None


def even(linear_mps: float, angular_radps: float, seconds: float = 4.0) -> list[Velocity]:
    return [Velocity(linear_mps, angular_radps)] * round(seconds / STEP_S)


@pytest.mark.parametrize(
    ("commanded", "measured"),
    [
        (Velocity(0.5, 0.0), (-0.5, 0.0)),
        (Velocity(-0.5, 0.0), (0.4, 0.0)),
        (Velocity(0.2, 0.0), (-0.3, 0.0)),
        (Velocity(0.0, 1.0), (0.0, -1.0)),
        (Velocity(0.5, -1.0), (0.5, 0.8)),
    ],
)
def test_a_robot_that_moves_against_its_commands_is_noticed(commanded: Velocity, measured: tuple[float, float]) -> None:
    following = Following()
    assert drive(following, commanded, even(0.0, 0.0, 0.2)) is None
    assert drive(following, commanded, even(*measured)) == pytest.approx(0.4)


@pytest.mark.parametrize("deceleration_mps2", [0.25, 0.5, 2.0])
@pytest.mark.parametrize("dead_time_s", [0.0, 0.3, 0.5])
def test_a_robot_that_is_turned_round_may_brake(deceleration_mps2: float, dead_time_s: float) -> None:
    following = Following()
    assert drive(following, Velocity(1.0, 0.0), even(1.0, 0.0)) is None
    speeds = [1.0] * round(dead_time_s / STEP_S)
    while speeds[-1:] != [-1.0]:
        speeds.append(max(-1.0, (speeds or [1.0])[-1] - deceleration_mps2 * STEP_S))
    assert drive(following, Velocity(-1.0, 0.0), [Velocity(speed, 0.0) for speed in speeds]) is None
    assert drive(following, Velocity(-1.0, 0.0), even(-1.0, 0.0)) is None


def test_a_robot_that_does_not_turn_round_is_noticed() -> None:
    following = Following()
    assert drive(following, Velocity(1.0, 0.0), even(1.0, 0.0)) is None
    assert drive(following, Velocity(-1.0, 0.0), even(1.0, 0.0)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("commanded", "measured"),
    [
        (Velocity(0.5, 0.0), even(-0.08, 0.0)),  # slips back slowly on a slope
        (Velocity(0.5, 0.0), [*even(-0.4, 0.0, 0.36), *even(0.3, 0.0, 0.1)] * 20),  # in jerks
        (Velocity(0.5, 0.0), even(-1.2, 0.0)),  # is pushed back fast
        (Velocity(0.5, 0.0), even(-0.2, 0.0)),  # or slowly
        (Velocity(0.1, 0.0), even(-0.1, 0.0)),  # is told little
        (Velocity(0.5, 0.3), even(0.5, -0.3)),
        (ZERO, even(-0.5, -1.0)),  # is pushed while it shall stand
        (Velocity(0.5, 0.0), even(math.nan, 0.0)),
    ],
)
def test_a_robot_that_is_pushed_or_slips_is_not_stopped(commanded: Velocity, measured: list[Velocity]) -> None:
    assert drive(Following(), commanded, measured) is None


def test_where_motion_is_not_checked_its_direction_is_not_either() -> None:
    assert drive(Following(checks_motion=False), Velocity(0.5, 0.0), even(-0.5, 0.0)) is None
