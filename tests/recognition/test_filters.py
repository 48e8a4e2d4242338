from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import SignsConfig
from handsteer.recognition.filters import Debouncer, Evidence, HandPosition, HandSelector
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT
from tests.recognition.hands import moved, show_sign

HAND = show_sign(STOP)
LEFT, RIGHT = moved(HAND, -180), moved(HAND, 180)
SMALL = moved(HAND, 180, scale=0.4)
CONFIG = SignsConfig(switch_time=0.5, dropout_hold=0.1)
DT = 1 / 30


def look(operator: HandSelector, *seen: tuple[Hand, str], frames: int = 1) -> Hand | None:
    """Show hands with their signs for some frames, as the recogniser would; return the hand that is chosen last."""
    hands, guesses = [hand for hand, _ in seen], [SignGuess(sign, 0.9 if sign != NONE else 0.0) for _, sign in seen]
    chosen = None
    for _ in range(frames):
        chosen = operator.choose(hands, guesses, DT)
        if chosen is not None and guesses[chosen].sign != NONE:
            operator.confirm()
    return hands[chosen] if chosen is not None else None


def test_the_hand_that_shows_a_sign_is_chosen_not_the_resting_one() -> None:
    assert look(HandSelector(CONFIG), (LEFT, NONE), (RIGHT, FORWARD)) is RIGHT
    assert look(HandSelector(CONFIG), (LEFT, FORWARD), (RIGHT, NONE)) is LEFT


def test_of_two_that_show_signs_the_larger_is_chosen() -> None:
    assert look(HandSelector(CONFIG), (SMALL, FORWARD), (LEFT, GO)) is LEFT


def test_a_fist_leaves_another_sign_of_a_hand_of_its_size_alone() -> None:
    # The other hand holds something: a fist, and more surely one than the pointing hand points.
    fist, pointing = SignGuess(GO, 0.99), SignGuess(BACKWARD, 0.82)
    for hands, guesses in (((LEFT, RIGHT), (fist, pointing)), ((RIGHT, LEFT), (pointing, fist))):
        assert HandSelector(CONFIG).choose(hands, guesses, 0.1) == guesses.index(pointing)


def test_without_a_sign_the_largest_hand_is_shown_but_not_kept() -> None:
    operator = HandSelector(CONFIG)
    assert look(operator, (SMALL, NONE), (LEFT, NONE), frames=10) is LEFT
    assert look(operator, (SMALL, FORWARD), (LEFT, NONE)) is SMALL


def test_a_sign_of_a_bystander_does_not_take_over() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=10)
    assert look(operator, (LEFT, FORWARD), (RIGHT, STOP), frames=60) is LEFT
    assert look(operator, (RIGHT, STOP), (LEFT, FORWARD)) is LEFT


def test_another_hand_takes_over_when_the_followed_one_has_rested() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=10)
    assert look(operator, (LEFT, NONE), (RIGHT, STOP), frames=14) is LEFT
    assert look(operator, (LEFT, NONE), (RIGHT, STOP), frames=3) is RIGHT


def test_a_much_smaller_hand_does_not_take_over_while_the_followed_one_is_in_view() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=10)
    assert look(operator, (LEFT, NONE), (SMALL, STOP), frames=60) is LEFT
    assert look(operator, (SMALL, STOP), frames=5) is SMALL


def test_for_a_short_loss_nobody_takes_over() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=10)
    assert look(operator, (RIGHT, GO), frames=2) is None
    assert look(operator, (LEFT, FORWARD), (RIGHT, GO)) is LEFT
    assert look(operator, (RIGHT, GO), frames=5) is RIGHT


def test_stop_counts_from_any_hand_while_the_followed_one_is_lost() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=10)
    assert look(operator, (LEFT, FORWARD), (RIGHT, STOP)) is LEFT
    assert look(operator, (RIGHT, STOP)) is RIGHT


def test_a_moving_hand_is_followed() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=5)
    for step in range(12):
        assert look(operator, (RIGHT, FORWARD), (hand := moved(HAND, -180 + 25 * step), FORWARD)) is hand


def test_further_hands_are_looked_for_only_while_no_sign_is_given() -> None:
    operator = HandSelector(CONFIG)
    look(operator, (LEFT, FORWARD), frames=5)
    assert not operator.wants_search()
    look(operator, (LEFT, NONE))
    assert operator.wants_search()


def test_no_hands_no_choice_and_a_reset_selector_forgets() -> None:
    operator = HandSelector(CONFIG)
    assert look(operator) is None
    look(operator, (LEFT, FORWARD), frames=10)
    operator.reset()
    assert look(operator, (LEFT, NONE), (SMALL, STOP)) is SMALL


def seen(*x: float, likelihood: float = 0.9) -> Evidence:
    evidence = Evidence()
    for each in x:
        evidence.add(HandPosition(each, 200.0, 100.0), {"Forward": likelihood}, DT)
    return evidence


def test_a_trembling_hand_is_still_and_one_that_passes_by_is_not() -> None:
    assert seen(300, 303, 298, 301, 304).is_still(0.1)
    assert not seen(300, 315, 330, 345, 360).is_still(0.1)


def test_only_the_last_moments_matter() -> None:
    assert seen(100, 200, 300, 300, 300, 300, 300).is_still(0.1)
    assert not seen(100, 200, 300, 300, 300, 300, 300).is_still(0.2)


def test_a_hand_that_has_just_come_is_judged_by_what_there_is() -> None:
    assert seen(300).is_still(0.1)
    assert not Evidence().is_still(0.1)


def test_the_likelihood_is_the_mean_of_the_last_moments() -> None:
    evidence = seen(300, 300, likelihood=0.2)
    for _ in range(3):
        evidence.add(HandPosition(300.0, 200.0, 100.0), {"Forward": 0.8}, DT)
    assert evidence.likelihood("Forward", 2 * DT) == pytest.approx(0.8)
    assert evidence.likelihood("Forward", 1.0) == pytest.approx(0.56)
    assert evidence.likelihood("Go", 1.0) == 0.0


def test_a_hand_out_of_view_forgets_and_a_long_stream_does_not_grow() -> None:
    evidence = seen(*[300.0] * 1000, likelihood=0.1)
    for _ in range(12):
        evidence.add(HandPosition(300.0, 200.0, 100.0), {"Forward": 1.0}, DT)
    assert evidence.likelihood("Forward", 1e9) == pytest.approx(1.0)
    evidence.add(None, {}, DT)
    assert evidence.likelihood("Forward", 1.0) == 0.0


def show(signs: Debouncer, seen: str, frames: int) -> list[str]:
    return [signs.step(seen, DT) for _ in range(frames)]


def test_a_sign_counts_within_100_ms_at_30_frames_a_second() -> None:
    signs = Debouncer(SignsConfig())
    assert show(signs, FORWARD, 5) == [NONE, NONE, NONE, FORWARD, FORWARD]


@given(st.floats(0, 1e6), st.sampled_from([10, 30, 60]))
def test_it_takes_as_many_frames_however_stamps_are_rounded(start_s: float, fps: int) -> None:
    signs, stamps = Debouncer(SignsConfig()), [start_s + frame / fps for frame in range(10)]
    intervals = [0.0, *(after - before for before, after in pairwise(stamps))]
    assert [signs.step(FORWARD, dt_s) for dt_s in intervals].index(FORWARD) == fps // 10
    assert [signs.step(NONE, 1 / fps) for _ in range(10)].count(FORWARD) == fps // 10


def test_stop_counts_at_its_first_frame() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    assert signs.step(STOP, DT) == STOP


def test_another_sign_for_two_frames_is_swallowed() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    assert show(signs, TURN_LEFT, 2) + show(signs, FORWARD, 2) == [FORWARD] * 4


def test_a_short_loss_is_bridged_and_a_long_one_is_not() -> None:
    signs = Debouncer(SignsConfig(dropout_hold=0.1))
    show(signs, FORWARD, 10)
    assert show(signs, NONE, 5) == [FORWARD, FORWARD, FORWARD, NONE, NONE]


def test_from_one_sign_to_another_the_first_holds_until_the_second_counts() -> None:
    signs = Debouncer(SignsConfig(confirm_time=0.1, dropout_hold=0.1))
    show(signs, GO, 10)
    assert show(signs, FORWARD, 4) == [GO, GO, GO, FORWARD]


def test_progress_grows_to_confirmation() -> None:
    signs = Debouncer(SignsConfig(confirm_time=0.1))
    progress = []
    for _ in range(3):
        signs.step(FORWARD, DT)
        progress.append(round(signs.progress, 2))
    assert progress == [0.0, 0.33, 0.67]
    assert signs.candidate == FORWARD


def test_reset_forgets() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    signs.reset()
    assert signs.step(FORWARD, DT) == NONE


@given(st.lists(st.tuples(st.sampled_from([*SIGNS, NONE]), st.floats(0.001, 0.2)), max_size=300))
def test_a_sign_never_counts_that_was_not_seen_for_the_whole_confirmation(frames: list[tuple[str, float]]) -> None:
    config = SignsConfig()
    signs = Debouncer(config)
    run_s, last, before = 0.0, NONE, NONE
    for seen, dt_s in frames:
        run_s = run_s + dt_s if seen == last else 0.0
        last = seen
        counted = signs.step(seen, dt_s)
        if counted not in (before, NONE, STOP):
            assert counted == seen
            assert run_s >= config.confirm_time - 0.001  # the slack for stamps that jitter
        before = counted
