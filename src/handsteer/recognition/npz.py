"""Reads untrusted .npz files: arrays only; nothing in them is executed."""

import math
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import HandsteerError, quoted
from handsteer.regular_files import mode_of, open_regular, replacing

Arrays = dict[str, NDArray[Any]]
Content = TypeVar("Content")

LARGEST_BYTES: Final = 256_000_000
"""Maximum size of all arrays of a file together; half a million hands take as much."""

MOST_ARRAYS: Final = 100

_LONGEST_REASON: Final = 160
_LAST_CHARACTER: Final = 0x10FFFF
_SURROGATES: Final = 0xD800 >> 11
_KINDS: Final = frozenset("biufU")


@dataclass(frozen=True)
class NpzFormat:
    """A kind of .npz file: its name, version and errors.

    Attributes:
        what: Its name in messages, such as ``sign model``.
        version: The supported version, stored in the array ``format``.
        missing: Raised if a file cannot be read.
        corrupt: Raised if a file is of another kind or version, or damaged.
        remedy: What users can do then, as the end of a sentence.
    """

    what: str
    version: int
    missing: type[HandsteerError]
    corrupt: type[HandsteerError]
    remedy: str

    def read(self, path: Path, build: Callable[[Arrays], Content], most_bytes: int = LARGEST_BYTES) -> Content:
        """Return the content of the file ``path``, of this kind and version.

        Args:
            path: The file.
            build: Makes the content from the arrays; an error of any type means that the file is damaged.
            most_bytes: Maximum size of all arrays together.

        Raises:
            HandsteerError: It cannot be read, or is not such a file; ``missing`` or ``corrupt``.
        """
        arrays = self._arrays(path, most_bytes)
        try:
            return build(arrays)
        except KeyError as error:
            missing = f"there is no {quoted(str(error.args[0]))} in it"
            raise self.corrupt(f"{path}: a damaged {self.what}, or another file: {missing}; {self.remedy}") from None
        except Exception as error:
            reason = str(error)[:_LONGEST_REASON]
            raise self.corrupt(f"{path}: a damaged {self.what} ({reason}); {self.remedy}") from None

    def _arrays(self, path: Path, most_bytes: int) -> Arrays:
        try:
            with open_regular(path, most_bytes) as content, zipfile.ZipFile(content) as file:
                _check_sizes(file, most_bytes)
                arrays = {entry.filename.removesuffix(".npy"): _array(file, entry) for entry in file.infolist()}
        except OSError as error:
            reason = error.strerror or error
            raise self.missing(f"cannot read the {self.what} {path} ({reason}): {self.remedy}") from None
        except _RefusedError as problem:
            raise self.corrupt(f"{path}: not a {self.what}: {problem}; {self.remedy}") from None
        except Exception:  # the readers of headers and of compressed data raise errors of any type
            raise self.corrupt(f"{path}: not a {self.what}, or damaged; {self.remedy}") from None
        version = arrays.pop("format", None)
        if version is None or version.shape != () or version != self.version:
            known = f"is not known, expected {self.version}"
            raise self.corrupt(f"{path}: a {self.what} of format {_in_words(version)} {known}; {self.remedy}")
        return arrays

    def write(self, path: Path, arrays: Mapping[str, Any]) -> None:
        """Write ``arrays`` to ``path``, atomically and deterministically.

        Raises:
            OSError: The folder does not exist, or there is no space.
        """
        path = path.resolve()  # a link stays one
        with replacing(path, mode_of(path, 0o644)) as file:
            np.savez(file, format=np.array(self.version), **arrays)


class _RefusedError(Exception):
    pass


def _check_sizes(file: zipfile.ZipFile, most_bytes: int) -> None:
    """Check the sizes in the directory of ``file``; no more than that is decompressed of any entry."""
    entries = file.infolist()
    if len(entries) > MOST_ARRAYS:
        raise _RefusedError(f"it has {len(entries)} arrays")
    size = sum(entry.file_size for entry in entries)
    if size > most_bytes:
        raise _RefusedError(f"its arrays have {size / 1e6:.0f} MB, and should have at most {most_bytes / 1e6:.0f}")


def _array(file: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    """Return the array of ``entry``, without reading more than the directory specifies."""
    with file.open(entry) as stream:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read_header(stream)
    # With Python's integers, because the number of elements may overflow a machine's.
    if kind.kind not in _KINDS:
        raise _RefusedError(f"its array {entry.filename[:60]!r} is neither of numbers nor of text")
    if math.prod(shape) * kind.itemsize > entry.file_size:
        raise _RefusedError(f"its array {entry.filename[:60]!r} claims to be larger than it is")
    with file.open(entry) as stream:
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    if kind.kind == "U" and not _is_text(array):
        raise _RefusedError(f"its array {entry.filename[:60]!r} contains invalid characters")
    return array


def _is_text(array: NDArray[Any]) -> bool:
    """Return whether ``array``, of kind U, has only valid Unicode characters; others crash Python."""
    codes = np.frombuffer(array.tobytes(), np.dtype("u4").newbyteorder(array.dtype.byteorder))
    return not ((codes > _LAST_CHARACTER) | ((codes >> 11) == _SURROGATES)).any()


def _in_words(version: NDArray[Any] | None) -> str:
    return " ".join(str(version).split())[:_LONGEST_REASON]
