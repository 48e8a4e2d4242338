"""The velocity nearest to the wish whose path keeps clear: a pure function of wish, scan and the robot's velocity.

This is the dynamic window (D. Fox, W. Burgard and S. Thrun, "The dynamic window approach to collision avoidance", IEEE
Robotics & Automation Magazine 4, 1997) with a person instead of a goal: only what a robot can reach in half a second is
considered, and it is judged by how near it is to the wish.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from handsteer.control.assist import TURNS_RADPS, Around
from handsteer.control.footprint import braking, fastest_mps, quickest_mps, reach_m
from handsteer.control.obstacles import Hit, met, pad_m, steps_s
from handsteer.types import Velocity

CLEAR_S = 1.0
"""For so long at least the path of what is chosen keeps clear, in seconds."""

LOOK_S = 1.5
"""It steers if the path of a wish to drive straight on meets something within this, in seconds: early enough for a bend
at full speed. Who turns is about to turn less: a turn is followed for :data:`CLEAR_S` only.
"""

WAIT_S = 0.5
"""For so long after an abrupt change of the wanted turn it does not steer, in seconds."""

REACH_S = 0.5
"""What is chosen can be reached within this, in seconds, with the guaranteed decelerations."""

WIDEST_RAD = math.radians(30)
"""The place that is reached after :data:`CLEAR_S` lies at most this far to the side of that of the wish."""

# A robot that turns at w has its way w * t / 2 to the side after t seconds.
_WIDEST_RADPS = 2 * WIDEST_RAD / CLEAR_S

# From one command to the next: keys change the turn by more, a stick and a ramp seldom do.
_ABRUPT_RADPS = 0.6

# Kept on all sides, more than the distance at which the collision monitor brakes.
_MORE_M = 0.005
# However slow it is, it looks so far ahead: a turn before a wall needs room for the corners of the robot.
_LEAST_M = 0.6
_LONGEST_S = 4.0
# A way that is longer by less than this leads nowhere else.
_LONGER_M = 0.03
_DIRECTIONS = 8
# Between two of them, the turn rate is found to a 16th of their distance.
_HALVINGS = 4
# Shares of the speed of the wish, and what each costs: a whole turn to the side costs 1.
_SHARES = ((1.0, 0.0), (0.8, 0.7), (0.6, 1.4), (0.4, 2.1), (0.25, 2.6))
# A side that the robot turns to already is kept.
_OTHER_SIDE = 0.2


class Steer:
    """The :class:`~handsteer.doors.Assist` ``steer``: :func:`steered`, for a wish that lasts.

    Keys turn and drive straight on alternately, a moment each, and neither alone says where the person goes: a wish is
    taken to last for as long as it has been held, and half a second more.
    """

    def __init__(self) -> None:
        self._turn_radps = 0.0
        self._since_s = -math.inf

    def step(self, wanted: Velocity, around: Around) -> tuple[Velocity, Hit | None]:
        """Return :func:`steered`, or ``wanted`` for :data:`WAIT_S` after an abrupt change."""
        if abs(wanted.angular_radps - self._turn_radps) > _ABRUPT_RADPS:
            self._since_s = around.now_s
        self._turn_radps = wanted.angular_radps
        held_s = around.now_s - self._since_s
        return (wanted, None) if held_s < WAIT_S else steered(wanted, around, CLEAR_S - WAIT_S + held_s)


def steered(wanted: Velocity, around: Around, look_s: float = LOOK_S) -> tuple[Velocity, Hit | None]:
    """Return the velocity to command instead of ``wanted``, and the obstacle that it avoids, or None.

    It is ``wanted`` if its path keeps clear for :data:`LOOK_S`, or :data:`CLEAR_S` if it turns, and for 0.6 m, or if
    there is none around: then it is for others to brake. A turn in place is left as it is.

    Args:
        wanted: What the person wants; finite.
        around: The obstacles and the robot.
        look_s: A shorter time than :data:`LOOK_S`, in seconds.
    """
    if not wanted.linear_mps or not len(around.points):
        return wanted, None
    look_s = min(look_s, CLEAR_S if abs(wanted.angular_radps) >= TURNS_RADPS else LOOK_S)
    way_m = max(look_s * abs(wanted.linear_mps), _LEAST_M)
    around = _near(wanted, way_m, around)
    avoided = _hit(wanted, way_m, around)
    if avoided is None:
        return wanted, None
    best, longest_m = None, _free_m(wanted, avoided, around) + _LONGER_M
    candidates = _candidates(wanted, around)
    for cost, candidate in candidates:
        hit = _hit(candidate, way_m, around)
        if hit is None:
            equal = [each for its_cost, each in candidates if math.isclose(its_cost, cost)]
            clear = [each for each in equal if each == candidate or _hit(each, way_m, around) is None]
            return _nearest_of(clear, wanted, way_m, around), avoided
        # Before a wall, nothing leads past it yet; but there is a side to which the way is longer.
        free_m = _free_m(candidate, hit, around)
        if hit.time_s >= CLEAR_S and free_m > longest_m:
            best, longest_m = candidate, free_m
    return (wanted, None) if best is None else (best, avoided)


def _nearest_of(clear: Sequence[Velocity], wanted: Velocity, way_m: float, around: Around) -> Velocity:
    """Return the velocity to choose where ``clear``, on one side or on both, are as near to ``wanted``.

    Who wants to drive straight on does not steer, as with signs: the robot gets the whole turn, as one that passes a
    wall by millimetres comes to stand before the next one.
    """
    if not wanted.angular_radps and len(clear) == 1:
        return clear[0]
    both = [(_refined(each, wanted, way_m, around), each) for each in clear]
    least, whole = min(both, key=lambda each: abs(each[0].angular_radps - wanted.angular_radps))
    return least if wanted.angular_radps else whole


def _refined(clear: Velocity, wanted: Velocity, way_m: float, around: Around) -> Velocity:
    """Return ``clear`` with a turn rate nearer to that of ``wanted``, as near as it keeps clear."""
    nearer = _nearest(wanted, around)
    for _ in range(_HALVINGS if nearer != clear.angular_radps else 0):
        middle = Velocity(clear.linear_mps, (clear.angular_radps + nearer) / 2)
        if _hit(middle, way_m, around) is None:
            clear = middle
        else:
            nearer = middle.angular_radps
    return clear


def _free_m(target: Velocity, hit: Hit, around: Around) -> float:
    """Return the length of the way to ``hit``, roughly: that of a robot that is slowed is longer at first."""
    faster_mps = max(0.0, abs(around.moving.linear_mps) - abs(target.linear_mps))
    return abs(target.linear_mps) * hit.time_s + faster_mps**2 / (2 * around.rule.deceleration)


def _near(wanted: Velocity, way_m: float, around: Around) -> Around:
    """Return ``around`` with those points only that a path considered could come near to."""
    fastest = Velocity(max(abs(wanted.linear_mps), abs(around.moving.linear_mps)), around.max_angular_radps)
    reach, points = reach_m(around.rule), around.points
    far_m = max(way_m, fastest.linear_mps * LOOK_S) + reach + _kept_m(fastest_mps(fastest, around.rule))
    x, y = points[:, 0] * math.copysign(1.0, wanted.linear_mps), points[:, 1]
    if around.drift is None:
        return replace(around, points=points[(x * x + y * y <= far_m * far_m) & (x >= -reach - _kept_m(0.0))])
    comes_m = np.linalg.norm(around.drift, axis=1) * _LONGEST_S
    near = (x * x + y * y <= (far_m + comes_m) ** 2) & (x >= -reach - _kept_m(0.0) - comes_m)
    return replace(around, points=points[near], drift=around.drift[near])


def _hit(target: Velocity, way_m: float, around: Around) -> Hit | None:
    """Return the first obstacle on the next ``way_m`` metres of a robot that changes its velocity to ``target``.

    All are judged for as long a way: a slower path that only meets the same later is none around it.
    """
    moving, rule = around.moving, around.rule
    fastest = max(fastest_mps(target, rule), fastest_mps(moving, rule))
    if not len(around.points):
        return None
    clear_s = max(CLEAR_S, min(way_m / abs(target.linear_mps), _LONGEST_S))
    times_s = steps_s(fastest + quickest_mps(around.drift), clear_s)
    poses = braking(moving, target, rule, clear_s, times_s)
    return met(poses, times_s, around.points, rule, pad_m=_kept_m(fastest), fastest_mps=fastest, drift=around.drift)


def _kept_m(fastest: float) -> float:
    """Return the distance kept on all sides of a robot whose fastest corner moves at ``fastest`` m/s, in metres."""
    return pad_m(fastest) + _MORE_M


def _candidates(wanted: Velocity, around: Around) -> list[tuple[float, Velocity]]:
    """Return the velocities that may be chosen, each with how far it is from ``wanted``, the nearest first."""
    turns, moving = _turns(wanted, around), around.moving
    most = REACH_S * around.rule.deceleration
    found: list[tuple[float, Velocity]] = []
    seen: set[float] = set()
    for share, cost in _SHARES:
        wished = share * wanted.linear_mps
        linear = max(moving.linear_mps - most, min(wished, moving.linear_mps + most))
        if linear * wanted.linear_mps <= 0.0 or abs(linear) > abs(wished) or linear in seen:
            continue  # it still rolls the other way, or cannot be as slow so soon
        seen.add(linear)
        for turn in turns:
            off = abs(turn - wanted.angular_radps) / _WIDEST_RADPS
            other = _OTHER_SIDE if turn * moving.angular_radps < 0 else 0.0
            found.append((cost + off + other, Velocity(linear, float(turn))))
    return sorted(found, key=lambda each: each[0])


def _turns(wanted: Velocity, around: Around) -> NDArray[np.float64]:
    """Return the turn rates that may be chosen, (K,): none, if what is wanted cannot be reached soon."""
    low, high = _reach(wanted, around)
    if low > high:
        return np.empty(0)
    return np.unique([*np.linspace(low, high, _DIRECTIONS), _nearest(wanted, around)])


def _nearest(wanted: Velocity, around: Around) -> float:
    """Return the turn rate that may be chosen and is the nearest to that of ``wanted``."""
    low, high = _reach(wanted, around)
    return max(low, min(wanted.angular_radps, high))


def _reach(wanted: Velocity, around: Around) -> tuple[float, float]:
    """Return the least and the highest turn rate that may be chosen; none may, if the least is the higher one."""
    middle, now, most = wanted.angular_radps, around.moving.angular_radps, around.max_angular_radps
    reach = REACH_S * around.rule.angular_deceleration
    low, high = max(middle - _WIDEST_RADPS, now - reach, -most), min(middle + _WIDEST_RADPS, now + reach, most)
    if middle >= TURNS_RADPS:
        low = max(low, 0.0)
    elif middle <= -TURNS_RADPS:
        high = min(high, 0.0)
    return low, high
