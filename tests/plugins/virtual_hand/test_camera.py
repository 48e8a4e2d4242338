import numpy as np
import pytest

from handsteer.cameras import Camera
from handsteer.clock import RealClock, SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.errors import PoseError
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.testing.camera_contract import CameraContract


class TestVirtualHand(CameraContract):
    @pytest.fixture
    def camera(self, clock: SteppedClock) -> Camera:
        return camera(clock)


def camera(clock: SteppedClock, script: str = "Forward:1 Turn Left:1 NONE:1", **config: object) -> VirtualHandCamera:
    return VirtualHandCamera(VirtualHandConfig(script=script, **config), width=320, height=240, fps=25, clock=clock)


def test_frames_are_of_the_size_asked_and_carry_the_clocks_time() -> None:
    clock = SteppedClock(start_s=100.0)
    hand = camera(clock)
    clock.advance(0.5)
    frame = hand.read()
    assert (frame.image.shape, frame.image.dtype) == ((240, 320, 3), np.dtype(np.uint8))
    assert frame.captured_s == 100.5
    assert (hand.name, hand.period_s) == ("virtual hand", 0.04)


def test_on_a_real_clock_a_frame_is_captured_when_it_is_drawn() -> None:
    clock = RealClock()
    hand = VirtualHandCamera(VirtualHandConfig(), width=64, height=48, fps=30, clock=clock)
    before = clock.now()
    frame = hand.read()
    assert before < frame.captured_s <= clock.now()


def test_the_picture_moves_with_the_clock_and_only_with_it() -> None:
    clock = SteppedClock()
    hand = camera(clock)
    clock.advance(0.5)
    first, again = hand.read().image, hand.read().image
    np.testing.assert_array_equal(first, again)
    clock.advance(0.1)
    assert np.any(hand.read().image != first)


def test_two_cameras_of_one_configuration_show_the_same() -> None:
    clocks = SteppedClock(), SteppedClock(start_s=7.0)
    hands = [camera(clock, background="cluttered", seed=3) for clock in clocks]
    for clock in clocks:
        clock.advance(1.2)
    first, second = (hand.read().image.astype(int) for hand in hands)
    # 8.2 - 7.0 is not quite 1.2, so the odd pixel may differ by a rounding; each has its noise, of 0 to 2.
    assert np.abs(first - second).max() <= 3


def test_the_script_is_shown_over_and_over() -> None:
    clock = SteppedClock(start_s=5.0)
    hand = camera(clock)
    signs = [hand.truth(5.0 + time).sign for time in (0.5, 1.5, 2.5, 3.5, 4.5)]
    assert signs == ["Forward", "Turn Left", "NONE", "Forward", "Turn Left"]


def test_the_truth_says_where_the_joints_are() -> None:
    clock = SteppedClock()
    hand = camera(clock, "Stop:1 NONE:1")
    clock.advance(0.9)
    stop = hand.truth(clock.now())
    assert stop.settled
    assert stop.joints_px.shape == (21, 2)
    shown = hand.read().image.astype(int)
    clock.advance(0.9)
    empty = hand.read().image.astype(int)
    x, y = stop.joints_px.astype(int).T
    assert np.all(np.abs(shown - empty)[y, x].max(axis=-1) > 5)
    assert np.all(hand.truth(clock.now()).joints_px[:, 1] > 240)


def test_handedness_and_skin_are_as_configured() -> None:
    pictures = []
    for config in ({}, {"handedness": "Left"}, {"skin": "dark"}, {"sleeve": False}, {"background": "cluttered"}):
        clock = SteppedClock()
        hand = camera(clock, **config)
        clock.advance(0.5)
        pictures.append(hand.read().image)
    assert all(np.any(pictures[0] != other) for other in pictures[1:])


def test_a_wrong_script_is_refused_at_once() -> None:
    with pytest.raises(PoseError, match="part 2, 'Wave:1'"):
        camera(SteppedClock(), "Go:1 Wave:1")


def test_closing_twice_does_no_harm() -> None:
    hand = camera(SteppedClock())
    hand.close()
    hand.close()
