import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.teach.evaluation.views import View
from handsteer.types import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT
from tests.recognition.hands import show_sign

Truth = tuple[str | None, str]


def spotted(height: int = 480, width: int = 640) -> np.ndarray:
    """Black, with a white spot above the middle and a grey one to the left of it."""
    image = np.zeros((height, width, 3), np.uint8)
    image[: height // 4, width // 2 - 20 : width // 2 + 20] = 255
    image[height // 2 - 20 : height // 2 + 20, : width // 4] = 100
    return image


@pytest.mark.parametrize(
    ("view", "truth", "expected"),
    [
        (View(), (FORWARD, ""), (FORWARD, "")),
        (View(flip=True), (TURN_RIGHT, ""), (TURN_LEFT, "")),
        (View(flip=True), (TURN_LEFT, ""), (TURN_RIGHT, "")),
        (View(flip=True), (FORWARD, ""), (FORWARD, "")),
        (View(flip=True), (NONE, "thumb_up"), (NONE, "thumb_up")),
        (View(rotate_deg=180), (FORWARD, ""), (BACKWARD, "")),
        (View(rotate_deg=180), (TURN_LEFT, ""), (TURN_RIGHT, "")),
        (View(rotate_deg=180, flip=True), (TURN_LEFT, ""), (TURN_LEFT, "")),
        (View(rotate_deg=180), (NONE, "thumb_up"), (NONE, "thumb_down")),
        # Clockwise: a thumb up then points to the right of the image, which is the user's own left.
        (View(rotate_deg=90), (NONE, "thumb_up"), (TURN_LEFT, "")),
        (View(rotate_deg=90), (NONE, "Thumb Down"), (TURN_RIGHT, "")),
        (View(rotate_deg=-90), (NONE, "thumb_up"), (TURN_RIGHT, "")),
        (View(rotate_deg=90), (TURN_RIGHT, ""), (NONE, "thumb_up")),
        (View(rotate_deg=90), (FORWARD, ""), (NONE, "index_to_image_right")),
        (View(rotate_deg=20), (FORWARD, ""), (FORWARD, "")),
        (View(rotate_deg=45), (FORWARD, ""), (None, "")),
        (View(rotate_deg=45), (NONE, "thumb_up"), (None, "thumb_up")),
        (View(rotate_deg=180), (STOP, ""), (STOP, "")),
        (View(rotate_deg=90), (GO, ""), (GO, "")),
        (View(rotate_deg=90), (NONE, "horns"), (NONE, "horns")),
        (View(rotate_deg=90), ("Hi", ""), ("Hi", "")),
        (View(rotate_deg=90), (None, "L_shape"), (None, "L_shape")),
    ],
)
def test_what_is_shown_then(view: View, truth: Truth, expected: Truth) -> None:
    assert view.truth(*truth) == expected


def test_a_grey_camera_sees_no_colours() -> None:
    image = spotted() // 2 + np.array([10, 40, 90], np.uint8)
    grey = View(grey=True, flip=True).picture(image)
    np.testing.assert_array_equal(
        grey, cv2.cvtColor(cv2.cvtColor(image[:, ::-1], cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    )
    assert View(grey=True, flip=True).name == "flipped grey"


def test_pictures_turn_the_way_that_the_truth_does() -> None:
    """White is up and grey is left at first."""
    image = spotted()
    flipped = View(flip=True).picture(image)
    assert flipped[240, -10, 0] == 100
    clockwise = View(rotate_deg=90).picture(image)
    assert clockwise.shape == (640, 480, 3)
    assert clockwise[320, -10, 0] == 255, "up becomes right"
    assert clockwise[10, 240, 0] == 100, "left becomes up"
    slightly = View(rotate_deg=20).picture(image)
    assert slightly.shape[0] > 480
    assert np.argwhere(slightly[..., 0] > 200)[:, 1].mean() > slightly.shape[1] / 2, "clockwise too"


def test_small_pictures_are_padded_and_enlarged_and_others_are_not() -> None:
    assert View().picture(spotted(100, 100)).shape == (480, 480, 3)
    assert View().picture(spotted(100, 50)).shape == (480, 240, 3)
    assert View(enlarge=False).picture(spotted(100, 100)).shape == (100, 100, 3)
    assert View().picture(spotted(300, 400)).shape == (300, 400, 3)
    grey = np.full((100, 100, 3), 77, np.uint8)
    assert (View().picture(grey) == 77).all(), "the border is that of the picture"


def test_a_picture_is_not_changed_in_place() -> None:
    image = spotted()
    View(flip=True, rotate_deg=180).picture(image)
    assert (image == spotted()).all()


@given(quarters=st.lists(st.sampled_from([-270, -180, -90, 0, 90, 180, 270]), max_size=4))
def test_turning_on_and_on_is_turning_once(quarters: list[int]) -> None:
    truth: Truth = (FORWARD, "")
    for quarter in quarters:
        truth = View(rotate_deg=quarter).truth(*truth)
    assert truth == View(rotate_deg=sum(quarters) % 360).truth(FORWARD)


@pytest.mark.parametrize("view", [View(flip=True), View(rotate_deg=90), View(rotate_deg=30), View(True, 200)])
def test_a_hand_is_seen_as_the_picture_that_it_is_in(view: View) -> None:
    """Each landmark, drawn into the picture as a dot, is where the landmark of the hand is that is seen so."""
    hand = show_sign("Forward")
    seen = view.hand(hand)
    for number in (0, 4, 8, 17):
        x, y = hand.pixels[number, :2]
        picture = np.zeros((480, 640, 3), np.uint8)
        cv2.circle(picture, (round(float(x)), round(float(y))), 4, (255, 255, 255), -1)
        shown = View(view.flip, view.rotate_deg, enlarge=False).picture(picture)
        assert abs(shown.shape[1] - seen.image_size[0]) <= 1
        ys, xs = np.nonzero(shown[..., 0] > 128)
        assert seen.pixels[number, :2] == pytest.approx((xs.mean(), ys.mean()), abs=2.5)
    assert seen.handedness == ("Left" if view.flip else "Right")
    lengths = [np.linalg.norm(each.world[8] - each.world[0]) for each in (hand, seen)]
    assert lengths[0] == pytest.approx(lengths[1])
