from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.ros2.stop_order import StopOrder

APART = st.floats(-1e9, 1e9)


@given(APART, APART, st.floats(0.0, 0.1), st.floats(0.0, 20.0), st.floats(0.3, 20.0))
def test_a_reset_ends_no_stop_that_was_sent_after_it(
    one_s: float, other_s: float, delay_s: float, held_s: float, later_s: float
) -> None:
    """Whatever the clocks of both: the reset is sent at 1.0, the other's Stop ``later_s`` after it."""
    order = StopOrder()
    stopped_s = 1.0 + later_s
    assert not order.is_overtaken(b"one", one_s, delay_s, stops=True)
    assert not order.is_overtaken(b"other", other_s + stopped_s, stopped_s, stops=True)
    arrived_s = stopped_s + held_s
    assert order.is_overtaken(b"one", one_s + 1.0, arrived_s, stops=False)
    assert not order.is_overtaken(b"one", one_s + arrived_s + 0.2, arrived_s + 0.2 + delay_s, stops=False)


@given(APART, st.lists(st.tuples(st.booleans(), st.floats(0.0, 2.0)), max_size=20))
def test_the_order_of_one_sender_is_its_own(apart_s: float, messages: list[tuple[bool, float]]) -> None:
    order, arrived_s = StopOrder(), 0.0
    for number, (stops, delay_s) in enumerate(messages):
        arrived_s = max(arrived_s, number * 0.05 + delay_s)
        assert not order.is_overtaken(b"a", apart_s + number * 0.05, arrived_s, stops=stops)


def test_a_slow_reset_counts_if_no_stop_came_after_it() -> None:
    order = StopOrder()
    assert not order.is_overtaken(b"a", 0.0, 0.0, stops=True)
    assert not order.is_overtaken(b"b", 0.0, 0.0, stops=False)
    assert not order.is_overtaken(b"b", 1.0, 6.0, stops=False)
