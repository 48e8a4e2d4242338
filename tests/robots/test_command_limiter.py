import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import RobotConfig
from handsteer.robots.command_limiter import CommandLimiter
from handsteer.types import ZERO, Velocity

CONFIG = RobotConfig(max_linear=1.0, max_linear_acceleration=0.5, max_angular=2.0, max_angular_acceleration=4.0)
DT_S = 0.02
AHEAD = Velocity(0.3, 0.0)
EVENTS = st.lists(
    st.tuples(
        st.none() | st.tuples(st.floats(), st.floats()) | st.just((0.0, 0.0)), st.floats(0.0, 0.2), st.booleans()
    ),
    max_size=60,
)


def linked() -> CommandLimiter:
    relay = CommandLimiter(CONFIG)
    relay.step(DT_S, linked=True)
    relay.command(ZERO)
    return relay


def drive(relay: CommandLimiter, wanted: Velocity, seconds: float, *, is_linked: bool = True) -> list[Velocity]:
    """Command ``wanted`` every 0.04 s; return what was sent."""
    sent = []
    for beat in range(round(seconds / DT_S)):
        sent.append(relay.command(wanted) if beat % 2 == 0 else None)
        sent.append(relay.step(DT_S, linked=is_linked))
    return [velocity for velocity in sent if velocity is not None]


def coast(relay: CommandLimiter, seconds: float) -> list[Velocity | None]:
    return [relay.step(DT_S, linked=True) for _ in range(round(seconds / DT_S))]


def test_it_speeds_up_as_fast_as_the_robot_can_and_stops_at_once() -> None:
    relay = linked()
    sent = drive(relay, AHEAD, 1.0)
    assert max(after.linear_mps - before.linear_mps for before, after in pairwise(sent)) <= 0.5 * DT_S + 1e-9
    assert sent[-1] == AHEAD
    assert relay.command(ZERO) == ZERO


def test_to_go_back_it_stands_first() -> None:
    relay = linked()
    drive(relay, AHEAD, 1.0)
    assert relay.command(Velocity(-0.3, 0.0)) == ZERO
    assert relay.step(DT_S, linked=True) == Velocity(-0.5 * DT_S, 0.0)


def test_a_command_is_repeated_as_long_as_it_is_fresh_and_then_come_a_few_zeros() -> None:
    relay = linked()
    drive(relay, AHEAD, 1.0)
    assert [velocity for velocity in coast(relay, 0.3) if velocity] == [AHEAD] * 5
    after = [velocity for velocity in coast(relay, 5.0) if velocity]
    assert after.count(AHEAD) <= 2
    assert after[-10:] == [ZERO] * 10
    assert coast(relay, 5.0) == [None] * 250


def test_after_the_link_was_cut_it_waits_for_a_zero() -> None:
    relay = linked()
    drive(relay, AHEAD, 1.0)
    assert set(drive(relay, AHEAD, 0.2, is_linked=False)[1:]) == {ZERO}
    relay.step(DT_S, linked=True)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}
    waits = relay.waits
    assert waits
    drive(relay, ZERO, 0.1)
    assert not relay.waits
    assert drive(relay, AHEAD, 1.0)[-1] == AHEAD


def test_a_zero_that_the_robot_could_not_hear_does_not_count() -> None:
    relay = CommandLimiter(CONFIG)
    drive(relay, ZERO, 1.0, is_linked=False)
    relay.step(DT_S, linked=True)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}


@given(events=EVENTS)
def test_whatever_comes_what_is_sent_is_within_the_limits(
    events: list[tuple[tuple[float, float] | None, float, bool]],
) -> None:
    relay = linked()
    for wanted, dt_s, is_linked in events:
        before = relay.velocity
        for sent in (relay.command(Velocity(*wanted)) if wanted else None, relay.step(dt_s, linked=is_linked)):
            now = sent or relay.velocity
            assert math.isfinite(now.linear_mps)
            assert math.isfinite(now.angular_radps)
            assert abs(now.linear_mps) <= min(1.0, abs(before.linear_mps) + 0.5 * dt_s + 1e-9)
            assert abs(now.angular_radps) <= min(2.0, abs(before.angular_radps) + 4.0 * dt_s + 1e-9)
        if not is_linked:
            assert relay.velocity == ZERO


def test_not_a_number_is_a_zero() -> None:
    relay = linked()
    drive(relay, AHEAD, 1.0)
    assert relay.command(Velocity(math.nan, 0.0)) == ZERO


def away_and_back() -> CommandLimiter:
    relay = linked()
    drive(relay, AHEAD, 1.0)
    drive(relay, AHEAD, 0.2, is_linked=False)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}
    return relay


@pytest.mark.parametrize("wrong", [Velocity(math.nan, 0.0), Velocity(0.0, math.inf)])
def test_not_a_number_releases_no_robot_that_was_away(wrong: Velocity) -> None:
    relay = away_and_back()
    relay.command(wrong)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}


def test_to_stand_without_a_command_releases_no_robot_that_was_away() -> None:
    relay = away_and_back()
    relay.stand()
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}
    relay.command(ZERO)
    assert drive(relay, AHEAD, 1.0)[-1] == AHEAD
    assert relay.stand() == ZERO


def test_a_zero_before_the_link_does_not_count() -> None:
    """The guard: ``_linked`` in ``command``."""
    relay = CommandLimiter(CONFIG)
    relay.command(ZERO)
    relay.step(DT_S, linked=True)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}


def test_a_robot_that_is_linked_from_the_start_waits_for_a_zero() -> None:
    """The guard: ``holds`` at the start."""
    relay = CommandLimiter(CONFIG)
    relay.step(DT_S, linked=True)
    assert set(drive(relay, AHEAD, 1.0)) == {ZERO}


def test_speeds_are_clamped() -> None:
    """The guard: ``highest`` in ``_approach``."""
    assert drive(linked(), Velocity(9.0, -9.0), 4.0)[-1] == Velocity(1.0, -2.0)
