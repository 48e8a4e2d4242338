"""Drive a mobile robot with your hand signs.

>>> from handsteer import Recognizer
>>> Recognizer().recognize(image).sign
'Forward'

:class:`Recognizer` recognises the signs in pictures, :class:`Teleop` converts a stream of images to velocities,
:class:`Config` has all parameters, and :class:`Velocity` is a command to a robot. Start reading at
:mod:`handsteer.teleop`, then :mod:`handsteer.graph`, which has the same parts as nodes joined by topics.
"""

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from handsteer.config import Config
    from handsteer.recognition.recognizer import Recognizer
    from handsteer.teleop import Teleop
    from handsteer.types import Velocity

__version__ = "0.2.0"
__all__ = ["Config", "Recognizer", "Teleop", "Velocity"]

_HOMES: Final = {
    "Config": "handsteer.config",
    "Recognizer": "handsteer.recognition.recognizer",
    "Teleop": "handsteer.teleop",
    "Velocity": "handsteer.types",
}


def __getattr__(name: str) -> Any:
    """Load public names on first use, so that the command line and each node load only what they need."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # First: it loads the parameters of plug-ins, whose modules may import any other, which must not be half loaded.
    importlib.import_module("handsteer.config")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
