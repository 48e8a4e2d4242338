import numpy as np
import pytest

from handsteer.config import Config, ControlConfig, JoystickConfig
from handsteer.plugins.bench.hand_interfaces import CHOICES, SignChoice, moved_for
from handsteer.plugins.bench.hand_view import HandCamera, HandLandmarker, LandmarkErrors, blank_picture
from handsteer.plugins.bench.hands import Limb, OperatorsHand, Slips
from handsteer.plugins.virtual_hand.poses import Pinhole, sign_pose
from handsteer.recognition.hand_joystick import deflection
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT, Velocity

CAMERA = Pinhole.webcam(640, 480)
NONE_WRONG = LandmarkErrors().scaled(0.0)


def test_a_limb_reaches_its_aim_smoothly_and_late() -> None:
    limb = Limb(1, 0.25, np.random.default_rng(0))
    limb.aim(np.array([1.0]))
    places = []
    for _ in range(100):
        limb.step(0.01)
        places.append(float(limb.place()[0]))
    assert places[5] < 0.2
    assert places[-1] == pytest.approx(1.0, abs=0.02)
    assert np.abs(np.diff(places, 2)).max() < 0.02


@pytest.mark.parametrize("sign", CHOICES)
def test_landmarks_without_errors_show_the_sign(sign: str) -> None:
    landmarker = HandLandmarker(CAMERA, NONE_WRONG, np.random.default_rng(0))
    landmarker.pose = sign_pose(sign)
    assert Recognizer(Config(), landmarker=landmarker).recognize(blank_picture(0)).sign == sign


def test_a_lowered_hand_is_not_found() -> None:
    landmarker = HandLandmarker(CAMERA, NONE_WRONG, np.random.default_rng(0))
    landmarker.pose = sign_pose(NONE)
    assert landmarker.detect(blank_picture(0)) == []


def test_landmarks_agree_with_those_found_in_the_picture() -> None:
    pose = sign_pose(STOP)
    landmarker = HandLandmarker(CAMERA, NONE_WRONG, np.random.default_rng(0))
    landmarker.pose = pose
    (given,) = landmarker.detect(blank_picture(0))
    found = Recognizer(Config()).recognize(HandCamera(CAMERA, 0).picture(pose, 0.0)).hand
    assert found is not None
    palm_px = float(np.linalg.norm(given.pixels[9, :2] - given.pixels[0, :2]))
    assert np.abs(found.pixels[:, :2] - given.pixels[:, :2]).max() < 0.2 * palm_px
    assert found.handedness == given.handedness


def test_the_hand_shows_the_sign_after_a_moment_and_corrects_slips() -> None:
    hand = OperatorsHand(np.random.default_rng(1), Slips(wrong=1.0, unclear=0.0, noticed_s=0.5), CHOICES)
    hand.show(FORWARD)
    for _ in range(100):
        hand.step(0.01)
    assert np.abs(hand.pose().angles - sign_pose(FORWARD).angles).max() < 0.05
    assert hand.changes == 1


def test_signs_are_chosen_by_what_they_do() -> None:
    choice = SignChoice(ControlConfig(), 30.0, 0.5)
    choice.note(GO, 0.0)
    assert choice.best(GO, Velocity(0.5)) == FORWARD
    assert choice.best(GO, Velocity(0.0, 1.0)) == TURN_LEFT
    assert choice.best(GO, Velocity(0.0, -1.0)) == TURN_RIGHT
    assert choice.best(FORWARD, Velocity()) == STOP


def test_a_turn_at_speed_goes_through_the_fist() -> None:
    choice = SignChoice(ControlConfig(), 30.0, 0.5)
    choice.note(FORWARD, 0.0)
    for _ in range(60):
        choice.note(FORWARD, 1 / 30)
    assert choice.best(FORWARD, Velocity(0.6, 1.0)) == GO


def test_the_fist_moves_for_a_deflection() -> None:
    config = JoystickConfig()
    for share in (-1.0, -0.3, 0.0, 0.05, 1.0):
        assert deflection(moved_for(share, config), config) == pytest.approx(share, abs=1e-3)


def test_tiny_pictures_differ() -> None:
    assert len({blank_picture(number).tobytes() for number in range(300)}) == 300
