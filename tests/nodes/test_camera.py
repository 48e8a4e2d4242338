import math
from dataclasses import replace

import numpy as np
import pytest

from handsteer.cameras import Frame
from handsteer.cameras.choose import uncalibrated
from handsteer.clock import SteppedClock, to_seconds
from handsteer.config import Config
from handsteer.errors import CameraLost
from handsteer.images import bgr_image
from handsteer.messages import CAMERA_INFO, DIAGNOSTICS, IMAGE_COMPRESSED, IMAGE_RAW, CameraInfo
from handsteer.nodes.camera import CameraNode
from handsteer.testing.faulty_camera import Event, FaultyCamera
from tests.nodes.stepping import Bench

LOST = CameraLost("webcam 0 gives no more frames")
ONE, TWO, THREE, FOUR = (np.full((48, 64, 3), level, np.uint8) for level in (7, 8, 9, 10))


def start(*events: Event, age_s: float = 0.0) -> tuple[Bench, CameraNode, FaultyCamera]:
    bench = Bench()
    camera = FaultyCamera(events, bench.clock, period_s=0.1, age_s=age_s)
    node = CameraNode(bench.transport, bench.clock, camera)
    bench.nodes = [node]
    return bench, node, camera


def test_frames_go_out_with_their_capture_time() -> None:
    bench, node, _ = start(ONE, TWO, age_s=0.04)
    bench.clock.advance(1.0)
    images = bench.record(IMAGE_RAW)
    bench.run(0.15)
    assert [round(to_seconds(image.header.stamp), 3) for image in images] == [0.96, 1.06]
    assert images[0].header.frame_id == "camera_optical_frame"
    np.testing.assert_array_equal(bgr_image(images[0]), ONE)
    assert node.frames == 2


def test_jpeg_is_made_on_demand() -> None:
    bench, _, _ = start(ONE, TWO, THREE)
    bench.run(0.05)
    compressed = bench.record(IMAGE_COMPRESSED)
    bench.run(0.1)
    assert len(compressed) == 1


def test_camera_info_says_with_each_image_what_is_known(caplog: pytest.LogCaptureFixture) -> None:
    def of(known: CameraInfo | None) -> CameraInfo:
        bench, _, camera = start(ONE, TWO)
        bench.nodes = [CameraNode(bench.transport, bench.clock, camera, calibration=known)]
        images, infos = bench.record(IMAGE_RAW), bench.record(CAMERA_INFO)
        bench.run(0.15)
        assert [info.header for info in infos] == [image.header for image in images]
        assert {(info.width, info.height) for info in infos} == {(64, 48)}
        return infos[0]

    lens = replace(uncalibrated(64, 48), k=np.eye(3).reshape(-1))
    assert not np.any(of(None).k)
    assert np.any(of(lens).k)
    assert not np.any(of(replace(lens, width=65)).k)
    assert "the calibration is for pictures of 65 x 48, and these have 64 x 48: it is not used" in caplog.text


class Several(FaultyCamera):
    """A camera that becomes another one, as a choice of cameras does."""

    def become(self, name: str, period_s: float | None, *events: Event) -> None:
        self.name, self.period_s = name, period_s  # type: ignore[assignment]
        self._events = iter(events)


def several(*events: Event, calibration: CameraInfo | None = None) -> tuple[Bench, CameraNode, Several]:
    bench = Bench()
    camera = Several(events, bench.clock, period_s=0.1)
    bench.nodes = [node := CameraNode(bench.transport, bench.clock, camera, calibration=calibration)]
    return bench, node, camera


def test_the_pace_and_the_report_are_those_of_the_camera_in_use() -> None:
    bench, _, camera = several(ONE, TWO)
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(0.15)
    assert len(images) == 2
    camera.become("webcam 1", 0.5, THREE, None, None, None, None)
    bench.run(0.9)
    assert len(images) == 3
    assert diagnostics[-1].status[0].message == "webcam 1: delivers frames"
    camera.become("webcam 2", 0.5, *[None] * 9)
    bench.run(1.0)
    assert diagnostics[-1].status[0].message == "webcam 2: waiting for the first frame"


def test_the_calibration_is_not_used_for_another_camera() -> None:
    lens = replace(uncalibrated(64, 48), k=np.eye(3).reshape(-1))
    bench, _, camera = several(ONE, TWO, calibration=lens)
    infos = bench.record(CAMERA_INFO)
    bench.run(0.05)
    camera.become("webcam 1", 0.1, THREE, FOUR)
    bench.run(0.2)
    assert [bool(np.any(info.k)) for info in infos] == [True, False, False]


def test_another_camera_does_not_wait_for_the_next_try_of_a_lost_one() -> None:
    bench, node, camera = several(ONE, LOST, LOST, LOST, LOST)
    images = bench.record(IMAGE_RAW)
    bench.run(4.0)
    camera.become("webcam 1", 0.1, TWO, THREE)
    node.reconfigure(Config())
    bench.run(0.05)
    assert len(images) == 2


def test_a_lost_camera_is_tried_again_with_growing_pauses(caplog: pytest.LogCaptureFixture) -> None:
    bench, node, _ = start(ONE, LOST, LOST, LOST, TWO, THREE)
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(1.0)
    assert (len(images), diagnostics[-1].status[0].message) == (1, "webcam 0 gives no more frames")
    bench.run(2.0)
    assert len(images) == 1
    bench.run(1.0)
    assert len(images) == 3
    assert "trying again in 0.5 s" in caplog.text
    assert "trying again in 2 s" in caplog.text
    assert "faulty camera is back" in caplog.text
    assert node.callback_errors == 0


def test_a_camera_that_fails_in_a_way_of_its_own_is_tried_again_with_pauses_too(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench, node, _ = start(ONE, OSError("no such port"), OSError("no such port"), TWO, THREE)
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(1.0)
    status = diagnostics[-1].status[0]
    assert (len(images), status.message) == (1, "faulty camera has failed: OSError: no such port")
    bench.run(2.0)
    assert len(images) == 3
    assert caplog.text.count("Traceback") == 1
    assert node.callback_errors == 0


def test_a_camera_that_exits_has_failed() -> None:
    bench, node, _ = start(ONE, SystemExit(0), SystemExit(0), TWO)
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(1.0)
    assert diagnostics[-1].status[0].message == "faulty camera has failed: SystemExit: 0"
    bench.run(2.0)
    assert (len(images), node.frames) == (2, 2)


@pytest.mark.parametrize(
    "odd", ["a text", Frame(np.zeros((0, 0, 3), np.uint8), 0.0), Frame(ONE, math.nan)], ids=["text", "empty", "nan"]
)
def test_a_frame_that_cannot_be_published_is_a_failure_of_the_camera(
    odd: object, caplog: pytest.LogCaptureFixture
) -> None:
    bench, node, _ = start(ONE, *[odd] * 2, TWO)  # type: ignore[arg-type]
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(1.0)
    assert diagnostics[-1].status[0].message.startswith("faulty camera has failed: ")
    assert caplog.text.count("faulty camera is back") == 0
    bench.run(2.0)
    assert (len(images), node.frames, node.callback_errors) == (2, 2, 0)
    assert caplog.text.count("Traceback") == caplog.text.count("faulty camera is back") == 1


def test_a_camera_that_returns_no_frame_at_once_is_not_asked_without_pause() -> None:
    bench, camera = Bench(), FaultyCamera([None] * 1000 + [ONE], SteppedClock())
    camera.period_s = None  # type: ignore[assignment]
    bench.nodes = [node := CameraNode(bench.transport, bench.clock, camera)]
    bench.run(1.0)
    assert node.frames == 0
    bench.run(10.0)
    assert node.frames == 1


def test_a_file_that_ends_says_so_and_the_camera_is_released_at_the_end() -> None:
    bench, node, camera = start(ONE)
    bench.run(0.05)
    assert not node.ended.is_set()
    bench.run(0.1)
    assert node.ended.is_set()
    node.stop()
    assert camera.closed


def test_no_frame_now_is_no_message() -> None:
    bench, _, _ = start(ONE, None, None, TWO)
    images = bench.record(IMAGE_RAW)
    bench.run(0.35)
    assert len(images) == 2


def test_a_picture_that_is_the_same_as_the_last_is_no_frame_and_the_camera_is_said_to_be_frozen(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench, node, _ = start(ONE, *[TWO] * 20, THREE, FOUR)
    images, diagnostics = bench.record(IMAGE_RAW), bench.record(DIAGNOSTICS)
    bench.run(1.95)
    assert [image.data[0] for image in images] == [7, 8]
    status = diagnostics[-1].status[0]
    assert (status.level, status.message) == (2, "faulty camera: frozen, the same picture for 1.3 s")
    assert caplog.text.count("faulty camera is frozen") == 1
    bench.run(0.3)
    assert [image.data[0] for image in images] == [7, 8, 9, 10]
    assert "faulty camera is back" in caplog.text
    assert node.frames == 4


def test_a_frozen_camera_that_delivers_nothing_more_is_said_to_be_silent() -> None:
    bench, _, _ = start(ONE, *[TWO] * 20, *[None] * 30)
    diagnostics = bench.record(DIAGNOSTICS)
    bench.run(4.0)
    assert diagnostics[-1].status[0].message == "faulty camera: no frame for 2 s"
