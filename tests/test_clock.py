import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import RealClock, SteppedClock, to_seconds, to_stamp


def test_stamps_of_the_real_clock_are_unix_time() -> None:
    clock = RealClock()
    assert to_seconds(clock.stamp(clock.now())) == pytest.approx(time.time(), abs=1.0)


def test_a_stepped_clock_moves_forward_only() -> None:
    clock = SteppedClock(2.0)
    clock.advance(0.5)
    clock.advance_to(1.0)
    assert clock.now() == 2.5
    assert to_seconds(clock.stamp(2.5)) == 2.5


@given(st.floats(0, 4e9))
def test_stamps_keep_nanoseconds_within_a_second(seconds: float) -> None:
    stamp = to_stamp(seconds)
    assert 0 <= stamp.nanosec < 1_000_000_000
    assert to_seconds(stamp) == pytest.approx(seconds, abs=1e-6)
