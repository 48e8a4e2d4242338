"""Every error that handsteer raises on purpose.

A message is one line that reports what was wrong, where, and what would be right. Only :mod:`handsteer.cli` prints one
and exits (with code 2).
"""

import difflib
import re
import reprlib
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_SHORT: Final = reprlib.Repr()


class HandsteerError(Exception):
    """Root of all errors raised by handsteer."""


class ConfigError(HandsteerError):
    """A configuration value or file is wrong."""


class CameraError(HandsteerError):
    """A camera cannot be used."""


class CameraNotFound(CameraError):  # noqa: N818 - its base has the suffix
    """There is no such device, file, folder or address."""


class CameraInUse(CameraError):  # noqa: N818
    """The device exists, but another program uses it."""


class CameraUnreadable(CameraError):  # noqa: N818
    """The source opens, but delivers no picture."""


class CameraLost(CameraError):  # noqa: N818
    """The camera stopped delivering pictures; trying again may help."""


class FrameError(HandsteerError):
    """An image has a shape or type that cannot be used."""


class ModelError(HandsteerError):
    """A model file, of landmarks or of signs, cannot be used."""


class ModelMissing(ModelError):  # noqa: N818
    """A model file is not on this machine."""


class ModelCorrupt(ModelError):  # noqa: N818
    """A model file is damaged, or not the expected one."""


class ProfileError(ModelError):
    """A person's profile of the signs cannot be made or used."""


class EvaluationError(HandsteerError):
    """Signs cannot be evaluated: there are no such photos or video, or the report cannot be written."""


class LabelError(EvaluationError):
    """The labels of photos or of a video are missing or wrong."""


class DatasetError(HandsteerError):
    """A dataset of signs, or its sources, cannot be used."""


class TrainingError(HandsteerError):
    """Signs cannot be learnt from a dataset."""


class PoseError(HandsteerError):
    """A hand pose or a script of signs is wrong."""


class WorldError(HandsteerError):
    """A world file or robot description is wrong."""


class BenchError(HandsteerError):
    """A lap of the bench cannot be driven: an interface or a range is wrong, or a world is not a course."""


class StudyError(HandsteerError):
    """The plan of a study, its results or an answer to a form are wrong."""


class RecordingError(HandsteerError):
    """A recording cannot be written, read or replayed."""


class TransportError(HandsteerError):
    """A topic cannot be published or subscribed to."""


class DashboardError(HandsteerError):
    """The web page cannot be served."""


class LiveError(HandsteerError):
    """Topics cannot be served to other programs, or a program asks for them wrongly."""


class PluginError(HandsteerError):
    """A plug-in is not installed, or cannot be loaded or used."""


PLUGIN_FAILURES: Final = (Exception, SystemExit)
"""What the code of a plug-in may raise: one that calls ``sys.exit`` must not end handsteer as if all was well."""


class PackageMissing(HandsteerError):  # noqa: N818
    """A Python package that is needed is not installed."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``: did you mean X?`` with the nearest of the ``known`` words, for a message; empty if none is near."""
    near = difflib.get_close_matches(word, list(known), n=1)
    return f": did you mean {near[0]}?" if near else ""


LONGEST_QUOTE: Final = 60
"""Characters of a text from outside that a message repeats."""


def quoted(value: object, most: int = LONGEST_QUOTE) -> str:
    """Return a value from outside for a message: in quotes if it is a text, printable, on one line, and cut.

    Args:
        value: Anything; of nested lists and tables, the first few are shown.
        most: Characters of a text, before unprintable ones are escaped; of other values, characters in all.
    """
    if isinstance(value, str):
        return repr(str(value) if len(value) <= most else f"{value[: most - 3]}...")
    try:
        words = _SHORT.repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or an object's own repr
        words = f"a {type(value).__name__}"
    return words if len(words) <= most else f"{words[: most - 3]}..."


def as_name(value: object) -> str:
    """Return a name from outside, such as a field's, for a message: quoted unless it is short and printable."""
    text = str(value)
    return text if len(text) <= LONGEST_QUOTE and text.isprintable() else quoted(text)


_PASSWORD = re.compile(r"(?<=://)[^/\s]+@")


def without_passwords(text: str) -> str:
    """Return ``text`` without the user names and passwords of addresses."""
    return _PASSWORD.sub("", text)


def reason_of(error: Exception) -> str:
    """Return why something failed, for a message: of a system error its words without the number."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def install_command(extra: str) -> str:
    """Return the command that adds what an extra of handsteer needs to this installation, however it was made.

    Args:
        extra: One of the extras in ``pyproject.toml``, such as ``plots``.
    """
    import importlib.metadata  # noqa: PLC0415 - it takes longer to load than this module, and is rarely needed
    import importlib.util  # noqa: PLC0415

    of_extra = re.compile(rf"extra == [\"']{extra}[\"']")
    try:
        known = importlib.metadata.requires("handsteer") or []
    except importlib.metadata.PackageNotFoundError:
        known = []
    wanted = [f"'{each.partition(';')[0].strip()}'" for each in known if of_extra.search(each)]
    if not wanted:
        return f"pip install 'handsteer[{extra}]'"
    return f"{_installer(has_pip=importlib.util.find_spec('pip') is not None)} {' '.join(wanted)}"


def _installer(*, has_pip: bool) -> str:
    """Return what installs packages for this Python: pip, else uv wherever it is, else pip, after it is installed."""
    pip = f"{sys.executable} -m pip install"
    if has_pip:
        return pip
    own = Path(sys.executable).with_name("uv")
    uv = "uv" if shutil.which("uv") else str(own) if own.exists() else ""
    return f"{uv} pip install --python {sys.executable}" if uv else f"{sys.executable} -m ensurepip && {pip}"


@contextmanager
def needing(what: str, extra: str, *modules: str) -> Iterator[None]:
    """Report how to install a package that an import within the block lacks.

    Args:
        what: The feature that needs it, for people, such as ``the simulated robot``.
        extra: The extra of handsteer that installs it, such as ``sim``.
        modules: The modules that the extra installs; other import errors are raised unchanged.

    Raises:
        PackageMissing: One of ``modules`` is missing.
    """
    try:
        yield
    except ModuleNotFoundError as problem:
        module = (problem.name or "").partition(".")[0]
        if module not in modules:
            raise
        raise PackageMissing(f"{what} needs the package {module}: run {install_command(extra)}") from None
