"""The results of a study: two CSV files that are appended to, a row at a time, and outlive a crash at any moment.

``laps.csv`` has a row per lap, ``forms.csv`` a row per form. A row is on the disk before the next step begins. A
half-written last row, of a process that was killed, is cut off when the file is opened again; to a whole one without an
end of line, as some editors leave it, that is added.
"""

import codecs
import csv
import errno
import io
import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from handsteer.config import Config
from handsteer.errors import StudyError
from handsteer.plugins.study.forms import FORMS
from handsteer.plugins.study.order import Step
from handsteer.plugins.study.plan import NOT_OF_A_LAP, config_hash

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

log = logging.getLogger(__name__)

Row = Mapping[str, Any]

_WHOSE: Final = ("participant", "order", "condition", "input")
_OF_RUN: Final = ("config", "plan", "version", "started_utc")
LAP_COLUMNS: Final = (
    *_WHOSE,
    *(
        "course",
        "practice",
        "lap",
        "outcome",
        "phase",
        "time_s",
        "gates",
        "passed",
        "missed",
        "bumps",
        "score_s",
        "path_m",
    ),
    *_OF_RUN,
)
"""Columns of ``laps.csv``."""

FORM_COLUMNS: Final = (
    *_WHOSE,
    *("form", "score"),
    *(item.name for form in FORMS.values() for item in form.items),
    *_OF_RUN,
)
"""Columns of ``forms.csv``."""

REPEATED: Final = "repeated"
"""Outcome of a lap that does not count, so that it is driven again."""

_LAST_VALUE: Final = re.compile(rb",\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ\r?\Z")
"""By this, the time in UTC, a whole row ends."""

_LARGEST_BYTES: Final = 50_000_000


def prepare(folder: Path) -> None:
    """Create the folder of the results, if necessary.

    Raises:
        StudyError: It cannot be created or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"the results cannot be kept in {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise StudyError(f"the results cannot be kept in {folder}: it cannot be written to")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold an exclusive lock on the existing ``folder``, so that one study at a time writes to it.

    Systems without ``flock`` have no lock; a file system without locks is logged.

    Raises:
        StudyError: Another study holds it.
    """
    if fcntl is None:
        yield  # type: ignore[unreachable]
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StudyError(f"another study writes its results to {folder}: end it first") from None
        except OSError as error:
            log.warning("%s cannot be locked (%s): end other studies that write there", folder, error.strerror)
        yield
    finally:
        os.close(handle)


class Results:
    """The results in a folder.

    Args:
        folder: See :func:`prepare`; only before anything is added, it need not exist.

    Raises:
        StudyError: A file cannot be read, or is not of this version; the message names the line.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._laps = _Table(folder / "laps.csv", LAP_COLUMNS)
        self._forms = _Table(folder / "forms.csv", FORM_COLUMNS)

    def done(self, participant: str, plan: str) -> set[Step]:
        """Return the steps that ``participant`` has finished.

        Args:
            participant: Their id.
            plan: Hash of the plan.

        Raises:
            StudyError: Some are of another plan.
        """
        steps = set()
        for table in (self._laps, self._forms):
            for line, row in table.rows:
                if row["participant"] != participant:
                    continue
                if row["plan"] != plan:
                    raise StudyError(
                        f"{table.path}, line {line}: {participant} began with another plan, or other courses: "
                        "use those, or other --results"
                    )
                if row.get("outcome") != REPEATED:
                    steps.add(_step_of(row, f"{table.path}, line {line}"))
        return steps

    def add_lap(self, row: Row) -> None:
        """Append a row to ``laps.csv``; on return it is on the disk.

        Raises:
            StudyError: It cannot be written.
        """
        self._laps.add(row)

    def add_form(self, row: Row) -> None:
        """Append a row to ``forms.csv``; see :meth:`add_lap`."""
        self._forms.add(row)

    def keep_config(self, config: Config) -> str:
        """Write ``config`` to a file named by its hash, unless it is there already; return the hash.

        Raises:
            StudyError: It cannot be written.
        """
        name = config_hash(config)
        path = self.folder / f"config-{name}.json"
        text = config.model_dump_json(indent=2, exclude=NOT_OF_A_LAP)
        try:
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise StudyError(f"cannot write {path}: {error.strerror}") from None
        return name


class _Table:
    """A CSV file with a fixed header; ``rows`` has those that were there when it was opened, with their lines."""

    def __init__(self, path: Path, columns: tuple[str, ...]) -> None:
        self.path = path
        self._columns = columns
        try:
            self.rows = self._parsed(self._repaired(self._content()))
        except OSError as error:
            raise StudyError(f"cannot use {path}: {error.strerror}") from None

    def add(self, row: Row) -> None:
        line = _line([row.get(name, "") for name in self._columns])
        try:
            size = self.path.stat().st_size if self.path.exists() else 0
            self._append(line if size else _line(self._columns) + line)
        except OSError as error:
            raise StudyError(f"cannot write {self.path}: {error.strerror}") from None

    def _content(self) -> bytes:
        if not self.path.exists():
            return b""
        if self.path.stat().st_size > _LARGEST_BYTES:
            raise StudyError(
                f"{self.path}: is larger than {_LARGEST_BYTES // 1_000_000} MB, which no results should be"
            )
        return self.path.read_bytes()

    def _repaired(self, data: bytes) -> bytes:
        """Return ``data`` with whole rows only; in the file too, the last line is ended or cut off."""
        whole = data[: data.rfind(b"\n") + 1]
        rest = data[len(whole) :]
        header = _line(self._columns)
        start = data.removeprefix(codecs.BOM_UTF8)
        is_ours = header.startswith(start) or start.startswith(header.rstrip())
        if not (rest and is_ours):
            return data
        if _LAST_VALUE.search(rest):
            self._append(end := b"\n" if rest.endswith(b"\r") else b"\r\n")
            return data + end
        log.warning("%s ended in a half-written row, which was cut off: %r", self.path, rest[:1000])
        with self.path.open("r+b") as file:
            file.truncate(len(whole))
            os.fsync(file.fileno())
        return whole

    def _parsed(self, data: bytes) -> list[tuple[int, dict[str, str]]]:
        try:
            reader = csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""), strict=True)
            lines = [(reader.line_num, values) for values in reader]
        except (UnicodeDecodeError, csv.Error) as error:
            raise StudyError(f"{self.path}: is not a CSV file in UTF-8: {error}") from None
        if not lines:
            return []
        if tuple(lines[0][1]) != self._columns:
            raise StudyError(f"{self.path}: has other columns than this version writes: use other --results")
        for line, values in lines[1:]:
            if len(values) != len(self._columns):
                raise StudyError(f"{self.path}, line {line}: has {len(values)} values instead of {len(self._columns)}")
        return [(line, dict(zip(self._columns, values, strict=True))) for line, values in lines[1:]]

    def _append(self, data: bytes) -> None:
        is_new = not self.path.exists()
        # One write of whole rows: a second process that appends cannot come between.
        file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), 0o644)
        size = os.fstat(file).st_size
        try:
            if os.write(file, data) != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(file)
        except OSError:
            os.ftruncate(file, size)  # or the next row would follow half of this one
            raise
        finally:
            os.close(file)
        if is_new and os.name == "posix":  # or the file itself may be lost
            folder = os.open(self.path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def _line(values: Iterable[Any]) -> bytes:
    text = io.StringIO(newline="")
    csv.writer(text).writerow(values)
    return text.getvalue().encode()


def _step_of(row: Mapping[str, str], where: str) -> Step:
    try:
        if "form" not in row:
            practice = {"0": False, "1": True}[row["practice"]]
            return Step("lap", int(row["order"]), row["condition"], row["course"], practice, int(row["lap"]))
        if row["form"] == "consent":
            return Step("consent")
        form = next(name for name in FORMS if name == row["form"])
        return Step("form", int(row["order"]), row["condition"], form=form)
    except (KeyError, ValueError, StopIteration):
        raise StudyError(f"{where}: is not a row that handsteer has written") from None
