"""Describes the effect of signs in words, with the configured values, and converts these to and from diagnostics."""

import json
from collections.abc import Mapping
from functools import lru_cache

from handsteer.config import ControlConfig, validate
from handsteer.errors import ConfigError
from handsteer.types import EFFECTS, Action

_TOLD = tuple(sorted(ControlConfig.live))


def effect_of(action: Action, rule: ControlConfig) -> str:
    """Return the effect of ``action`` on the robot under ``rule``, with steps and limits; for example ``stops``."""
    figures = figures_of(action, rule)
    return f"{EFFECTS[action]} ({figures})" if figures else EFFECTS[action]


def rule_to_diagnostics(rule: ControlConfig) -> dict[str, str]:
    """Return the settings that determine the effect of signs, as values for ``/diagnostics``."""
    return {name: json.dumps(getattr(rule, name)) for name in _TOLD}


def rule_from_diagnostics(values: Mapping[str, str]) -> ControlConfig | None:
    """Return the settings in a report of :func:`rule_to_diagnostics`, defaults for missing ones; None if invalid."""
    return _rule_of(tuple(values.get(name, "") for name in _TOLD))


# Reports arrive ten times a second and are nearly always the same.
@lru_cache(maxsize=8)
def _rule_of(texts: tuple[str, ...]) -> ControlConfig | None:
    try:
        return validate(ControlConfig, {name: json.loads(text) for name, text in zip(_TOLD, texts, strict=True)})
    except (ValueError, ConfigError):
        return None


def figures_of(action: Action, rule: ControlConfig) -> str:
    """Return the step and the limit of ``action`` under ``rule``; empty if it has none."""
    is_timed = rule.ramp == "per_second"
    linear = f"{rule.linear_acceleration:g} m/s a second" if is_timed else f"{rule.linear_step:g} m/s a frame"
    angular = f"{rule.angular_acceleration:g} rad/s a second" if is_timed else f"{rule.angular_step:g} rad/s a frame"
    if action in ("forward", "backward"):
        return f"{linear}, up to {rule.max_linear:g} m/s"
    if action in ("turn_left", "turn_right"):
        return f"{angular}, up to {rule.max_angular:g} rad/s"
    return f"up to {rule.max_linear:g} m/s" if action == "turbo" else ""
