from dataclasses import replace

import numpy as np
import pytest

from handsteer.errors import ProfileError
from handsteer.plugins.teach.calibration import Calibration, calibrate, shown_hand
from handsteer.recognition.profile import MOST_VIEWS, REACH, ProfiledClassifier
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import BACKWARD, FORWARD, GO, SIGNS, STOP, TURN_LEFT
from tests.recognition.hands import moved, show_fingers, show_sign
from tests.recognition.odd_person import errors, odd_hands

SHIPPED = ShippedClassifier(load_model())


@pytest.fixture(scope="module")
def odd() -> Calibration:
    return calibrate("odd", odd_hands(5, seed=0), SHIPPED)


@pytest.mark.slow
def test_five_views_of_each_sign_halve_the_errors_of_an_odd_hand(odd: Calibration) -> None:
    own = ProfiledClassifier(SHIPPED, odd.profile)
    judged = odd_hands(25, seed=1)
    before = sum(errors(SHIPPED, hands, sign) for sign, hands in judged.items())
    after = sum(errors(own, hands, sign) for sign, hands in judged.items())
    assert before > 25
    assert after <= before / 2
    for sign, hands in judged.items():
        assert errors(own, hands, sign) <= errors(SHIPPED, hands, sign)


@pytest.mark.slow
def test_the_result_says_what_is_read(odd: Calibration) -> None:
    results = {each.sign: each for each in odd.results}
    assert tuple(results) == SIGNS
    stop = results[STOP]
    assert stop.before.count < 3
    assert stop.read_as == "NONE"
    assert stop.after is not None
    assert stop.after.count > stop.before.count
    assert (results[FORWARD].before.count, results[FORWARD].read_as, results[FORWARD].why_not) == (5, "", "")
    assert odd.profile.made["signs"][STOP]["before"] == {"count": results[STOP].before.count, "of": 5}


@pytest.mark.slow
def test_the_same_hands_give_the_same_profile(odd: Calibration) -> None:
    again = calibrate("odd", odd_hands(5, seed=0), SHIPPED).profile
    assert again.reach == odd.profile.reach
    assert all((again.views[sign] == views).all() for sign, views in odd.profile.views.items())


@pytest.mark.slow
def test_signs_that_cannot_be_adapted_are_left_out_with_the_reason() -> None:
    shown = odd_hands(8, seed=0)
    fingers = show_fingers("index", "middle")
    made = calibrate(
        "odd",
        {
            STOP: shown[STOP],
            GO: shown[GO][:3],
            FORWARD: shown[GO],
            BACKWARD: shown[FORWARD],
            TURN_LEFT: [moved(fingers, 5.0 * number) for number in range(8)],
        },
        SHIPPED,
    )
    why = {each.sign: each.why_not for each in made.results}
    assert why[STOP] == ""
    assert why[GO] == "only 3 hands were seen, and 4 are needed: come nearer, in more light"
    assert why[FORWARD].startswith("it is read as Go: point up with your index finger")
    assert why[BACKWARD].startswith("it is read as Forward: point down")
    assert why[TURN_LEFT].endswith("stretch your thumb to your left, level, the fingers closed")
    assert set(made.profile.views) == {STOP}


@pytest.mark.slow
def test_many_frames_give_few_views_within_their_bounds() -> None:
    made = calibrate("odd", {STOP: odd_hands(400, seed=0)[STOP]}, SHIPPED)
    assert len(made.profile.views[STOP]) == MOST_VIEWS
    assert REACH[0] <= made.profile.reach[STOP] <= REACH[1]
    assert made.results[0].before.of == 300


@pytest.mark.slow
def test_broken_landmarks_and_nothing_at_all_are_refused() -> None:
    hands = odd_hands(5, seed=0)[STOP]
    broken = [replace(hand, world=hand.world * np.nan) for hand in hands]
    for shown in ({}, {STOP: broken}, {STOP: [show_fingers("index", roll=np.pi / 2)] * 5}):
        with pytest.raises(ProfileError, match="Stop: "):
            calibrate("odd", shown, SHIPPED)
    with pytest.raises(ProfileError, match="not a valid name"):
        calibrate("../odd", {STOP: hands}, SHIPPED)


def test_the_hand_that_shows_the_sign_is_chosen_of_several() -> None:
    near, far = show_sign(GO, away_m=0.4), show_sign(FORWARD, away_m=1.0)
    assert shown_hand([near, far], FORWARD, SHIPPED) is far
    assert shown_hand([far, near], GO, SHIPPED) is near
    assert shown_hand([far, near], TURN_LEFT, SHIPPED) is near
    assert shown_hand([], GO, SHIPPED) is None
