"""Shared by the verbs: logging, settings, messages, tables and exit codes."""

import errno
import gc
import io
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from handsteer.cli.signals import ending
from handsteer.errors import HandsteerError, quoted

if TYPE_CHECKING:
    from handsteer.config import Config


_NO_SPACE = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)
# Raised by what looks at a path, before it is opened.
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.ENAMETOOLONG, errno.ELOOP)
# 128 + SIGPIPE, as standard tools; 0 would mean that a check has found nothing.
_READER_HAS_LEFT = 141


def set_up_logging() -> None:
    """Log to standard error; from libraries, warnings only. What standard output cannot show becomes ``?``."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")
    logging.basicConfig(level=logging.INFO, format="handsteer: %(message)s", stream=sys.stderr)
    for noisy in ("uvicorn", "asyncio", "httpx", "watchfiles", "rospy"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def exit_code(call: Callable[[], int | None]) -> int:
    """Return the exit code of ``call``: 2, with a message, if the input was wrong; 141 if the output has no reader."""
    try:
        code = call() or 0
        if sys.stdout is not None:
            sys.stdout.flush()  # what cannot be written is found now
        return code
    except HandsteerError as error:
        return fail(str(error))
    except BrokenPipeError:  # the reader of the output has ended, as `head` does
        _discard(sys.stdout)
        return _READER_HAS_LEFT
    except OSError as error:
        if error.errno in _NOT_ALLOWED and error.filename is not None:
            return fail(f"cannot use {quoted(error.filename)}: {error.strerror}")
        if error.errno not in _NO_SPACE:
            raise
        _discard(sys.stdout)
        return fail(f"cannot write the output: {error.strerror}")


def _discard(stream: TextIO) -> None:
    """Discard what was not written yet to ``stream``: Python's last steps would try again, and fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def fail(message: str) -> int:
    """Print what was wrong with the input; return the exit code, also if it cannot be printed."""
    try:
        say(" ".join(message.split()))
    except OSError:
        _discard(sys.stderr)
    return 2


def settings(
    file: Path | None,
    given: dict[str, Any] | None,
    shorthand: dict[str, Any] | None = None,
    base: dict[str, Any] | None = None,
    service: dict[str, Any] | None = None,
) -> "Config":
    """Return the parameters.

    Each overrides the ones before: the defaults, ``base``, the file, a graph's parameter ``service``, the shorthand
    options, and the options with a full name.
    """
    from handsteer import config  # this module is loaded for help too

    short = {
        section: {name: value for name, value in values.items() if value is not None}
        for section, values in (shorthand or {}).items()
    }
    return config.load(file, base or {}, service or {}, short, given or {})


def default_file() -> Path | None:
    """Return the file that a start without --config reads, and print its name; None if it does not exist."""
    from handsteer.config import DEFAULT_FILE  # this module is loaded for help too

    if not DEFAULT_FILE.exists():
        return None
    say(f"parameters from {DEFAULT_FILE.absolute()}")
    return DEFAULT_FILE


def check_writable(
    option: str, path: Path, error: type[HandsteerError], replaces: Callable[[Path], object] | None = None
) -> None:
    """Check that the file ``path``, which ``option`` names, can be written, before the work rather than after it.

    Args:
        option: For messages.
        path: The file.
        error: Type of the error raised.
        replaces: Reads a file of the kind that is written; one that it cannot read is not replaced.

    Raises:
        HandsteerError: It cannot, or it exists and is another kind of file; of the given type.
    """
    folder = path.absolute().parent
    if not folder.is_dir():
        raise error(f"{option}: there is no folder {folder} for {path.name}")
    if path.is_dir():
        raise error(f"{option}: {path} is a folder: give the name of a file")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as problem:
        raise error(f"{option}: cannot write {path}: {problem.strerror}") from None
    if replaces is None or not path.exists():
        return
    try:
        replaces(path)
    except (HandsteerError, OSError, ValueError):
        raise error(f"{option}: {path} exists, and is not such a file: give another name, or move it away") from None


def printable(line: str) -> str:
    """Return ``line`` without what controls a terminal, which names in files of others may contain."""
    return "".join(each if each.isprintable() else "?" for each in line)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """Return a table as text; columns after the first ``text_columns`` are aligned to the right."""
    from rich.console import Console  # this module is loaded for help too
    from rich.table import Table
    from rich.text import Text

    grid = Table(box=None, pad_edge=False)
    for column, name in enumerate(head):
        grid.add_column(Text(name), justify="left" if column < text_columns else "right", no_wrap=True)
    for row in rows:
        grid.add_row(*map(Text, row))
    # Wide enough never to wrap: another program may read the lines.
    console = Console(width=10_000, color_system=None, force_terminal=False)
    with console.capture() as text:
        console.print(grid)
    return "\n".join(line.rstrip() for line in text.get().splitlines())


def say(message: str) -> None:
    """Print a message to standard error."""
    print(f"handsteer: {message}", file=sys.stderr, flush=True)


def freeze_loaded_objects() -> None:
    """Exclude everything loaded so far from garbage collection, which would pause all threads to search it."""
    gc.freeze()
    gc.enable()


@contextmanager
def signals_ignored() -> Iterator[None]:
    """Ignore what would end the program in this block: a second Ctrl-C must not keep the robot from stopping."""
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in ending()}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
