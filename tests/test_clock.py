import time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from handsteer.clock import RealClock, SimulatedClock, SteppedClock, WallClock, to_seconds, to_stamp
from handsteer.messages import Time
from handsteer.transports.encoding import decode, encode


def test_stamps_of_the_real_clock_are_unix_time() -> None:
    clock = RealClock()
    assert to_seconds(clock.stamp(clock.now())) == pytest.approx(time.time(), abs=1.0)


def test_a_stepped_clock_moves_forward_only() -> None:
    clock = SteppedClock(2.0)
    clock.advance(0.5)
    clock.advance_to(1.0)
    assert clock.now() == 2.5
    assert to_seconds(clock.stamp(2.5)) == 2.5


@given(st.floats(0, 2**31 - 1))
def test_stamps_keep_nanoseconds_within_a_second(seconds: float) -> None:
    stamp = to_stamp(seconds)
    assert 0 <= stamp.nanosec < 1_000_000_000
    assert to_seconds(stamp) == pytest.approx(seconds, abs=1e-6)


@pytest.mark.parametrize(
    ("seconds", "stamp"),
    [
        (2.0**31 - 1, Time(2**31 - 1, 0)),
        (2.0**31, Time(2**31 - 1, 999_999_999)),
        (2.0**31 + 5, Time(2**31 - 1, 999_999_999)),
        (1e12, Time(2**31 - 1, 999_999_999)),
        (-5.5, Time(-6, 500_000_000)),
        (-1e12, Time(-(2**31), 0)),
    ],
)
def test_each_time_has_a_stamp_that_can_be_sent(seconds: float, stamp: Time) -> None:
    assert to_stamp(seconds) == stamp
    assert decode(encode(stamp), "builtin_interfaces/msg/Time") == stamp


class Simulator:
    """A simulator whose time is told to a clock, in real time that a test moves."""

    def __init__(self) -> None:
        self.real_s = 100.0
        self.clock = SimulatedClock(lambda: self.real_s)

    def run(self, seconds: float, *, from_s: float, tick_s: float = 0.02) -> float:
        """Tell the clock the time from ``from_s`` on, as fast as real time; return the time told last."""
        for tick in range(1, round(seconds / tick_s) + 1):
            self.real_s += tick_s
            self.clock.tell(from_s + tick * tick_s)
        return from_s + seconds


def test_simulated_time_is_followed() -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    assert simulator.clock.now() == pytest.approx(51.0)
    simulator.real_s += 0.1
    assert simulator.clock.now() == pytest.approx(51.0)
    assert simulator.clock.stamp(50.5) == to_stamp(50.5)
    assert simulator.clock.time_of(to_stamp(50.5)) == pytest.approx(50.5)


@pytest.mark.parametrize("last_s", [2.0**31 - 1, to_seconds(Time(2**31 - 1, 999_999_999))])
def test_the_last_time_that_a_stamp_holds_has_one_and_those_after_it(last_s: float) -> None:
    simulator = Simulator()
    simulator.clock.tell(last_s)
    for _ in range(3):
        simulator.real_s += 1.0
        encode(simulator.clock.stamp(simulator.clock.now()))
    assert simulator.clock.stamp(simulator.clock.now()).sec == 2**31 - 1
    simulator.clock.tell(5.0)
    assert simulator.clock.stamp(simulator.clock.now()) == to_stamp(5.0)


def test_when_simulated_time_stands_seconds_pass_and_frames_grow_old() -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    simulator.real_s += 2.0
    clock = simulator.clock
    assert clock.now() == pytest.approx(53.0)
    frame = clock.stamp(clock.now())
    assert frame == to_stamp(51.0)
    simulator.real_s += 1.0
    clock.tell(51.0)  # it is paused, and says so
    assert clock.now() - clock.time_of(frame) > 2.5
    assert clock.silence_s == pytest.approx(3.0)


def test_when_simulated_time_goes_on_the_clock_goes_on_from_where_it_is() -> None:
    simulator = Simulator()
    end_s = simulator.run(1.0, from_s=50.0)
    old = simulator.clock.stamp(simulator.clock.now())
    simulator.real_s += 10.0
    before_s = simulator.clock.now()
    simulator.run(1.0, from_s=end_s)
    clock = simulator.clock
    assert clock.now() == pytest.approx(before_s + 1.0, abs=0.03)
    fresh = clock.stamp(clock.now())
    assert fresh == to_stamp(52.0)
    assert clock.time_of(fresh) == pytest.approx(clock.now())
    assert clock.now() - clock.time_of(old) > 10.0


def test_when_a_simulator_starts_again_what_was_before_has_expired() -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    before_s = simulator.clock.now()
    simulator.clock.tell(0.0)
    assert simulator.clock.now() == pytest.approx(before_s + 1.0)
    simulator.run(1.0, from_s=0.0)
    assert simulator.clock.now() == pytest.approx(before_s + 2.0, abs=0.03)
    assert simulator.clock.stamp(simulator.clock.now()) == to_stamp(1.0)


def test_ticks_that_overtake_each_other_are_no_restart() -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    before_s = simulator.clock.now()
    simulator.clock.tell(50.5)
    assert simulator.clock.now() == before_s


@pytest.mark.parametrize("rate", [-0.05, -0.2, -1.0, -3.0])
def test_of_a_clock_that_runs_backwards_seconds_pass_and_it_is_paused(rate: float) -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    before_s, told_s, paused = simulator.clock.now(), 51.0, []
    for _ in range(200):
        simulator.real_s += 0.02
        told_s += 0.02 * rate
        simulator.clock.tell(told_s)
        paused.append(simulator.clock.is_paused)
    assert simulator.clock.now() - before_s >= 3.5
    # At three times the pace it restarts more often than it would count as paused: each time, all has expired.
    assert sum(paused) > 100 or rate == -3.0


def test_of_a_clock_that_stands_all_seconds_count() -> None:
    simulator = Simulator()
    simulator.run(1.0, from_s=50.0)
    simulator.real_s += 0.45
    assert simulator.clock.now() == pytest.approx(51.45)


@given(st.lists(st.tuples(st.floats(0, 5), st.floats(0, 1000)), max_size=30))
@example([(0.0, 0.0), (0.0, 257.04896645397844), (3.3217996810259613, 0.0327), (0.0, 762.8332333345002)])
def test_simulated_time_never_goes_back(steps: list[tuple[float, float]]) -> None:
    simulator, newest_s = Simulator(), 0.0
    last_s = simulator.clock.now()
    for real_s, told_s in steps:
        simulator.real_s += real_s
        for _ in range(2):
            assert simulator.clock.now() >= last_s
            last_s = simulator.clock.now()
            simulator.clock.tell(told_s)
        if not 0 <= newest_s - told_s <= 1:
            newest_s = told_s
        assert simulator.clock.stamp(simulator.clock.now()) == to_stamp(newest_s)


def test_stamps_of_a_shared_clock_follow_the_wall_clock() -> None:
    clock = WallClock()
    stamp = clock.stamp(clock.now())
    assert to_seconds(stamp) == pytest.approx(time.time(), abs=0.05)
    assert clock.time_of(stamp) == pytest.approx(clock.now(), abs=0.05)
