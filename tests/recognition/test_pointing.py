"""Where a hand points, on hands with known shapes, tilts and heights."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import JoystickConfig
from handsteer.recognition.hand import Hand
from handsteer.recognition.pointing import SLOWEST, Pointing, height_deflection, tilt_deflection
from handsteer.recognition.recognizer import Recognition
from handsteer.types import BACKWARD, FORWARD, GO, NONE, RELEASED, STOP, TURN_LEFT, TURN_RIGHT, Handedness, Stick
from tests.recognition.hands import show_sign

DT_S = 1 / 30
CONFIG = JoystickConfig()


def hand(sign: str, tilt_deg: float = 0.0, y: float = 0.4, handedness: Handedness = "Right") -> Hand:
    """Return a hand with its palm at the height ``y``, tilted clockwise as the camera sees it."""
    shown = show_sign(sign, handedness, tilt=math.radians(tilt_deg))
    palm_y = float(shown.points[[0, 5, 9, 13, 17], 1].mean())
    return replace(shown, points=shown.points + np.array([0.0, y - palm_y, 0.0], np.float32))


def seen(sign: str, hand: Hand | None, shows: str | None = None) -> Recognition:
    return Recognition(sign, shows or sign, 1.0, 1.0, hand, {})


def held(pointing: Pointing, sign: str, hand: Hand | None, frames: int = 20) -> Stick:
    for _ in range(frames):
        pointing.step(seen(sign, hand), DT_S)
    return pointing.stick


@pytest.mark.parametrize("handedness", ["Left", "Right"])
@pytest.mark.parametrize("tilt_deg", [-40, -20, 20, 40])
def test_a_tilted_finger_deflects_to_its_side(tilt_deg: float, handedness: Handedness) -> None:
    """Clockwise in the picture, which is not mirrored, is to the person's left."""
    pointing = Pointing()
    stick = held(pointing, FORWARD, hand(FORWARD, tilt_deg, handedness=handedness))
    assert pointing.tilt_deg == pytest.approx(tilt_deg, abs=9.0)
    assert stick.held
    assert stick.left * tilt_deg > 0
    assert stick.forward > 0.9


@pytest.mark.parametrize("tilt_deg", [-30, 30])
def test_down_and_to_a_side_swings_the_tail_there(tilt_deg: float) -> None:
    """A finger that points down is turned to the person's right by a clockwise turn; the robot turns left then."""
    stick = held(Pointing(), BACKWARD, hand(BACKWARD, tilt_deg))
    assert stick.forward < -0.9
    assert stick.left * tilt_deg > 0


def test_an_upright_finger_drives_straight_ahead() -> None:
    assert held(Pointing(), FORWARD, hand(FORWARD)).left == 0.0


def test_the_higher_the_hand_the_faster() -> None:
    speeds = [held(Pointing(), FORWARD, hand(FORWARD, y=y)).forward for y in (0.9, 0.75, 0.6, 0.5, 0.4, 0.3)]
    assert speeds == sorted(speeds)
    assert speeds[:2] == pytest.approx([SLOWEST, SLOWEST])
    assert speeds[4:] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    ("sign", "stick"),
    [
        (GO, Stick(held=True)),
        (TURN_LEFT, Stick(held=True, left=1.0)),
        (TURN_RIGHT, Stick(held=True, left=-1.0)),
        (STOP, RELEASED),
        (NONE, RELEASED),
        ("Peace", RELEASED),
    ],
)
def test_other_signs(sign: str, stick: Stick) -> None:
    pointing = Pointing()
    held(pointing, FORWARD, hand(FORWARD, 30))
    assert pointing.step(seen(sign, hand(FORWARD, 30)), DT_S) == stick, "at once"
    assert pointing.tilt_deg is None


def test_without_a_finger_seen_it_keeps_the_direction_and_slows_down() -> None:
    """A hand that opens to stop still counts as Forward for a moment, and its index finger points anywhere."""
    pointing = Pointing()
    before = held(pointing, FORWARD, hand(FORWARD, 20))
    opening = seen(FORWARD, hand(STOP, -60), shows=NONE)
    after = [pointing.step(opening, DT_S) for _ in range(8)]
    assert {stick.left for stick in after} == {before.left}
    assert [stick.forward for stick in after] == sorted((stick.forward for stick in after), reverse=True)
    assert after[0].forward > 0.7 * before.forward, "one frame may be an error"
    assert after[-1].forward == SLOWEST
    assert held(pointing, FORWARD, hand(FORWARD, 20)).forward == pytest.approx(before.forward)


def test_a_finger_that_closes_to_a_fist_does_not_slow_down() -> None:
    pointing = Pointing()
    before = held(pointing, FORWARD, hand(FORWARD, 20))
    assert {pointing.step(seen(FORWARD, hand(GO, -60), shows=GO), DT_S) for _ in range(8)} == {before}


def test_a_finger_that_was_not_seen_yet_holds_nothing() -> None:
    assert Pointing().step(seen(FORWARD, None), DT_S) == RELEASED


def test_after_another_sign_the_direction_begins_anew() -> None:
    pointing = Pointing()
    held(pointing, FORWARD, hand(FORWARD, 40))
    pointing.step(seen(STOP, hand(STOP)), DT_S)
    assert pointing.step(seen(FORWARD, hand(FORWARD)), DT_S).left == 0.0


def test_a_trembling_finger_is_smoothed() -> None:
    random, pointing, tilts = np.random.default_rng(0), Pointing(), []
    for noise_deg in 4.0 * random.standard_normal(200):
        pointing.step(seen(FORWARD, hand(FORWARD, 20 + noise_deg)), DT_S)
        assert pointing.tilt_deg is not None
        tilts.append(pointing.tilt_deg)
    assert np.std(tilts[20:]) < 0.75 * 4.0


@given(tilt_deg=st.floats(-180, 180), y=st.floats(-1, 2), expo=st.floats(0, 1))
def test_responses_are_within_one_odd_and_rise(tilt_deg: float, y: float, expo: float) -> None:
    config = JoystickConfig(expo=expo)
    assert abs(tilt_deflection(tilt_deg, config)) <= 1.0
    assert tilt_deflection(-tilt_deg, config) == -tilt_deflection(tilt_deg, config)
    assert abs(tilt_deflection(tilt_deg, config)) <= abs(tilt_deflection(1.1 * tilt_deg, config)) + 1e-12
    assert SLOWEST <= height_deflection(y, config) <= 1.0 + 1e-12
    assert height_deflection(y, config) >= height_deflection(y + 0.01, config) - 1e-12


def test_the_arc_is_drawn_from_the_palm_towards_where_it_goes() -> None:
    pointing = Pointing()
    picture = np.zeros((480, 640, 3), np.uint8)
    pointing.draw(picture)
    gauge = np.asarray(picture.any(axis=2))
    assert gauge[:, :40].any()
    assert not gauge[:, 40:].any(), "no finger points"
    held(pointing, FORWARD, hand(FORWARD, 35))
    pointing.draw(picture)
    drawn = np.argwhere(picture.any(axis=2) & ~gauge)
    palm = round(640 - 1 - hand(FORWARD, 35).pixels[[0, 5, 9, 13, 17], 0].mean())
    top, bottom = drawn[drawn[:, 0].argmin()], drawn[drawn[:, 0].argmax()]
    assert bottom[1] == pytest.approx(palm, abs=8)
    assert top[1] < bottom[1] - 20, "the person's left is on the left of a mirrored picture"
