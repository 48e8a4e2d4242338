"""The choice between cameras while a node reads from them."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.cameras import Camera, Frame
from handsteer.cameras import webcam as webcam_module
from handsteer.cameras.browser import BrowserCamera
from handsteer.cameras.choice import BROWSER, OWN, CameraChoice, ChoiceOfCameras, Size
from handsteer.cameras.choose import MachineCameras, open_camera
from handsteer.cameras.files import VideoFile
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config
from handsteer.errors import CameraError, CameraInUse, CameraNotFound
from tests.cameras.test_browser import choice, sent


class Device:
    """A webcam that knows whether it is open; it opens itself again when it is read, as a real one."""

    period_s = None

    def __init__(self, name: str, size: Size) -> None:
        self.name, self.size = name, size
        self.is_open = True

    def read(self) -> Frame:
        self.is_open = True
        return Frame(np.zeros((*self.size[::-1], 3), np.uint8), 0.0)

    def close(self) -> None:
        self.is_open = False


class Devices:
    """Two webcams, of which one device is open at a time, and one that another program uses."""

    own: CameraChoice | None = CameraChoice(OWN, "webcam 0", has_sizes=True)
    size = (640, 480)

    def __init__(self) -> None:
        self.opened: list[Device] = []

    def find(self) -> tuple[CameraChoice, ...]:
        assert self.own is not None
        return (self.own, *(CameraChoice(source, source, has_sizes=True) for source in ("/dev/video1", "/dev/video2")))

    def open(self, source: str, size: Size) -> Camera:
        assert not any(each.is_open for each in self.opened), "the one before is closed first"
        if source == "/dev/video2" or size == (4096, 4096):
            raise CameraInUse(f"{source} is in use by another program")
        self.opened.append(Device("webcam 0" if source == OWN else source, size))
        return self.opened[-1]


def two_webcams() -> tuple[ChoiceOfCameras, Devices]:
    devices = Devices()
    cameras = ChoiceOfCameras(devices.open(OWN, devices.size), BrowserCamera(SteppedClock(0.0)), devices)
    cameras.find()
    return cameras, devices


def test_the_machines_own_camera_comes_back_only_when_it_is_chosen() -> None:
    cameras = choice(SteppedClock(0.0))
    assert (cameras.source, cameras.name) == (OWN, "virtual hand")
    assert cameras.read() is not None
    cameras.choose(BROWSER)
    assert cameras.read() is None
    assert (cameras.source, cameras.name, cameras.period_s) == (BROWSER, "browser's camera", None)
    assert cameras.read() is None
    cameras.choose(OWN)
    assert cameras.read() is not None
    assert cameras.period_s == 1 / 30


def test_a_device_is_closed_while_another_camera_is_used_so_that_it_keeps_no_old_frame() -> None:
    cameras, devices = two_webcams()
    for source in (BROWSER, "/dev/video1"):
        done = cameras.choose(source)
        cameras.browser.offer(sent(0.0))
        cameras.read()
        done.result(0)
        assert [each.is_open for each in devices.opened[:1]] == [False]
    assert cameras.name == "/dev/video1"
    cameras.choose(OWN)
    cameras.read()
    assert [(each.name, each.is_open) for each in devices.opened] == [
        ("webcam 0", False),
        ("/dev/video1", False),
        ("webcam 0", True),
    ]


def test_a_camera_with_a_pace_of_its_own_is_closed_too_but_not_the_one_of_the_start() -> None:
    class Paced(Device):
        period_s = 0.1  # type: ignore[assignment]

    class Paces(Devices):
        def open(self, source: str, size: Size) -> Camera:
            self.opened.append(Paced(source, size))
            return self.opened[-1]

    devices = Paces()
    cameras = ChoiceOfCameras(devices.open(OWN, devices.size), BrowserCamera(SteppedClock(0.0)), devices)
    cameras.find()
    for source in ("/dev/video1", "/dev/video2", OWN):
        cameras.choose(source)
        cameras.read()
    assert [(each.name, each.is_open) for each in devices.opened] == [
        (OWN, True),
        ("/dev/video1", False),
        ("/dev/video2", False),
    ]


def test_another_resolution_opens_the_camera_again_and_stays() -> None:
    cameras, devices = two_webcams()
    cameras.choose(OWN, (320, 240))
    frame = cameras.read()
    assert frame is not None
    assert frame.image.shape == (240, 320, 3)
    cameras.choose("/dev/video1")
    cameras.read()
    assert (cameras.size, devices.opened[-1].size) == ((320, 240), (320, 240))


@pytest.mark.parametrize(("source", "size"), [("/dev/video2", None), ("/dev/video1", (4096, 4096))])
def test_a_camera_that_does_not_open_leaves_the_one_before_in_use(source: str, size: Size | None) -> None:
    cameras, devices = two_webcams()
    done = cameras.choose(source, size)
    assert cameras.read() is not None
    with pytest.raises(CameraInUse, match=f"{source} is in use"):
        done.result(0)
    assert (cameras.source, cameras.name, cameras.size) == (OWN, "webcam 0", (640, 480))
    assert devices.opened[0].is_open


def test_each_change_is_told_when_it_is_asked_for_and_before_the_first_frame() -> None:
    cameras, _ = two_webcams()
    told: list[str] = []
    cameras.on_change = lambda: told.append(cameras.name)
    cameras.choose("/dev/video1")
    assert told == ["webcam 0"]
    cameras.read()
    assert told == ["webcam 0", "/dev/video1"]
    cameras.choose("/dev/video2")
    cameras.read()
    assert told[2:] == ["/dev/video1"] * 2  # also a camera that was opened again after a failure is another one


def test_only_what_is_in_the_list_can_be_chosen() -> None:
    cameras, devices = two_webcams()
    for source in ("/etc/passwd", "/dev/video9", ""):
        with pytest.raises(CameraNotFound, match="not in the list"):
            cameras.choose(source)
    cameras.read()
    assert len(devices.opened) == 1


def test_the_last_of_several_choices_counts() -> None:
    cameras, devices = two_webcams()
    first, last = cameras.choose("/dev/video2"), cameras.choose("/dev/video1")
    with pytest.raises(CameraError, match="meanwhile"):
        first.result(0)
    cameras.read()
    last.result(0)
    assert [each.name for each in devices.opened] == ["webcam 0", "/dev/video1"]


def machine(source: str, **more: object) -> tuple[MachineCameras, Camera]:
    config = Config.model_validate({"camera": {"source": source, "width": 64, "height": 48, **more}})
    own = open_camera(config, SteppedClock())
    return MachineCameras(config, SteppedClock(), own), own


def test_the_list_has_the_named_source_the_virtual_hand_and_the_webcams_found(
    tmp_path: Path, clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("video10", "video2", "video0", "null"):
        (tmp_path / name).touch()
    monkeypatch.setattr(webcam_module, "_DEVICES", tmp_path)
    webcams = [str(tmp_path / name) for name in ("video0", "video2", "video10")]
    named, own = machine(str(clip))
    assert isinstance(own, VideoFile)
    assert [(each.source, each.name) for each in named.find()] == [
        (OWN, "clip.avi"),
        ("virtual", "virtual hand"),
        *((path, path) for path in webcams),
    ]
    (tmp_path / "video2").unlink()
    assert len(named.find()) == 4
    assert [each.source for each in machine("virtual")[0].find()] == [OWN, webcams[0], webcams[2]]


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    path = tmp_path / "clip.avi"
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10, (64, 48))
    for level in (50, 100, 150):
        video.write(np.full((48, 64, 3), level, np.uint8))
    video.release()
    return path


def test_a_file_goes_on_where_it_was_left_and_keeps_its_own_pace_and_size(clip: Path) -> None:
    named, own = machine(str(clip), at_end="hold")
    cameras = ChoiceOfCameras(own, BrowserCamera(SteppedClock()), named)
    cameras.find()

    def level() -> int:
        frame = cameras.read()
        assert frame is not None
        return round(float(frame.image.mean()) / 50)

    assert (level(), cameras.period_s) == (1, 0.1)
    cameras.choose("virtual", (320, 240))
    frame = cameras.read()
    assert frame is not None
    assert (frame.image.shape, cameras.period_s) == ((48, 64, 3), 1 / 30)
    cameras.choose(OWN)
    assert (level(), cameras.period_s) == (2, 0.1)


def test_names_hide_folders_and_what_an_address_has_besides_the_host() -> None:
    class Stream(Device):
        source = "rtsp://user:secret@10.0.0.7:554/live?token=secret"

    config = Config(camera=CameraConfig(source=Stream.source))
    named = MachineCameras(config, SteppedClock(), Stream(Stream.source, (64, 48)))
    assert named.own == CameraChoice(OWN, "rtsp://10.0.0.7")
    config = Config(camera=CameraConfig(source="browser"))
    without = MachineCameras(config, SteppedClock(), Device("", (1, 1)))
    assert without.own is None
    assert without.find()[0].source == "virtual"
