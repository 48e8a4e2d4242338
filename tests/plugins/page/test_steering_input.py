import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.page.steering_input import SLIDERS_TIMEOUT_S, SteeringInput, read_deflection, read_number
from handsteer.types import ZERO, Velocity

SLOW, FAST = Velocity(0.2, 0.1), Velocity(-0.4, 1.0)
# The page's clock has nothing in common with ours.
PAGE_MS = 1_700_000_000_000.0


def sent(now_s: float, late_s: float = 0.0) -> float:
    return PAGE_MS + 1000 * (now_s - late_s)


def test_sliders_keep_sliders_as_long_as_the_page_says_so() -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    assert manual.keep_sliders(sent(0.0), 0, 0.0) == (ZERO, SLOW), "they were released until then"
    assert [manual.keep_sliders(sent(0.1 * n), 100 * n, 0.1 * n) for n in range(1, 50)] == [(SLOW,)] * 49


def test_sliders_go_to_zero_when_the_page_falls_silent_and_stay_there() -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    manual.keep_sliders(sent(0.1), 100, 0.1)
    silent_s = 0.1 + SLIDERS_TIMEOUT_S + 0.01
    assert manual.keep_sliders(sent(silent_s), 0, silent_s) == ()
    assert manual.sliders == ZERO
    assert manual.keep_sliders(sent(silent_s + 0.1), 0, silent_s + 0.1) == ()


def test_a_page_that_never_says_that_it_is_in_front_moves_nothing() -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    manual.slide(FAST, 0.4)
    manual.end_if_silent(0.6)
    assert manual.sliders == ZERO


def test_the_newest_of_pad_and_sliders_steers() -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    assert manual.hold_pad(FAST, sent(0.1), 0.1) == FAST
    assert manual.sliders == ZERO
    assert manual.keep_sliders(sent(0.2), 0, 0.2) == ()
    manual.slide(SLOW, 0.3)
    assert manual.keep_sliders(sent(0.35), 0, 0.35) == (ZERO, SLOW)


def test_what_was_held_up_on_its_way_moves_nothing() -> None:
    manual = SteeringInput()
    assert manual.hold_pad(SLOW, sent(0.0), 0.0) == SLOW
    assert manual.hold_pad(SLOW, sent(2.0, late_s=1.0), 2.0) is None
    was_late = manual.is_late
    assert not was_late
    for n in range(9):
        manual.hold_pad(SLOW, sent(2.0 + 0.1 * n, late_s=0.9), 2.0 + 0.1 * n)
    assert manual.is_late
    assert manual.hold_pad(SLOW, sent(3.0), 3.0) == SLOW
    assert not manual.is_late


def test_late_words_do_not_keep_sliders_going() -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    manual.keep_sliders(sent(0.1), 100, 0.1)
    for n in range(2, 20):
        assert manual.keep_sliders(sent(0.1 * n, late_s=0.5), 0, 0.1 * n) == ()
    assert manual.sliders == ZERO


@pytest.mark.parametrize("touched", [501, 9000, -1, None, "now", math.nan, True, 10**400])
def test_a_slider_whose_movement_comes_late_moves_nothing(touched: object) -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 9.0)  # a network, or a page without a connection, has held it back
    assert manual.keep_sliders(sent(9.05), touched, 9.05) == ()
    assert manual.sliders == ZERO
    assert manual.keep_sliders(sent(9.15), touched, 9.15) == ()


def test_a_slider_that_moves_among_late_words_moves_nothing() -> None:
    manual = SteeringInput()
    manual.keep_sliders(sent(0.0), 0, 0.0)
    manual.slide(SLOW, 9.0)
    assert manual.keep_sliders(sent(9.05, late_s=8.0), 0, 9.05) == ()
    assert manual.keep_sliders(sent(9.1), 0, 9.1) == ()


@pytest.mark.parametrize("when", [None, "soon", True, math.nan, math.inf, [], {}])
def test_without_a_time_nothing_moves(when: object) -> None:
    manual = SteeringInput()
    manual.slide(SLOW, 0.0)
    assert manual.keep_sliders(when, 0, 0.1) == ()
    assert manual.hold_pad(FAST, when, 0.1) is None


@given(
    st.lists(
        st.tuples(st.sampled_from(["pad", "slide", "keep on", "let go"]), st.floats(0, 1), st.floats(0, 3)),
        max_size=60,
    )
)
def test_sliders_never_outlast_the_pages_word(events: list[tuple[str, float, float]]) -> None:
    manual = SteeringInput()
    now_s = heard_s = 0.0
    for kind, pause_s, late_s in events:
        now_s += pause_s
        if kind == "pad":
            manual.hold_pad(FAST, sent(now_s, late_s), now_s)
        elif kind == "slide":
            heard_s = now_s if manual.sliders.is_zero else heard_s
            manual.slide(SLOW, now_s)
        elif kind == "let go":
            manual.sliders = ZERO
        else:
            before_s = heard_s
            heard_s = now_s
            if manual.keep_sliders(sent(now_s, late_s), 0, now_s):
                assert now_s - before_s <= SLIDERS_TIMEOUT_S + 1e-9


def test_a_number_of_a_page_is_clamped() -> None:
    """The guard: the limits in ``read_number`` and ``read_deflection``."""
    assert [read_number(sent, -1.0, 2.0, 0.5) for sent in (9.0, -9, 10**400, float("nan"), True, "1")] == [
        *(2.0, -1.0, 2.0, 0.5, 0.5, 0.5)
    ]
    assert read_deflection({"x": 1.5, "y": -0.5}) == (0.0, -0.5)
