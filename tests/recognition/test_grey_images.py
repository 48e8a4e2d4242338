"""A hand in the images of cameras without colours, or with a sensor's own pattern of them."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from handsteer import Recognizer
from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.images import bgr_image
from handsteer.messages import Header, Image, Time
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera

HEADER = Header(Time(0, 0), "camera")


def one_plane(encoding: str, picture: NDArray[np.uint8]) -> Image:
    height, width = picture.shape
    return Image(HEADER, height, width, encoding, 0, width, picture.reshape(-1))


def grey(bgr: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY), np.uint8)


def rggb(bgr: NDArray[np.uint8]) -> NDArray[np.uint8]:
    found = bgr[..., 1].copy()
    found[0::2, 0::2], found[1::2, 1::2] = bgr[0::2, 0::2, 2], bgr[1::2, 1::2, 0]
    return found


@pytest.mark.parametrize(
    ("encoding", "convert"), [("mono8", grey), ("8UC1", grey), ("bayer_rggb8", rggb)], ids=["mono8", "8UC1", "bayer"]
)
def test_a_palm_is_recognised_without_colours_and_in_a_sensors_pattern(encoding: str, convert: object) -> None:
    clock = SteppedClock(0.5)
    camera = VirtualHandCamera(VirtualHandConfig(script="Stop:5"), width=640, height=480, fps=10.0, clock=clock)
    assert callable(convert)
    message = one_plane(encoding, convert(camera.read().image))
    assert Recognizer().recognize(bgr_image(message)).sign == "Stop"


@pytest.mark.parametrize("sign", ["Stop", "Forward", "Turn Left", "Go"])
def test_a_small_grey_hand_is_recognised(sign: str) -> None:
    """MediaPipe's palm model, which was trained on colours, finds it in none of these pictures."""
    clock, recognizer, found = SteppedClock(0.0), Recognizer(), []
    camera = VirtualHandCamera(VirtualHandConfig(script=f"{sign}:9"), width=640, height=480, fps=10.0, clock=clock)
    for second in range(4):
        clock.advance_to(0.5 + second)
        whole = grey(camera.read().image)
        picture = np.full_like(whole, int(np.median(whole)))
        small = cv2.resize(whole, None, fx=0.35, fy=0.35, interpolation=cv2.INTER_AREA)
        picture[100 : 100 + small.shape[0], 150 : 150 + small.shape[1]] = small
        found.append(recognizer.recognize(bgr_image(one_plane("mono8", picture))).sign)
    assert found.count(sign) >= 3
