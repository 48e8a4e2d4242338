"""Random hand shapes: those of the signs with people's variations, and all other shapes a hand can have.

A shape is generated first and labelled afterwards, from its true joints
(:mod:`handsteer.plugins.teach.synthetic.hands`). So the generators here need not be exact: a thumb that extends too far
just gives another shape.
"""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import ANGLES, LIMITS, Array, clamp, pose_joints

Random = np.random.Generator
States = NDArray[np.int64]

_THUMB: Final = slice(2, 7)
_FIRST_FINGER: Final = ANGLES.index("index_spread")

# Spread, mcp, pip and dip in degrees (mean, standard deviation) for one finger that is ...
_STRAIGHT: Final = ((0, 5), (6, 14), (8, 9), (4, 7))
_CURLED: Final = ((0, 4), (62, 15), (88, 13), (48, 20))
_LOOSE: Final = ((0, 4), (34, 14), (76, 11), (38, 14))
_HOOKED: Final = ((0, 5), (15, 16), (88, 14), (48, 16))
_HALF: Final = ((0, 5), (30, 20), (50, 18), (25, 14))
_ROUND: Final = ((0, 5), (52, 16), (54, 12), (40, 13))
_FINGER_STATES: Final = np.array([_STRAIGHT, _CURLED, _HALF, _HOOKED, _LOOSE, _ROUND], float)
STRAIGHT, CURLED, HALF, HOOKED, LOOSE, ROUND = range(6)

# Spread, opposition, mcp, ip and rotation in degrees for a thumb that is ...
_THUMB_STATES: Final = np.array(
    [
        ((54, 11), (12, 12), (-2, 13), (-4, 19), (0, 8)),  # extended, partly bent back as a hitch-hiker's
        ((22, 10), (14, 11), (6, 12), (8, 14), (0, 8)),  # along the index finger
        ((14, 9), (40, 11), (28, 14), (55, 20), (-1, 8)),  # folded over bent fingers
        ((10, 8), (55, 12), (35, 16), (45, 22), (0, 8)),  # across the palm
        ((30, 12), (48, 14), (18, 14), (28, 18), (15, 15)),  # opposite the fingers
    ],
    float,
)
OUT, ALONGSIDE, FOLDED, ACROSS, OPPOSITE = range(5)

_S, _C, _H = STRAIGHT, CURLED, HALF
_KNOWN: Final = (
    (_S, _S, _C, _C, ACROSS),  # peace
    (_S, _S, _C, _C, ALONGSIDE),
    (_S, _S, _S, _C, ACROSS),  # three
    (_S, _S, _C, _C, OUT),  # three with the thumb
    (_C, _S, _S, _S, OPPOSITE),  # three of OK
    (_S, _S, _S, _S, ACROSS),  # four
    (_S, _S, _S, _S, FOLDED),
    (_S, _C, _C, _S, FOLDED),  # horns
    (_S, _C, _C, _S, OUT),
    (_C, _C, _C, _S, OUT),  # call
    (_C, _C, _C, _S, FOLDED),  # little finger
    (_S, _C, _C, _C, OUT),  # L
    (_C, _S, _C, _C, FOLDED),  # middle finger
    (_C, _C, _S, _S, FOLDED),
    (_C, _S, _S, _S, FOLDED),
    (_H, _C, _C, _C, OPPOSITE),  # pinch
    (_H, _C, _C, _C, FOLDED),  # beckoning
    (_H, _H, _S, _S, OPPOSITE),
    (_H, _S, _S, _S, OPPOSITE),  # OK
    (_H, _H, _H, _H, OPPOSITE),  # holding something
    (_H, _H, _H, _H, OUT),  # claw
    (_H, _H, _H, _H, ALONGSIDE),
)


def open_hand(count: int, random: Random) -> Array:
    """Return (count, 23) angles of an open hand, fingers together or apart, the thumb along them or extended."""
    angles = _posed(np.full((count, 4), STRAIGHT), _choice([OUT, ALONGSIDE], [0.7, 0.3], count, random), random)
    _bend_together(angles, random, mcp=10, pip=6)
    apart = random.uniform(-0.2, 1.3, (count, 1))
    angles[:, _joints(0)] += np.radians([6.0, 0.0, -7.0, -15.0]) * apart
    return angles


def index_up(count: int, random: Random) -> Array:
    """Return (count, 23) angles of a pointing index finger, the others closed, some loosely."""
    states = np.full((count, 4), STRAIGHT)
    states[:, 1:] = _choice([CURLED, LOOSE, HOOKED], [0.6, 0.3, 0.1], count, random)[:, None]
    thumbs = _choice([FOLDED, ACROSS, OPPOSITE, ALONGSIDE, OUT], [0.35, 0.25, 0.2, 0.15, 0.05], count, random)
    angles = _posed(states, thumbs, random)
    angles[:, _FIRST_FINGER + 1] += np.radians(random.normal(4, 10, count))
    return angles


def index_down(count: int, random: Random) -> Array:
    """Return (count, 23) angles of an index finger as it points down: bent at its knuckle, the others more so."""
    angles = index_up(count, random)
    angles[:, _THUMB] = _drawn(_THUMB_STATES[_choice([OUT, *range(1, 5)], [0.4, *[0.15] * 4], count, random)], random)
    bent = np.radians(random.uniform(0, 75, (count, 1)))
    angles[:, [_FIRST_FINGER + 1]] += bent
    angles[:, _joints(1)[1:]] += 0.35 * bent
    angles[:, _FIRST_FINGER + 2] += np.radians(random.uniform(0, 28, count))
    return angles


def thumb_out(count: int, random: Random) -> Array:
    """Return (count, 23) angles of a fist with the thumb extended, tightly or loosely closed."""
    states = np.repeat(_choice([CURLED, LOOSE, HOOKED], [0.7, 0.2, 0.1], count, random)[:, None], 4, axis=1)
    angles = _posed(states, _choice([OUT, ALONGSIDE], [0.85, 0.15], count, random), random)
    _bend_together(angles, random, mcp=10, pip=10)
    return angles


def fist(count: int, random: Random) -> Array:
    """Return (count, 23) angles of a fist, the thumb over the fingers, along them or inside."""
    states = np.repeat(_choice([CURLED, LOOSE], [0.8, 0.2], count, random)[:, None], 4, axis=1)
    angles = _posed(states, _choice([FOLDED, ACROSS, ALONGSIDE], [0.45, 0.2, 0.35], count, random), random)
    _bend_together(angles, random, mcp=10, pip=8)
    return angles


def any_fingers(count: int, random: Random) -> Array:
    """Return (count, 23) angles of every combination of straight, half bent and closed fingers."""
    states = random.choice(5, (count, 4), p=[0.42, 0.32, 0.10, 0.06, 0.10])
    return _posed(states, random.integers(0, 5, count), random)


def known_others(count: int, random: Random) -> Array:
    """Return (count, 23) angles of common other shapes: peace, three, four, horns, call, L, little finger..."""
    fingers = np.array(_KNOWN)
    which = random.integers(0, len(fingers), count)
    return _posed(fingers[which, :4], fingers[which, 4], random)


def relaxed(count: int, random: Random) -> Array:
    """Return (count, 23) angles of hands at rest or half open: all fingers bent similarly, the little one most."""
    angles = _posed(np.full((count, 4), STRAIGHT), random.integers(0, 5, count), random)
    amount = random.uniform(0.1, 1.0, (count, 1))
    growing = 1.0 + random.uniform(-0.2, 1.0, (count, 1)) * np.linspace(0, 1, 4)
    for joint, most in ((1, 62.0), (2, 80.0), (3, 45.0)):
        angles[:, _joints(joint)] += np.radians(most) * amount * growing * random.uniform(0.6, 1.3, (count, 1))
    return angles


def holding(count: int, random: Random) -> Array:
    """Return (count, 23) angles of hands that hold a ball, a bottle or nothing: an O or C of fingers and thumb."""
    states = np.repeat(_choice([ROUND, HALF], [0.65, 0.35], count, random)[:, None], 4, axis=1)
    angles = _posed(states, np.full(count, OPPOSITE), random)
    _bend_together(angles, random, mcp=15, pip=14)
    angles[:, _THUMB] = _round_thumbs(count, random)
    return angles


def touching(count: int, random: Random) -> Array:
    """Return (count, 23) angles of OK and of pinches: the tips of thumb and index finger meet, or almost."""
    tries = 6
    states = np.full((count * tries, 4), STRAIGHT)
    states[:, 0] = ROUND
    others = _choice([STRAIGHT, HALF, CURLED], [0.75, 0.15, 0.1], count, random)
    states[:, 1:] = others.repeat(tries)[:, None]
    angles = _posed(states, np.full(count * tries, OPPOSITE), random)
    angles[:, _THUMB] = _round_thumbs(count * tries, random)
    joints = pose_joints(clamp(angles))
    gaps = np.linalg.norm(joints[:, 4] - joints[:, 8], axis=1).reshape(count, tries)
    nearest: Array = angles[np.arange(count) * tries + gaps.argmin(axis=1)]
    return nearest


def _round_thumbs(count: int, random: Random) -> Array:
    """Return (count, 5) angles of thumbs that meet the fingertips around something."""
    return _drawn(np.tile(((28, 18), (45, 18), (2, 14), (5, 18), (10, 15)), (count, 1, 1)), random)


def anything(count: int, random: Random) -> Array:
    """Return (count, 23) angles anywhere within the joints' limits."""
    low, high = LIMITS.T
    angles: Array = random.uniform(low, high, (count, len(ANGLES)))
    return angles


MAKERS: Final[tuple[tuple[Callable[[int, Random], Array], float], ...]] = (
    (open_hand, 0.10),
    (index_up, 0.15),
    (index_down, 0.09),
    (thumb_out, 0.14),
    (fist, 0.11),
    (any_fingers, 0.08),
    (known_others, 0.10),
    (relaxed, 0.10),
    (holding, 0.08),
    (touching, 0.05),
    (anything, 0.03),
)
"""The generators of shapes and their shares."""


def random_shapes(count: int, random: Random) -> Array:
    """Return about (count, 23) random joint angles within the limits, in radians, from all generators."""
    made = [maker(round(count * share), random) for maker, share in MAKERS]
    return clamp(np.concatenate(made))


def _posed(states: States, thumbs: States, random: Random) -> Array:
    """Return (n, 23) angles of (n, 4) finger states with (n,) thumb states."""
    count = len(states)
    angles = np.zeros((count, len(ANGLES)))
    angles[:, :2] = np.radians(random.normal(0, 12, (count, 2)))
    angles[:, _THUMB] = _drawn(_THUMB_STATES[thumbs], random)
    fingers = _drawn(_FINGER_STATES[states], random)
    fingers[:, 3, 2] *= 0.85  # the little finger bends least
    angles[:, _FIRST_FINGER:] = fingers.reshape(count, -1)
    return angles


def _drawn(statistics: Array, random: Random) -> Array:
    """Return (...) radians drawn from (..., 2) means and standard deviations in degrees."""
    drawn: Array = np.radians(random.normal(statistics[..., 0], statistics[..., 1]))
    return drawn


def _bend_together(angles: Array, random: Random, *, mcp: float, pip: float) -> None:
    """Bend all fingers of a hand by the same random angle, in place; ``mcp`` and ``pip`` are degrees."""
    angles[:, _joints(1)] += np.radians(random.normal(0, mcp, (len(angles), 1)))
    angles[:, _joints(2)] += np.radians(random.normal(0, pip, (len(angles), 1)))


def _choice(states: list[int], shares: list[float], count: int, random: Random) -> States:
    drawn: States = random.choice(states, count, p=shares)
    return drawn


def _joints(joint: int) -> list[int]:
    return [_FIRST_FINGER + 4 * finger + joint for finger in range(4)]
