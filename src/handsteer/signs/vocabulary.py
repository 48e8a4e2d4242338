"""The signs, by the names that travel on ``/gesture/hand_sign``; all from the user's own point of view."""

from collections.abc import Iterable

STOP = "Stop"
FORWARD = "Forward"
BACKWARD = "Backward"
TURN_RIGHT = "Turn Right"
TURN_LEFT = "Turn Left"
GO = "Go"
NONE = "NONE"
"""No hand, or a hand that shows none of the signs."""

SIGNS = (STOP, FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT, GO)
MOTION_SIGNS = frozenset({FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT})
"""The signs that can make a robot move."""


def find_sign(name: str, known: Iterable[str]) -> str | None:
    """Return the sign of ``known`` that ``name`` means, whatever its case, spaces, ``_`` and ``-``; None if none does.

    So ``TurnRight``, ``turn_right`` and ``turn right`` all mean ``Turn Right``.
    """
    return next((sign for sign in known if _bare(sign) == _bare(name)), None)


def _bare(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter not in " _-\t")
