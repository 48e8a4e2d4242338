"""What every camera must do; each camera's own test module inherits it, those of plug-ins too. Needs pytest."""

import numpy as np
import pytest

from handsteer.cameras import Camera, Frame
from handsteer.clock import SteppedClock


class CameraContract:
    """Inherit, and provide ``camera``: one that has at least three frames, on ``clock``."""

    @pytest.fixture
    def clock(self) -> SteppedClock:
        return SteppedClock(100.0)

    @pytest.fixture
    def camera(self, clock: SteppedClock) -> Camera:
        raise NotImplementedError

    def test_it_has_a_name_and_a_pace(self, camera: Camera) -> None:
        assert camera.name
        assert camera.period_s is None or 0 < camera.period_s <= 1

    def test_frames_are_colour_pictures_of_one_size(self, camera: Camera) -> None:
        frames = [self.next_frame(camera) for _ in range(3)]
        for frame in frames:
            assert frame.image.ndim == 3
            assert frame.image.shape[2] == 3
            assert frame.image.dtype == np.uint8
        assert len({frame.image.shape for frame in frames}) == 1

    def test_frames_carry_the_time_of_their_capture(self, camera: Camera, clock: SteppedClock) -> None:
        self.next_frame(camera)
        times = []
        for _ in range(2):
            clock.advance(0.5)
            times.append(self.next_frame(camera).captured_s)
        assert times == [100.5, 101.0]

    def test_a_frame_is_not_changed_by_the_next_one(self, camera: Camera, clock: SteppedClock) -> None:
        frame = self.next_frame(camera)
        before = frame.image.copy()
        clock.advance(0.5)
        self.next_frame(camera)
        np.testing.assert_array_equal(frame.image, before)

    def test_it_may_be_closed_twice(self, camera: Camera) -> None:
        camera.close()
        camera.close()

    @staticmethod
    def next_frame(camera: Camera) -> Frame:
        frame = camera.read()
        assert frame is not None
        return frame
