"""What a sign does: the table from signs to actions."""

from collections.abc import Iterable, Mapping
from typing import Literal, get_args

from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT, find_sign

Action = Literal["forward", "backward", "turn_left", "turn_right", "stop", "go", "turbo", "next_robot"]
"""Everything that a sign can do to the velocity."""

ACTIONS: tuple[Action, ...] = get_args(Action)
MOTION_ACTIONS: frozenset[Action] = frozenset({"forward", "backward", "turn_left", "turn_right", "turbo"})
"""The actions that can make a robot move, or move faster."""

EFFECTS: Mapping[Action, str] = {
    "forward": "faster forward; turning ends",
    "backward": "slower, then backward; turning ends",
    "turn_left": "turns faster to the left; keeps its speed",
    "turn_right": "turns faster to the right; keeps its speed",
    "stop": "stops",
    "go": "goes on as it does",
    "turbo": "twice as fast while shown, within the limits",
    "next_robot": "the next robot is driven, once Stop was shown",
}
"""What each action makes the robot do, in words."""

BUILT_IN: Mapping[str, Action] = {
    FORWARD: "forward",
    BACKWARD: "backward",
    TURN_LEFT: "turn_left",
    TURN_RIGHT: "turn_right",
    GO: "go",
    STOP: "stop",
    NONE: "stop",
}
"""The rule of the ROS 101 course, chapter 12."""

ALWAYS_STOP = frozenset({STOP, NONE})
"""What stops the robot whatever the configuration says."""


def action_of(sign: str, given: Mapping[str, Action]) -> Action:
    """Return what ``sign`` does: as ``given`` says, else as built in; an unknown word changes nothing, as ``Go``.

    Names in ``given`` may have any case, and ``_`` or ``-`` for spaces.
    """
    name = find_sign(sign, given)
    return given[name] if name is not None else BUILT_IN.get(sign, "go")


def motion_signs(given: Mapping[str, Action], signs: Iterable[str] = ()) -> frozenset[str]:
    """Return the signs, of ``signs`` and of those that are named, that can make the robot move.

    Args:
        given: Actions that go before what is built in.
        signs: Further signs, by their own names.
    """
    return frozenset(sign for sign in {*BUILT_IN, *given, *signs} if action_of(sign, given) in MOTION_ACTIONS)
