"""Reads .npz files that came from anywhere: arrays only, nothing in them is ever run."""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import HandsteerError

Arrays = dict[str, NDArray[Any]]


class NpzFormat:
    """A kind of .npz file: what it is called, its version, and the errors that tell what is wrong with one.

    Args:
        what: Its name for people, such as ``sign model``.
        version: The version that is known; it stands in the array ``format``.
        missing: Raised when a file cannot be read.
        corrupt: Raised when a file is of another kind or version, or damaged.
        remedy: What people can do then, as the end of a sentence.
    """

    def __init__(
        self, what: str, version: int, *, missing: type[HandsteerError], corrupt: type[HandsteerError], remedy: str
    ) -> None:
        self.what = what
        self.version = version
        self.remedy = remedy
        self._missing = missing
        self._corrupt = corrupt

    def read(self, path: Path) -> Arrays:
        """Return the arrays of the file ``path``, of this kind and version.

        Raises:
            HandsteerError: It cannot be read, or is not such a file; of the types given.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                if not isinstance(file, np.lib.npyio.NpzFile):
                    raise self._corrupt(f"{path}: not a {self.what}; {self.remedy}")
                arrays = {name: file[name] for name in file.files}
        except OSError as error:
            reason = error.strerror or error
            raise self._missing(f"cannot read the {self.what} {path} ({reason}): {self.remedy}") from None
        except HandsteerError:
            raise
        except Exception:  # the readers of headers and of packed data raise whatever they stumble on
            raise self._corrupt(f"{path}: not a {self.what}, or damaged; {self.remedy}") from None
        version = arrays.pop("format", None)
        if version is None or version.shape != () or version != self.version:
            raise self._corrupt(
                f"{path}: a {self.what} of format {version} is not known, expected {self.version}; {self.remedy}"
            )
        return arrays

    def damaged(self, path: Path, reason: object) -> HandsteerError:
        """Return the error that says that the file ``path`` is damaged."""
        return self._corrupt(f"{path}: a damaged {self.what} ({reason}); {self.remedy}")

    def write(self, path: Path, arrays: Mapping[str, Any]) -> None:
        """Write ``arrays`` to ``path``, as a whole or not at all; the same arrays always give the same bytes.

        Raises:
            OSError: There is no such folder, or no place.
        """
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, format=np.array(self.version), **arrays)
            Path(name).chmod(path.stat().st_mode if path.exists() else 0o644)
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
