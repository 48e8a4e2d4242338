"""Recognises the signs in photos and videos, frame by frame, without a robot."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from handsteer.cameras.files import PHOTO_SUFFIXES, find_photos, read_photo, video_frames
from handsteer.errors import CameraNotFound
from handsteer.recognition.recognizer import Recognition, Recognizer


@dataclass(frozen=True)
class FrameResult:
    """The result for one frame.

    Attributes:
        source: Path of the photo or video.
        frame: Index of the frame in its source, from 0.
        time_s: Time in the video, in seconds; 0 for a photo.
        sign: The confirmed sign: in a video over time, in a photo the one seen.
        seen: The sign that this frame alone shows.
        confidence: Confidence of ``seen``, 0 to 1.
        handedness: ``Left`` or ``Right``, the person's own; None without a hand.
        landmarks: The 21 landmarks, image-normalised x, y and z; None without a hand.
    """

    source: str
    frame: int
    time_s: float
    sign: str
    seen: str
    confidence: float
    handedness: str | None
    landmarks: list[list[float]] | None

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


def recognize(source: Path, recognizer: Recognizer) -> Iterator[FrameResult]:
    """Yield the result of each frame of a photo, a folder of photos or a video.

    Photos are processed independently; a video as a camera's stream.

    Raises:
        CameraNotFound: There is no such file or folder, or it contains no photos.
        CameraUnreadable: A file cannot be decoded.
    """
    if not source.exists():
        raise CameraNotFound(f"there is no {source}: give a photo, a folder of photos or a video file")
    if source.is_dir() or source.suffix.lower() in PHOTO_SUFFIXES:
        return _photos(find_photos(source), recognizer)
    return _video(source, recognizer)


def _photos(paths: list[Path], recognizer: Recognizer) -> Iterator[FrameResult]:
    for path in paths:
        yield _result(str(path), 0, 0.0, recognizer.recognize(read_photo(path)))


def _video(path: Path, recognizer: Recognizer) -> Iterator[FrameResult]:
    last_s = 0.0
    for number, frame in enumerate(video_frames(path)):
        recognition = recognizer.step(frame.image, frame.captured_s - last_s)
        last_s = frame.captured_s
        yield _result(str(path), number, frame.captured_s, recognition)


def _result(source: str, number: int, time_s: float, recognition: Recognition) -> FrameResult:
    hand = recognition.hand
    return FrameResult(
        source=source,
        frame=number,
        time_s=round(time_s, 6),
        sign=recognition.sign,
        seen=recognition.seen,
        confidence=round(recognition.confidence, 4),
        handedness=hand.handedness if hand else None,
        landmarks=[[round(float(value), 5) for value in point] for point in hand.points] if hand else None,
    )
