import contextlib
import re
import socket
import struct
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handsteer.cameras import Camera
from handsteer.cameras.webcam import Webcam, captures, is_address, is_device
from handsteer.clock import SteppedClock
from handsteer.errors import CameraInUse, CameraLost, CameraNotFound, CameraUnreadable
from handsteer.testing.camera_contract import CameraContract

IMAGE = np.full((48, 64, 3), 7, np.uint8)


class FakeCapture:
    """A device that gives what it is told to; no webcam can be unplugged in a test."""

    def __init__(self, *reads: Any) -> None:
        self.reads = list(reads)
        self.settings: dict[int, float] = {}
        self.size: tuple[int, int] | None = None  # where it is not the one that was asked for
        self.released = False

    def isOpened(self) -> bool:  # noqa: N802
        return bool(self.reads)

    def read(self) -> tuple[bool, Any]:
        image = self.reads.pop(0) if self.reads else None
        if isinstance(image, Exception):
            raise image
        return image is not None, image

    def get(self, prop: int) -> float:
        sides = (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        return self.size[sides.index(prop)] if self.size else self.settings[prop]

    def set(self, prop: int, value: float) -> bool:
        self.settings[prop] = value
        return True

    def release(self) -> None:
        self.released = True


class TestWebcam(CameraContract):
    @pytest.fixture
    def camera(self, clock: SteppedClock) -> Camera:
        capture = FakeCapture(*[IMAGE.copy() for _ in range(5)])
        camera = Webcam("0", clock, open_capture=lambda _: capture)
        camera.read()  # the first frame was taken when the device was opened
        return camera


def test_frames_carry_their_time_and_the_device_is_asked_for_size_and_rate() -> None:
    capture, clock = FakeCapture(None, IMAGE, IMAGE), SteppedClock(3.0)
    camera = Webcam("0", clock, width=320, height=240, fps=15, open_capture=lambda _: capture)
    first = camera.read()
    clock.advance(1.0)
    second = camera.read()
    assert first is not None
    assert second is not None
    assert (first.captured_s, second.captured_s) == (3.0, 4.0)
    assert capture.settings[cv2.CAP_PROP_FRAME_WIDTH] == 320
    assert capture.settings[cv2.CAP_PROP_FPS] == 15
    assert capture.settings[cv2.CAP_PROP_BUFFERSIZE] == 1


@pytest.mark.parametrize("fault", [None, cv2.error("select() timeout")])
def test_an_unplugged_webcam_is_lost_and_comes_back(fault: Exception | None) -> None:
    captures = [FakeCapture(IMAGE, fault), FakeCapture(), FakeCapture(IMAGE, IMAGE)]
    opened = iter(captures)
    camera = Webcam("0", SteppedClock(), open_capture=lambda _: next(opened))
    camera.read()
    with pytest.raises(CameraLost, match="webcam 0 gives no more frames: is it still plugged in"):
        camera.read()
    assert captures[0].released
    with pytest.raises(CameraLost):
        camera.read()
    assert camera.read() is not None
    assert camera.read() is not None


def test_there_is_no_such_webcam() -> None:
    with pytest.raises(CameraNotFound, match="there is no webcam /dev/video97"):
        Webcam("97", SteppedClock())


def test_a_device_that_another_program_holds_names_it() -> None:
    with Path("/dev/null").open() as held, subprocess.Popen(["sleep", "60"], stdin=held) as other:
        try:
            with pytest.raises(CameraInUse, match=r"/dev/null is in use by .* \(process \d+\): close that program"):
                Webcam("/dev/null", SteppedClock())
        finally:
            other.kill()


def test_a_device_that_gives_no_picture() -> None:
    empty = FakeCapture(*[None] * 20)
    with pytest.raises(CameraUnreadable, match="/dev/video98 gives no picture: unplug it"):
        Webcam("98", SteppedClock(), open_capture=lambda _: empty)
    assert empty.released


def test_an_address_that_does_not_answer() -> None:
    with pytest.raises(CameraNotFound, match=r"no picture comes from rtsp://127\.0\.0\.1:9/x: check the address"):
        Webcam("rtsp://me:s@cret@127.0.0.1:9/x?token=secret", SteppedClock())


@pytest.mark.slow
def test_jpegs_that_a_program_sends_to_a_port_are_read_up_to_the_newest(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the camera on the ribbon cable of a Raspberry Pi is used."""
    guide = (Path(__file__).parents[2] / "docs" / "raspberry-pi.md").read_text(encoding="utf-8")
    options = re.search(r'OPENCV_FFMPEG_CAPTURE_OPTIONS="(.+)"', guide)
    assert options
    monkeypatch.setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", options[1])
    sent = 0

    def send(server: socket.socket) -> None:
        nonlocal sent
        connection, _ = server.accept()
        with connection, contextlib.suppress(OSError):  # its end
            while True:
                picture = np.full((480, 640, 3), 8 * (sent % 32), np.uint8)
                connection.sendall(cv2.imencode(".jpg", picture)[1].tobytes())
                sent += 1
                time.sleep(1 / 30)

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=send, args=(server,), daemon=True).start()
        camera = Webcam(f"tcp://127.0.0.1:{server.getsockname()[1]}", SteppedClock())
        for _ in range(1000):
            frame = camera.read()
            assert frame
            shown = float(frame.image.mean()) / 8
            if sent and abs(shown - (sent - 1) % 32) < 1.5:
                break
        else:
            pytest.fail("the newest picture was not read")
        camera.close()


def test_a_camera_that_would_give_far_too_large_pictures_is_asked_for_none() -> None:
    capture = FakeCapture(IMAGE)
    capture.size = (20000, 20000)
    with pytest.raises(CameraUnreadable, match="gives pictures of 20000x20000: they should have at most 16777216"):
        Webcam("rtsp://camera", SteppedClock(), open_capture=lambda _: capture)
    assert len(capture.reads) == 1
    assert capture.released


def test_a_camera_whose_pictures_become_far_too_large_is_lost() -> None:
    large = np.broadcast_to(np.uint8(7), (20000, 20000, 3))
    captures = iter([FakeCapture(IMAGE, large), FakeCapture(IMAGE)])
    camera = Webcam("rtsp://camera", SteppedClock(), open_capture=lambda _: next(captures))
    camera.read()
    with pytest.raises(CameraLost, match="20000x20000"):
        camera.read()
    assert camera.read() is not None


def test_what_a_source_is() -> None:
    assert [is_device(source) for source in ("0", "12", "/dev/video0", "clip.mp4")] == [True, True, True, False]
    assert [is_address(source) for source in ("rtsp://a/b", "http://a", "/dev/video0")] == [True, True, False]


@pytest.mark.parametrize(
    ("of_driver", "of_device", "expected"),
    [
        (0x84A00001, 0x04200001, True),  # the first device file of a usual webcam
        (0x84A00001, 0x04A00000, False),  # its second one, with metadata only
        (0x00000001, 0, True),  # an old driver, without capabilities of the device
        (0x80001000, 0x00001000, True),  # several planes
        (0x80000002, 0x00000002, False),  # an output
    ],
)
def test_a_device_captures_by_its_own_capabilities(of_driver: int, of_device: int, expected: bool) -> None:
    about = (b"uvcvideo", b"Webcam", b"usb-0000:00:14.0-1", 0x060100)  # driver, card, bus and version
    assert captures(struct.pack("=16s32s32sIII12x", *about, of_driver, of_device)) is expected
