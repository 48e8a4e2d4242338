from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.nodes.frame_age import FrameAge

LIMIT_S = 0.35
TINY_S = 1e-6
PERIOD_S = 1 / 30
LEAK_S = 60 * PERIOD_S * 0.001


def in_order(delays_s: list[float]) -> list[float]:
    """Return delays of frames that come every 33 ms in the order in which they were sent."""
    return list(accumulate(delays_s, lambda last, delay_s: min(delay_s, last + PERIOD_S)))


DELAYS_S = st.lists(st.floats(0.0, 2.0), min_size=1, max_size=60).map(in_order)


def ages(delays_s: list[float], ahead_s: float) -> list[tuple[float, str | None]]:
    """Let a frame come every 33 ms with the given delays, stamped by a clock that is ahead of ours."""
    age = FrameAge(LIMIT_S)
    told = []
    for number, delay_s in enumerate(delays_s):
        now_s = 1000.0 + number * PERIOD_S
        why = age.why_refused(now_s, now_s - delay_s + ahead_s)
        told.append((age.age_s, why))
    return told


@given(DELAYS_S, st.floats(0.0, LIMIT_S - 0.01))
def test_a_frame_is_never_taken_to_be_older_than_it_is(delays_s: list[float], ahead_s: float) -> None:
    for delay_s, (age_s, why) in zip(delays_s, ages(delays_s, ahead_s), strict=True):
        assert age_s <= delay_s + TINY_S
        assert why is None or delay_s > LIMIT_S - TINY_S


@given(DELAYS_S, st.floats(0.0, LIMIT_S - 0.01))
def test_a_frame_that_is_used_is_too_old_by_no_more_than_the_shortest_delay(
    delays_s: list[float], ahead_s: float
) -> None:
    shortest_s = float("inf")
    for delay_s, (_, why) in zip(delays_s, ages(delays_s, ahead_s), strict=True):
        shortest_s = min(shortest_s, delay_s)
        assert why is not None or delay_s <= LIMIT_S + shortest_s + LEAK_S + TINY_S


@given(DELAYS_S, st.floats(0.0, 10.0))
def test_of_a_clock_that_is_behind_too_few_frames_are_used_never_too_many(
    delays_s: list[float], behind_s: float
) -> None:
    for delay_s, (_, why) in zip(delays_s, ages(delays_s, -behind_s), strict=True):
        assert (why is None) == (delay_s + behind_s <= LIMIT_S) or abs(delay_s + behind_s - LIMIT_S) < TINY_S


@pytest.mark.parametrize("ahead_s", [0.4, 2.0, 3600.0])
def test_a_clock_that_is_far_ahead_is_refused_in_words(ahead_s: float) -> None:
    ((_, why),) = ages([0.0], ahead_s)
    assert why == f"frames are stamped {ahead_s:.1f} s ahead of our clock: are the clocks of the machines in step?"


def test_an_old_frame_is_told_though_its_clock_is_ahead() -> None:
    (_, (_, why)) = ages([0.02, 0.42], 0.3)
    assert why is not None
    assert why.startswith("frames come 0.4 s after their stamp by a clock that is 0.3 s ahead of ours")


def test_a_clock_that_is_set_right_is_trusted_again() -> None:
    age = FrameAge(LIMIT_S)
    assert age.why_refused(0.0, 0.34) is None
    assert age.why_refused(1.0, 0.95) is not None
    for number in range(6000):
        now_s = 1.0 + number * PERIOD_S
        why = age.why_refused(now_s, now_s - 0.05)
    assert why is None
    assert age.ahead_s < 0.25


@pytest.mark.parametrize("set_by_s", [5.0, -5.0, 3600.0])
def test_a_clock_that_is_set_while_frames_come_is_followed_after_a_second(set_by_s: float) -> None:
    age = FrameAge(LIMIT_S)
    told = []
    for number in range(300):
        now_s = 1000.0 + number * PERIOD_S
        captured_s = now_s - 0.03 - 0.01 * (number % 3)
        told.append(age.why_refused(now_s, captured_s - (set_by_s if number >= 90 else 0.0)))
    assert set(told[:90]) == {None}
    way = "back" if set_by_s > 0 else "ahead"
    assert told[91] is not None
    assert told[91].startswith(f"a clock was set {way} by {abs(set_by_s):.1f} s: frames are timed anew")
    assert set(told[121:]) == {None}


def test_a_queue_that_stood_still_is_no_clock_that_was_set() -> None:
    age = FrameAge(LIMIT_S)
    assert all(age.why_refused(number * PERIOD_S, number * PERIOD_S) is None for number in range(30))
    late = [age.why_refused(6.0 + number * PERIOD_S, 1.0 + number * PERIOD_S) for number in range(300)]
    assert all(why is not None and why.startswith("frames come 5.0 s after their stamp") for why in late)
