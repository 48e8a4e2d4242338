"""What the actions of signs do to the robot, in words, with the configured values."""

from collections.abc import Mapping
from typing import Final

from handsteer import doors
from handsteer.config import ControlConfig
from handsteer.errors import PluginError
from handsteer.types import Action

EFFECTS: Final[Mapping[Action, str]] = {
    "forward": "faster forward; turning ends",
    "backward": "slower, then backward; turning ends",
    "turn_left": "turns faster to the left; keeps its speed",
    "turn_right": "turns faster to the right; keeps its speed",
    "stop": "stops",
    "go": "goes on as it does",
    "turbo": "twice as fast while shown, within the limits",
    "next_robot": "the next robot is driven, once Stop was shown",
}
"""The effect of each action on the robot, in words."""

_POINT_EFFECTS: Final[Mapping[Action, str]] = {
    **EFFECTS,
    "forward": "drives where it points; raise the hand to go faster",
    "backward": "drives back where it points; raise the hand to go faster",
    "turn_left": "turns left in place",
    "turn_right": "turns right in place",
    "go": "drives straight on; keeps its speed",
    "turbo": "goes on as it does",
}
"""The same with ``control.rule: point``."""


def effect_of(action: Action, rule: ControlConfig) -> str:
    """Return the effect of ``action`` on the robot under ``rule``, with steps and limits; for example ``stops``."""
    figures, words = figures_of(action, rule), effect_words(action, rule)
    return f"{words} ({figures})" if figures else words


def effect_words(action: Action, rule: ControlConfig | None) -> str:
    """Return the effect of ``action`` under ``rule``, without figures; None is the default rule."""
    if action not in EFFECTS:
        return _added_effect(action)
    return (_POINT_EFFECTS if rule and rule.rule == "point" else EFFECTS)[action]


def figures_of(action: Action, rule: ControlConfig) -> str:
    """Return the step and the limit of ``action`` under ``rule``; empty if it has none."""
    max_angular, is_timed = rule.max_angular, rule.ramp == "per_second"
    linear = f"{rule.linear_acceleration:g} m/s a second" if is_timed else f"{rule.linear_step:g} m/s a frame"
    angular = f"{rule.angular_acceleration:g} rad/s a second" if is_timed else f"{rule.angular_step:g} rad/s a frame"
    if rule.rule == "point" and action in ("forward", "backward", "turn_left", "turn_right"):
        is_turn = action.startswith("turn")
        return f"up to {min(rule.point_turn, max_angular):g} rad/s" if is_turn else f"up to {rule.max_linear:g} m/s"
    if action in ("forward", "backward"):
        return f"{linear}, up to {rule.max_linear:g} m/s"
    if action in ("turn_left", "turn_right"):
        return f"{angular}, up to {max_angular:g} rad/s"
    return f"up to {rule.max_linear:g} m/s" if action == "turbo" else ""


def _added_effect(action: str) -> str:
    """Return the effect of an action of a plug-in, in words."""
    try:
        return str(doors.ACTIONS.load(action).effect)
    except (PluginError, AttributeError):
        return action.replace("_", " ")
