import itertools

import numpy as np
import pytest

from handsteer.cameras import Camera, Frame
from handsteer.clock import SteppedClock
from handsteer.errors import CameraLost
from handsteer.testing.camera_contract import CameraContract
from handsteer.testing.faulty_camera import CAMERA_FAULTS, CameraFault, FaultyCamera, SpoiltCamera

FPS = 10


def working(clock: SteppedClock) -> FaultyCamera:
    """Return a camera whose pictures all differ."""
    pictures = (np.full((48, 64, 3), 1 + number % 99, np.uint8) for number in itertools.count())
    return FaultyCamera(pictures, clock, period_s=1 / FPS)


class TestSpoilt(CameraContract):
    @pytest.fixture
    def camera(self, clock: SteppedClock) -> Camera:
        return SpoiltCamera(working(clock), clock)


class Failing:
    """A camera that has given three frames before it fails."""

    def __init__(self, fault: CameraFault) -> None:
        self.clock = SteppedClock(100.0)
        self.camera = SpoiltCamera(working(self.clock), self.clock)
        self.before = self.read(3)
        self.camera.fail(fault)

    def read(self, frames: int) -> list[Frame | None]:
        taken = []
        for _ in range(frames):
            self.clock.advance(1 / FPS)
            taken.append(self.camera.read())
        return taken


def pictures(frames: list[Frame | None]) -> list[bytes]:
    return [frame.image.tobytes() for frame in frames if frame is not None]


def test_black_is_black() -> None:
    assert all(frame is not None and not frame.image.any() for frame in Failing("black").read(5))


def test_frozen_gives_the_last_picture_with_new_times() -> None:
    failing = Failing("frozen")
    frozen = failing.read(5)
    assert set(pictures(frozen)) == {pictures(failing.before)[-1]}
    assert [frame and round(frame.captured_s, 3) for frame in frozen] == [100.4, 100.5, 100.6, 100.7, 100.8]


def test_torn_is_new_above_and_grey_below() -> None:
    for frame in Failing("torn").read(20):
        assert frame is not None
        grey = (frame.image == 128).all(axis=(1, 2))
        line = int(grey.argmax())
        assert grey[line:].all()
        assert (frame.image[:line] == frame.image[0]).all()


@pytest.mark.parametrize(("fault", "frames"), [("slow", 3), ("stuttering", 15), ("silent", 0)])
def test_frames_that_are_left_out(fault: CameraFault, frames: int) -> None:
    assert len(pictures(Failing(fault).read(3 * FPS))) == pytest.approx(frames, abs=6 if fault == "stuttering" else 0)


@pytest.mark.parametrize(("fault", "apart_s"), [("in_the_future", 5.0), ("late", -5.0)])
def test_stamps_that_are_wrong(fault: CameraFault, apart_s: float) -> None:
    failing = Failing(fault)
    (frame,) = failing.read(1)
    assert frame is not None
    assert frame.captured_s == pytest.approx(failing.clock.now() + apart_s)


def test_a_camera_that_has_vanished_raises_and_comes_back() -> None:
    failing = Failing("vanishing")
    for _ in range(3):
        with pytest.raises(CameraLost, match="has vanished"):
            failing.read(1)
    failing.camera.recover()
    assert len(pictures(failing.read(3))) == 3


@pytest.mark.parametrize("fault", CAMERA_FAULTS)
def test_after_every_fault_it_works_again(fault: CameraFault) -> None:
    failing, healthy = Failing(fault), Failing(fault)
    for each in (failing, healthy):
        if each is healthy:
            each.camera.recover()
        for _ in range(5):
            if fault == "vanishing" and each is failing:
                each.clock.advance(1 / FPS)
                with pytest.raises(CameraLost):
                    each.camera.read()
            else:
                each.read(1)
    failing.camera.recover()
    assert failing.camera.fault is None
    assert pictures(failing.read(3)) == pictures(healthy.read(3))


def test_an_unknown_fault_is_refused() -> None:
    clock = SteppedClock()
    with pytest.raises(ValueError, match="there is no fault 'purple' of a camera: use black, frozen"):
        SpoiltCamera(working(clock), clock).fail("purple")  # type: ignore[arg-type]
