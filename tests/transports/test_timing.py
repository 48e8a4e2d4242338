from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import to_stamp
from handsteer.transports.timing import Repeats, StaleMessageFilter

APART = st.floats(-1e9, 1e9)


@given(APART, st.lists(st.floats(0.0, 0.3), min_size=2, max_size=50))
def test_clocks_may_be_apart_by_anything(apart_s: float, delays: list[float]) -> None:
    lateness = StaleMessageFilter(0.35)
    for step, delay_s in enumerate(delays):
        sent_s = step * 0.03
        assert not lateness.is_late(b"a", sent_s + apart_s, sent_s + delay_s)


@given(APART, st.floats(0.01, 0.1), st.floats(0.6, 100.0))
def test_what_waited_is_late_and_what_comes_after_it_is_not(apart_s: float, delay_s: float, held_s: float) -> None:
    lateness = StaleMessageFilter(0.35)
    assert not lateness.is_late(b"a", apart_s, delay_s)
    assert lateness.is_late(b"a", apart_s + 1.0, 1.0 + delay_s + held_s)
    later_s = 1.0 + held_s
    assert not lateness.is_late(b"a", apart_s + later_s, later_s + delay_s)


def test_each_sender_has_a_clock_of_its_own() -> None:
    lateness = StaleMessageFilter(0.35)
    assert not lateness.is_late(b"a", 100.0, 0.0)
    assert not lateness.is_late(b"b", 0.0, 0.1)
    assert not lateness.is_late(b"a", 100.2, 0.2)
    assert lateness.is_late(b"b", 0.1, 1.0)


def test_a_clock_that_is_set_back_is_trusted_again_after_a_while() -> None:
    lateness = StaleMessageFilter(0.35)
    assert not lateness.is_late(b"a", 0.0, 0.0)
    late = [lateness.is_late(b"a", now - 1.0, now) for now in range(1, 120)]
    assert all(late[:30])
    assert not any(late[90:])


def test_a_clock_that_is_set_back_by_seconds_while_messages_come_is_followed_after_a_second() -> None:
    lateness = StaleMessageFilter(0.35)
    late = []
    for number in range(300):
        now = number / 30
        late.append(lateness.is_late(b"a", now - (5.0 if number >= 90 else 0.0), now + 0.02 * (number % 3)))
    assert not any(late[:90])
    assert all(late[90:119])
    assert not any(late[122:])


def test_a_queue_that_stands_is_no_clock_that_was_set() -> None:
    lateness = StaleMessageFilter(0.35)
    assert not any(lateness.is_late(b"a", number / 30, number / 30) for number in range(30))
    held = [lateness.is_late(b"a", 1.0 + number / 30, 6.0 + number / 300) for number in range(100)]
    assert all(held), "what waited for five seconds, and comes ten times as fast as it was sent"


def test_it_does_not_grow() -> None:
    lateness = StaleMessageFilter(0.35)
    for number in range(1000):
        lateness.is_late(number.to_bytes(2, "big"), 0.0, 0.0)
    assert len(lateness._least) <= 32


def repeats(*messages: tuple[float, float]) -> list[bool]:
    """Return whether each message, given as its stamp and its arrival, says nothing of now."""
    watch = Repeats()
    return [watch.has(to_stamp(stamp_s), now_s) for stamp_s, now_s in messages]


def test_a_message_again_says_nothing_of_now_and_one_without_a_stamp_may() -> None:
    assert repeats((5.0, 0.0), (5.05, 0.05), (5.05, 0.1), (5.05, 0.15), (5.2, 0.2)) == [False, False, True, True, False]
    assert repeats((0.0, 0.0), (0.0, 0.05)) == [False, False]


def test_stamps_that_crawl_say_nothing_of_now() -> None:
    assert repeats(*((5.0 + 0.001 * count, 0.05 * count) for count in range(5))) == [False, True, True, True, True]
    assert not any(repeats(*((5.0 + 0.015 * count, 0.05 * count) for count in range(5))))


def test_a_clock_that_is_set_back_or_that_was_paused_is_followed_from_its_second_message() -> None:
    assert repeats((5.0, 0.0), (1.0, 0.05), (1.05, 0.1)) == [False, False, False]
    assert repeats((5.0, 0.0), (5.02, 60.0), (5.04, 60.02)) == [False, True, False]
