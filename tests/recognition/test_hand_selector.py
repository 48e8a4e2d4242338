from handsteer.config import SignsConfig
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.hand_selector import HandSelector
from handsteer.types import FORWARD, GO, NONE, STOP
from tests.recognition.hands import moved, show_sign

DT = 1 / 30
HAND = show_sign(STOP)
LEFT, RIGHT = moved(HAND, -180), moved(HAND, 180)
SMALL = moved(HAND, 180, scale=0.4)
CONFIG = SignsConfig(switch_time=0.5, dropout_hold=0.1)


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


def test_no_hands_no_choice_and_reset_forgets() -> None:
    operator = HandSelector(CONFIG)
    assert look(operator) is None
    look(operator, (LEFT, FORWARD), frames=10)
    operator.reset()
    assert look(operator, (LEFT, NONE), (SMALL, STOP)) is SMALL
