"""What assists of plug-ins may change: a person keeps the say, whatever an assist returns."""

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING

from handsteer import doors
from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import Points
from handsteer.errors import PLUGIN_FAILURES, PluginError
from handsteer.types import Velocity

if TYPE_CHECKING:
    from handsteer.control.obstacles import Hit


@dataclass(frozen=True)
class Around:
    """What an assist knows.

    Attributes:
        points: The obstacles now, (N, 2): x forward and y left in the robot's base frame, in metres.
        moving: The robot's velocity.
        rule: Size of the robot, and its decelerations.
        max_angular_radps: The highest turn rate, above 0.
        now_s: The time now, in seconds of a monotonic clock.
        drift: Velocities of the points, (N, 2) in m/s; None if none moves.
    """

    points: Points
    moving: Velocity
    rule: CollisionMonitorConfig
    max_angular_radps: float
    now_s: float
    drift: Points | None = None


log = logging.getLogger(__name__)

TURNS_RADPS = 0.05
"""From this on, a turn is one that the person makes, and no assist turns against it."""

_ROUNDING = 1e-9


def assist_named(name: str) -> "doors.Assist | None":
    """Return the assist of a plug-in; None for ``off`` and ``brake``, which need none.

    Raises:
        PluginError: There is none of this name, or it cannot be made.
    """
    if name in ("off", "brake"):
        return None
    make = doors.ASSISTS.load(name)
    try:
        return make()
    except PLUGIN_FAILURES as error:
        raise PluginError(f"{doors.ASSISTS.described(name)} cannot be made: {type(error).__name__}: {error}") from error


def is_within(assisted: Velocity, wanted: Velocity, max_angular_radps: float) -> bool:
    """Return whether ``assisted`` is what a person who wants ``wanted`` may get.

    It is at most as fast as ``wanted``, in the same direction, turns no faster than ``max_angular_radps`` or
    ``wanted``, and not against a turn of at least :data:`TURNS_RADPS`. Who wants to stand, stands; who turns in place,
    does only that.
    """
    v, w = assisted.linear_mps, assisted.angular_radps
    most = max(abs(wanted.angular_radps), max_angular_radps if wanted.linear_mps else 0.0)
    turns = abs(wanted.angular_radps) >= TURNS_RADPS
    return (
        assisted.is_finite
        and abs(v) <= abs(wanted.linear_mps) + _ROUNDING
        and v * wanted.linear_mps >= 0.0
        and abs(w) <= most + _ROUNDING
        and not (turns and w * wanted.angular_radps < 0.0)
    )


def assisted(assist: doors.Assist, wanted: Velocity, around: Around) -> "tuple[Velocity, Hit | None]":
    """Return what ``assist`` makes of ``wanted``, and the obstacle it avoids; ``wanted`` if it fails or may not."""
    try:
        velocity, avoided = assist.step(wanted, around)
        if is_within(velocity, wanted, around.max_angular_radps):
            return velocity, avoided
        log.error("the assist may not make %s of %s: it is left out", velocity, wanted)
    except PLUGIN_FAILURES:
        log.exception("the assist has failed: it is left out")
    return wanted, None


def held_back(wanted: Velocity, allowed: Velocity) -> Velocity:
    """Return where the input of ``wanted`` continues from after ``allowed``: without the turn that was added."""
    turn = allowed.angular_radps if allowed.angular_radps * wanted.angular_radps > 0.0 else 0.0
    return Velocity(allowed.linear_mps, min(turn, wanted.angular_radps, key=abs))
