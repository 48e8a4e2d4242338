"""Recognises the pictures of a folder and prints as JSON what came out: on any processor.

The Python of ``make arm`` has only what handsteer needs, so nothing else is imported here.
"""

import json
import platform
import sys
from pathlib import Path

from handsteer import Recognizer
from handsteer.config import Config


def recognised(folder: Path) -> list[tuple[str, str, list[list[float]] | None]]:
    """Return the name of each picture, its sign, and the (21, 2) landmarks in pixels, if there is a hand."""
    recognizer = Recognizer(Config(landmarks={"reject_resting": False}))  # its model would double the time
    seen = [(path.name, recognizer.recognize(path)) for path in sorted(folder.iterdir())]
    return [(name, each.sign, each.hand.pixels[:, :2].tolist() if each.hand else None) for name, each in seen]


if __name__ == "__main__":
    json.dump({"machine": platform.machine(), "signs": recognised(Path(sys.argv[1]))}, sys.stdout)
