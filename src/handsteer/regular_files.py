"""Opens files from outside: regular ones only, whose size is checked before anything is read; and replaces files.

Reading a device may never end, and opening a named pipe waits for a writer.
"""

import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


def open_regular(path: Path, most_bytes: int | None = None) -> BinaryIO:
    """Return the regular file ``path``, open for reading; the caller closes it.

    Args:
        path: The file; a link to one is followed.
        most_bytes: Its largest size; None for no limit.

    Raises:
        OSError: It cannot be read, is not a regular file, or is larger; ``strerror`` is the reason, in words.
    """
    if "\0" in str(path):  # Python raises a ValueError
        raise OSError(errno.EINVAL, "its name contains a null character")
    # The flag is for named pipes; it has no effect on regular files.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is a device or a pipe, not a regular file")
        if most_bytes is not None and status.st_size > most_bytes:
            raise OSError(errno.EFBIG, f"it is larger than {most_bytes // 1_000_000} MB, which no such file should be")
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_regular(path: Path, most_bytes: int) -> bytes:
    """Return the content of the regular file ``path``, of at most ``most_bytes``.

    Raises:
        OSError: As :func:`open_regular`.
    """
    with open_regular(path, most_bytes) as file:
        return file.read(most_bytes)


@contextmanager
def replacing(path: Path, mode: int) -> Iterator[BinaryIO]:
    """Open a new file that replaces ``path``, even a link, when the block ends: as a whole or not at all.

    Args:
        path: The file.
        mode: Its permissions, such as those of :func:`mode_of`.

    Raises:
        OSError: The folder does not exist, or there is no space.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        Path(name).chmod(mode)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def mode_of(path: Path, otherwise: int) -> int:
    """Return the permissions of the file ``path``; ``otherwise`` if there is none."""
    return stat.S_IMODE(path.stat().st_mode) if path.exists() else otherwise
