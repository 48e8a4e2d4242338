import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.landmarks.protocol import Hand
from handsteer.signs.rules import RuleClassifier
from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT
from tests.signs.hands import SIZE, make_hand

FINGERS = ("index", "middle", "ring", "little")
TILTS = [math.radians(degrees) for degrees in (-30, -15, 0, 15, 30)]


def sign(hand: Hand) -> str:
    return RuleClassifier().classify(hand).sign


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("mirrored", [False, True])
def test_signs_of_either_hand_tilted(tilt: float, mirrored: bool) -> None:
    assert sign(make_hand(straight=FINGERS, thumb_out=True, turn=tilt, mirrored=mirrored)) == STOP
    assert sign(make_hand(straight=("index",), turn=tilt, mirrored=mirrored)) == FORWARD
    assert sign(make_hand(straight=("index",), turn=tilt + math.pi, mirrored=mirrored)) == BACKWARD
    assert sign(make_hand(turn=tilt, mirrored=mirrored)) == GO


@pytest.mark.parametrize("tilt", TILTS)
def test_the_thumb_turns_to_where_it_points_for_the_user(tilt: float) -> None:
    # The thumb points to the image's left, which is the user's right, as the frame is not mirrored.
    assert sign(make_hand(thumb_out=True, turn=tilt)) == TURN_RIGHT
    assert sign(make_hand(thumb_out=True, turn=tilt, mirrored=True)) == TURN_LEFT


@pytest.mark.parametrize(
    "hand",
    [
        make_hand(straight=FINGERS),
        make_hand(straight=("index", "middle")),
        make_hand(straight=("index", "little")),
        make_hand(straight=("index",), turn=math.pi / 2),
        make_hand(straight=("index",), thumb_out=True),
        make_hand(straight=("little",), thumb_out=True),
        make_hand(thumb_out=True, turn=-math.pi / 2),
        make_hand(thumb_out=True, turn=math.pi / 2),
    ],
    ids=["four", "peace", "horns", "index sideways", "L", "call", "thumb up", "thumb down"],
)
def test_other_hands_are_none(hand: Hand) -> None:
    assert sign(hand) == NONE


@given(st.lists(st.floats(-10, 10, width=32), min_size=126, max_size=126))
def test_any_landmarks_give_a_sign_and_a_confidence(values: list[float]) -> None:
    numbers = np.array(values, np.float32).reshape(2, 21, 3)
    guess = RuleClassifier().classify(Hand(numbers[0], numbers[1], "Left", 0.5, 0.5, SIZE))
    assert 0.0 <= guess.confidence <= 1.0
