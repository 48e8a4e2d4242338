"""The folder of the recordings that are started on the page."""

import datetime
import re
from pathlib import Path

from handsteer.errors import RecordingError

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,100}\.mcap", re.ASCII)
_MOST_OF_ONE_SECOND = 100


class RecordingFolder:
    """A folder of recordings.

    Args:
        path: The folder; it need not exist yet.

    Attributes:
        path: The absolute path of the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.expanduser().absolute()

    def new(self, now: datetime.datetime) -> Path:
        """Return the path of a recording that begins ``now``, such as ``handsteer-2026-11-22T22-20-00.mcap``.

        Raises:
            RecordingError: The folder cannot be created.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingError(f"cannot create the folder {self.path}: {error.strerror}") from None
        begin = f"handsteer-{now:%Y-%m-%dT%H-%M-%S}"
        names = (begin, *(f"{begin}-{number}" for number in range(2, _MOST_OF_ONE_SECOND)))
        for path in (self.path / f"{name}.mcap" for name in names):
            if not path.exists():
                return path
        raise RecordingError(f"{self.path} has too many recordings of this second: try again")

    def find(self, name: str) -> Path | None:
        """Return the recording of this name; None if the folder has none, whatever ``name`` is."""
        path = self.path / name if _NAME.fullmatch(name) else None
        return path if path is not None and path.is_file() and not path.is_symlink() else None
