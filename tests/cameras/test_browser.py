import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.cameras import Camera, Frame
from handsteer.cameras.browser import LARGEST_BYTES, BrowserCamera
from handsteer.cameras.choice import BROWSER, ChoiceOfCameras
from handsteer.cameras.choose import MachineCameras, open_camera
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config
from handsteer.errors import FrameError
from handsteer.testing.camera_contract import CameraContract
from tests.fuzz import corpus


def sent(at_s: float, **picture: int) -> bytes:
    """Return a frame as a browser sends it, whose clock says ``at_s``."""
    return struct.pack("<d", 1000 * at_s) + corpus.jpeg(**picture)


class Sending:
    """A browser's camera whose browser sends a frame whenever one is read, without delay."""

    def __init__(self, clock: SteppedClock) -> None:
        self._clock = clock
        self._cameras = choice(clock)
        self._cameras.choose(BROWSER)
        self._cameras.read()
        self.name, self.period_s = self._cameras.name, self._cameras.period_s
        self.close = self._cameras.close

    def read(self) -> Frame | None:
        self._cameras.browser.offer(sent(self._clock.now() - 77.0))
        return self._cameras.read()


def choice(clock: SteppedClock) -> ChoiceOfCameras:
    config = Config(camera=CameraConfig(source="virtual", width=64, height=48))
    own = open_camera(config, clock)
    return ChoiceOfCameras(own, BrowserCamera(clock), MachineCameras(config, clock, own))


class TestBrowserCamera(CameraContract):
    @pytest.fixture
    def camera(self, clock: SteppedClock) -> Camera:
        return Sending(clock)


def test_the_newest_frame_is_read_once() -> None:
    browser = BrowserCamera(SteppedClock(5.0))
    browser.offer(sent(1.0, value=10))
    browser.offer(sent(1.1, value=200))
    frame = browser.read(0.0)
    assert frame is not None
    assert frame.image.mean() == pytest.approx(200, abs=2)
    assert browser.read(0.0) is None


def test_a_frame_that_was_held_up_is_as_old_as_it_is() -> None:
    clock = SteppedClock(100.0)
    browser = BrowserCamera(clock)
    browser.offer(sent(3.0))
    clock.advance(0.9)
    browser.offer(sent(3.1))  # was under way for 0.8 s longer than the first one
    frame = browser.read(0.0)
    assert frame is not None
    assert clock.now() - frame.captured_s == pytest.approx(0.8, abs=0.002)


def test_clocks_that_drift_apart_make_no_frame_old() -> None:
    clock = SteppedClock(0.0)
    browser = BrowserCamera(clock)
    for step in range(3600):  # an hour, in which the browser's clock loses 0.3 s
        clock.advance(1.0)
        browser.offer(sent(step * (1 - 0.0001)))
    frame = browser.read(0.0)
    assert frame is not None
    assert clock.now() - frame.captured_s < 0.05


def test_another_browser_starts_with_a_clock_of_its_own() -> None:
    clock = SteppedClock(100.0)
    browser = BrowserCamera(clock)
    browser.offer(sent(50.0))
    given = browser.is_given
    assert given
    browser.forget()
    assert not browser.is_given
    assert browser.read(0.0) is None
    browser.offer(sent(2.0))
    frame = browser.read(0.0)
    assert frame is not None
    assert frame.captured_s == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "a frame of 0 bytes"),
        (bytes(LARGEST_BYTES + 1), "at most 1000000"),
        (struct.pack("<d", float("nan")) + corpus.jpeg(), "without the time"),
        (struct.pack("<d", 1.0) + b"GIF89a", "not a JPEG"),
        (struct.pack("<d", 1.0) + corpus.png(64, 48), "not a JPEG"),
        (sent(0.0)[:-20], "a torn JPEG picture"),
        (sent(0.0, width=4000, height=3000), "4000x3000: it should have at most 1920x1080"),
    ],
    ids=["empty", "large", "timeless", "gif", "png", "torn", "huge"],
)
def test_what_is_no_frame_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(FrameError, match=message):
        BrowserCamera(SteppedClock(0.0)).offer(data)


@given(st.binary(max_size=200).map(lambda rest: b"\xff\xd8\xff" + rest))
def test_no_bytes_do_harm(data: bytes) -> None:
    browser = BrowserCamera(SteppedClock(0.0))
    try:
        browser.offer(struct.pack("<d", 1.0) + data)
    except FrameError:
        return
    browser.read(0.0)
