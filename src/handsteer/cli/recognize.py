"""``handsteer recognize``: which sign is it?"""

import json as json_format
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from handsteer.cli.app import ConfigFile, Flag, Parameters, loads
from handsteer.cli.running import say, settings
from handsteer.errors import CameraNotFound, CameraUnreadable, FrameError

if TYPE_CHECKING:
    from handsteer.recognition.recognizer import Recognition, Recognizer


@loads("handsteer.cameras.files", "handsteer.recognition.recognizer", "tqdm")
def recognize(
    source: Path, /, *more: Path, json: Flag = False, config_file: ConfigFile = None, parameters: Parameters = None
) -> int:
    """Print which sign each frame of photos, folders of photos and videos shows.

    Photos are processed independently, the frames of a video like those of a camera. A summary follows on standard
    error.

    For example:
      handsteer recognize photo.jpg         one photo; also *.jpg
      handsteer recognize photos/           all photos of a folder
      handsteer recognize drive.mp4 --json  a video, a line of JSON for each frame

    Parameters
    ----------
    source
        A photo, a folder of photos or a video file.
    more
        Further ones.
    json
        Print one JSON object per line, with the landmarks.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
    """
    from handsteer.cli.installation import fetch_missing
    from handsteer.recognition.recognizer import Recognizer

    config = settings(config_file, parameters)
    sources = (source, *more)
    for each in sources:
        if not each.exists():
            raise CameraNotFound(f"there is no {each}: give a photo, a folder of photos or a video file")
    fetch_missing(config)
    recognizer = Recognizer(config)
    signs: Counter[str] = Counter()
    began_s = time.monotonic()
    for each in sources:
        for result in (_photos if _is_photo(each) else _video)(each, recognizer):
            signs[result.sign] += 1
            print(json_format.dumps(asdict(result)) if json else _text(result), flush=True)
    if signs.total() > 1:
        unit = "photos" if all(map(_is_photo, sources)) else "frames"
        say(_summary(signs, unit, time.monotonic() - began_s))
    return 0


def _is_photo(source: Path) -> bool:
    from handsteer.cameras.files import PHOTO_SUFFIXES

    return source.is_dir() or source.suffix.lower() in PHOTO_SUFFIXES


def _summary(signs: Counter[str], unit: str, took_s: float) -> str:
    total = signs.total()
    shares = ", ".join(f"{sign} {count / total:.0%}" for sign, count in signs.most_common())
    return f"{total} {unit} in {took_s:.1f} s, {total / took_s:.0f} per second: {shares}"


@dataclass(frozen=True)
class _Result:
    """The output for a frame: ``time_s`` is 0 for a photo, ``landmarks`` are image-normalised x, y and z."""

    source: str
    frame: int
    time_s: float
    sign: str
    seen: str
    confidence: float
    handedness: str | None
    landmarks: list[list[float]] | None


def _photos(source: Path, recognizer: "Recognizer") -> Iterator[_Result]:
    from handsteer.cameras.files import find_photos, read_photo

    for path in find_photos(source):
        try:
            recognition = recognizer.recognize(read_photo(path))
        except FrameError as error:
            raise CameraUnreadable(f"{path}: {error}") from None
        yield _result(path, 0, 0.0, recognition)


def _video(path: Path, recognizer: "Recognizer") -> Iterator[_Result]:
    from handsteer.cameras.files import video_frames

    recognizer.reset()
    last_s = 0.0
    for number, frame in enumerate(video_frames(path)):
        recognition = recognizer.step(frame.image, frame.captured_s - last_s)
        last_s = frame.captured_s
        yield _result(path, number, frame.captured_s, recognition)


def _result(source: Path, number: int, time_s: float, recognition: "Recognition") -> _Result:
    hand = recognition.hand
    return _Result(
        source=str(source),
        frame=number,
        time_s=round(time_s, 6),
        sign=recognition.sign,
        seen=recognition.seen,
        confidence=round(recognition.confidence, 4),
        handedness=hand.handedness if hand else None,
        landmarks=[[round(float(value), 5) for value in point] for point in hand.points] if hand else None,
    )


def _text(result: _Result) -> str:
    hand = f"{result.handedness} hand" if result.handedness else "no hand"
    seen = "" if result.seen == result.sign else f", {result.seen} seen"
    where = f"{result.source}  {result.frame:5d}  {result.time_s:8.3f} s"
    return f"{where}  {result.sign:10s}  {result.confidence:4.0%}  {hand}{seen}"
