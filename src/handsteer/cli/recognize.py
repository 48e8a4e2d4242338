"""``handsteer recognize``: which sign is it?"""

import json as json_format
from pathlib import Path

from handsteer.cli.options import ConfigFile, Flag, Parameters
from handsteer.cli.running import settings
from handsteer.recognition.recognizer import Recognizer
from handsteer.recognize import FrameResult
from handsteer.recognize import recognize as results


def recognize(
    source: Path, /, *, json: Flag = False, config_file: ConfigFile = None, parameters: Parameters = None
) -> int:
    """Print which sign each frame of a photo, a folder of photos or a video shows.

    Example: handsteer recognize drive.mp4 --json

    Parameters
    ----------
    source
        A photo, a folder of photos or a video file.
    json
        Print one JSON object a line, with the landmarks.
    config_file
        YAML file with parameters; those given here go before it.
    """
    recognizer = Recognizer(settings(config_file, parameters))
    for result in results(source, recognizer):
        print(json_format.dumps(result.as_dict()) if json else _text(result), flush=True)
    return 0


def _text(result: FrameResult) -> str:
    hand = f"{result.handedness} hand" if result.handedness else "no hand"
    seen = "" if result.seen == result.sign else f", {result.seen} seen"
    where = f"{result.source}  {result.frame:5d}  {result.time_s:8.3f} s"
    return f"{where}  {result.sign:10s}  {result.confidence:4.0%}  {hand}{seen}"
