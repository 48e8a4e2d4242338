from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.cameras import Camera, EndOfStream
from handsteer.cameras.files import PhotoFolder, VideoFile, find_photos
from handsteer.clock import SteppedClock
from handsteer.errors import CameraNotFound, CameraUnreadable
from handsteer.testing.camera_contract import CameraContract

FRAMES = 6


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """Six grey frames at 12 frames a second, each brighter than the one before."""
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 12.0, (64, 48))
    for number in range(FRAMES):
        writer.write(np.full((48, 64, 3), 30 * number, np.uint8))
    writer.release()
    return path


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    (folder / "more").mkdir(parents=True)
    for name, grey in (("b.png", 100), ("a.JPG", 50), ("more/c.png", 150)):
        assert cv2.imwrite(str(folder / name), np.full((48, 64, 3), grey, np.uint8))
    (folder / "notes.txt").write_text("not a photo")
    return folder


class TestVideoFile(CameraContract):
    @pytest.fixture
    def camera(self, video: Path, clock: SteppedClock) -> Camera:
        return VideoFile(video, clock)


class TestPhotoFolder(CameraContract):
    @pytest.fixture
    def camera(self, photos: Path, clock: SteppedClock) -> Camera:
        return PhotoFolder(photos, clock)


def greys(camera: Camera, count: int) -> Iterator[int | None]:
    for _ in range(count):
        frame = camera.read()
        yield None if frame is None else round(float(frame.image.mean()) / 10) * 10


def test_a_video_gives_its_frames_with_their_time_and_pace(video: Path) -> None:
    clock = SteppedClock(5.0)
    camera = VideoFile(video, clock, "end")
    assert camera.period_s == pytest.approx(1 / 12)
    frame = camera.read()
    assert frame is not None
    assert frame.image.shape == (48, 64, 3)
    assert frame.captured_s == 5.0
    assert list(greys(camera, FRAMES - 1)) == [30, 60, 90, 120, 150]
    with pytest.raises(EndOfStream):
        camera.read()


def test_a_video_loops(video: Path) -> None:
    assert list(greys(VideoFile(video, SteppedClock(), "loop"), 8)) == [0, 30, 60, 90, 120, 150, 0, 30]


def test_a_video_holds(video: Path) -> None:
    assert list(greys(VideoFile(video, SteppedClock(), "hold"), 8))[-2:] == [None, None]


def test_photos_are_shown_in_order_each_for_its_time(photos: Path) -> None:
    camera = PhotoFolder(photos, SteppedClock(), photo_duration_s=0.2, fps=10, at_end="end")
    assert list(greys(camera, 6)) == [50, 50, 100, 100, 150, 150]
    with pytest.raises(EndOfStream):
        camera.read()


def test_photos_loop_and_hold(photos: Path) -> None:
    looping = PhotoFolder(photos, SteppedClock(), photo_duration_s=0.1, fps=10, at_end="loop")
    assert list(greys(looping, 4)) == [50, 100, 150, 50]
    holding = PhotoFolder(photos, SteppedClock(), photo_duration_s=0.1, fps=10, at_end="hold")
    assert list(greys(holding, 4)) == [50, 100, 150, None]


def test_a_broken_photo_is_said_once_and_left_out(photos: Path) -> None:
    (photos / "b.png").write_bytes(b"no picture")
    camera = PhotoFolder(photos, SteppedClock(), photo_duration_s=0.1, fps=10, at_end="end")
    assert list(greys(camera, 1)) == [50]
    with pytest.raises(CameraUnreadable, match=r"b\.png is not a photo that can be decoded"):
        camera.read()
    assert list(greys(camera, 1)) == [150]


def test_one_photo_is_a_camera_too(photos: Path) -> None:
    assert list(greys(PhotoFolder(photos / "b.png", SteppedClock(), fps=2), 3)) == [100, 100, 100]


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(b"no video" * 100)
    with pytest.raises(CameraUnreadable, match=r"broken\.mp4 is not a video that can be decoded: try"):
        VideoFile(broken, SteppedClock())
    with pytest.raises(CameraNotFound, match=r"there is no video file .*gone\.mp4"):
        VideoFile(tmp_path / "gone.mp4", SteppedClock())
    with pytest.raises(CameraNotFound, match=r"there are no photos in .*: expected files such as"):
        PhotoFolder(tmp_path, SteppedClock())


@pytest.mark.parametrize("suffix", [".webp", ".bmp", ".TIFF"])
def test_a_picture_of_another_kind_is_not_taken_for_a_video(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"hand{suffix}"
    cv2.imwrite(str(path), np.full((48, 64, 3), 90, np.uint8))
    with pytest.raises(CameraUnreadable, match=r"is a picture that is neither a JPEG nor a PNG file: convert it"):
        VideoFile(path, SteppedClock())


def test_pictures_of_another_kind_in_a_folder_are_counted(photos: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("x.webp", "y.heic"):
        (photos / name).write_bytes(b"")
    assert not {path.name for path in find_photos(photos)} & {"x.webp", "y.heic"}
    (line,) = [record.message for record in caplog.records]
    assert "2 pictures" in line
    assert "x.webp" in line
