"""Synthetic hands in front of a camera as the landmark model would report them, with their true shape."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.teach.synthetic.shapes import Random, random_shapes
from handsteer.plugins.virtual_hand.kinematics import ANGLES, FINGERS, Array, pose_joints, turn_x, turn_y, turn_z

OPEN, INDEX, INDEX_DOWN, THUMB, FIST, OTHER = "open", "index", "index_down", "thumb", "fist", "other"
SHAPES: Final = (OPEN, INDEX, INDEX_DOWN, THUMB, FIST, OTHER)
"""The classes of the network.

``index_down`` is an index finger as people hold it to point down and no other: bent at its knuckle, because an arm that
is raised cannot show it straight, or with the thumb extended.
"""

Flags = NDArray[np.bool_]

_UNSURE: Final = -1
_FIRST_FINGER: Final = ANGLES.index("index_spread")

BONES_M: Final = 0.096 * np.array(
    [
        *(0.43, 0.33, 0.36, 0.29),
        *(1.03, 0.305, 0.225, 0.275),
        *(1.00, 0.38, 0.28, 0.26),
        *(0.96, 0.32, 0.255, 0.25),
        *(0.87, 0.23, 0.21, 0.19),
    ]
)
"""(20,) bone lengths in metres: medians over photos, rounded, of MediaPipe's world landmarks.

Their knuckles are nearer to the fingertips than the joints are.
"""

# Standard deviations of the landmark model's errors, in metres at the scale of its world landmarks.
_IMAGE_ERROR_M: Final = 0.0022
_WORLD_ERROR_M: Final = 0.0022
_DEPTH_ERROR_M: Final = 0.005
_SHARED_ERROR_M: Final = 0.0025
_BEND_ERROR_RAD: Final = np.radians(8.0)

MCP: Final = [ANGLES.index(f"{finger}_mcp") for finger in FINGERS]
PIP: Final = [ANGLES.index(f"{finger}_pip") for finger in FINGERS]


def name_shapes(angles: Array, joints: Array, elevations: Array, facing: Array) -> NDArray[np.int64]:
    """Return (n,) indices into :data:`SHAPES`, -1 if ambiguous.

    Args:
        angles: (n, 23) joint angles, radians.
        joints: (n, 21, 3) metres.
        elevations: (n, 2) angles of the index finger and of the thumb's tip to the image plane, radians, 0 to pi / 2.
        facing: (n,) 0 to 1, how directly the palm or the back of the hand faces the camera.
    """
    reach, apart, tilt = _thumbs(joints)
    pip, fold = _index(angles)
    straight, open_enough = _straight(angles)
    closed, closed_enough = _closed(angles)
    curled, curled_enough = _closed(angles, ease=10.0)
    elevation = np.degrees(elevations)
    sure = {
        OPEN: straight.all(axis=1) & (reach >= 0.92) & (facing >= 0.4),
        INDEX: straight[:, 0] & curled[:, 1:].all(axis=1) & (reach <= 1.0) & (elevation[:, 0] <= 55),
        INDEX_DOWN: (pip <= 42) & curled[:, 1:].all(axis=1) & ((fold > 100) | (reach > 1.2)) & (elevation[:, 0] <= 55),
        THUMB: closed.all(axis=1) & (reach >= 1.05) & (apart >= 0.5) & (tilt >= 38) & (elevation[:, 1] <= 55),
        FIST: closed.all(axis=1) & ((reach <= 0.82) | (tilt <= 28) & (reach <= 1.1)),
    }
    possible = {
        OPEN: open_enough.all(axis=1) & (reach >= 0.82),
        INDEX: open_enough[:, 0] & curled_enough[:, 1:].all(axis=1) & (reach <= 1.2) & (elevation[:, 0] <= 68),
        INDEX_DOWN: (pip <= 52) & curled_enough[:, 1:].all(axis=1) & (elevation[:, 0] <= 68),
        THUMB: closed_enough.all(axis=1) & (reach >= 0.9) & (apart >= 0.35) & (tilt >= 28) & (elevation[:, 1] <= 68),
        FIST: closed_enough.all(axis=1) & ((reach <= 0.98) | (tilt <= 36) & (reach <= 1.25)),
    }
    named = np.full(len(angles), _UNSURE)
    for shape, holds in sure.items():
        named[holds] = SHAPES.index(shape)
    named[~np.any(list(possible.values()), axis=0)] = SHAPES.index(OTHER)
    return named


def _thumbs(joints: Array) -> tuple[Array, Array, Array]:
    """Return how the thumbs are held.

    A thumb along the index finger belongs to a fist, as the landmark model reports most plain fists.

    Returns:
        (n,) distances of the thumb's tip from the little finger's base, and from the nearer of the index and middle
        fingertips, both in palm lengths; and (n,) angles between the thumb, from its knuckle to its tip, and the palm,
        in degrees.
    """
    tip, knuckles = joints[:, 4], joints[:, [5, 9, 13, 17]]
    palm = np.linalg.norm(knuckles - joints[:, :1], axis=2).mean(axis=1)
    reach = np.linalg.norm(tip - joints[:, 17], axis=1) / palm
    apart = np.linalg.norm(joints[:, [8, 12]] - tip[:, None], axis=2).min(axis=1) / palm
    thumb, up = tip - joints[:, 2], knuckles.mean(axis=1) - joints[:, 0]
    cosines = (thumb * up).sum(axis=1) / np.linalg.norm(thumb, axis=1) / np.linalg.norm(up, axis=1)
    return reach, apart, np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))


def _index(angles: Array) -> tuple[Array, Array]:
    """Return (n,) bends of the index fingers beyond the knuckle and in all, as in :func:`_straight`, in degrees."""
    mcp, pip, dip = (bends[:, 0] for bends in _degrees(angles))
    return pip, mcp + pip + 0.5 * dip


def _straight(angles: Array) -> tuple[Flags, Flags]:
    """Return (n, 4) flags of fingers that are surely straight, and of those that may be."""
    mcp, pip, dip = _degrees(angles)
    fold = mcp + pip + 0.5 * dip
    return (pip <= 32) & (fold <= 70), (pip <= 52) & (fold <= 100)


def _closed(angles: Array, ease: float = 0.0) -> tuple[Flags, Flags]:
    """Return (n, 4) flags of fingers that are surely closed, and that may be; ``ease`` relaxes both, in degrees."""
    mcp, pip, dip = _degrees(angles)
    # Little fingers bend less than the others, even in a fist.
    fold = (mcp + pip + 0.5 * dip) * (1.0, 1.0, 1.0, 1.15) + ease
    return (pip >= 62 - ease) & (fold >= 115), (pip >= 46 - ease) & (fold >= 95)


def _degrees(angles: Array) -> Array:
    """Return (3, n, 4) mcp, pip and dip of the fingers in degrees."""
    fingers = angles[:, _FIRST_FINGER:].reshape(-1, 4, 4)
    degrees: Array = np.degrees(np.moveaxis(fingers[:, :, 1:], 2, 0))
    return degrees


@dataclass(frozen=True)
class Hands:
    """N hands as a landmark model reports them.

    Attributes:
        pixels: (n, 21, 2) landmarks in pixels.
        world: (n, 21, 3) landmarks in metres, with the image's axes.
        shapes: (n,) indices into :data:`~handsteer.plugins.teach.synthetic.hands.SHAPES`.
    """

    pixels: Array
    world: Array
    shapes: NDArray[np.int64]


def make_hands(count: int, random: Random) -> Hands:
    """Return fewer than ``count`` random hands: those with an unambiguous shape."""
    angles = random_shapes(count, random)
    count = len(angles)
    bones = BONES_M * random.normal(1.0, 0.06, (count, 20)) * random.normal(1.0, 0.05, (count, 1))
    views = _views(count, random)
    true = pose_joints(angles, bones) @ np.swapaxes(views, 1, 2)
    shapes = name_shapes(angles, true, _elevations(true), _facing(true))
    kept = shapes >= 0
    seen = pose_joints(angles[kept] + _misread(angles[kept], views[kept], random), bones[kept]) @ np.swapaxes(
        views[kept], 1, 2
    )
    pixels, world = _landmarks(seen, random)
    return Hands(pixels, world, shapes[kept])


def _views(count: int, random: Random) -> Array:
    """Return (count, 3, 3) rotations to the camera frame: most show palm or back, some are arbitrary."""
    back = random.random(count) < 0.5
    yaw = np.where(back, np.pi, 0.0) + np.radians(random.normal(0, 32, count))
    pitch = np.radians(random.normal(0, 28, count))
    anyhow = random.random(count) < 0.33
    yaw = np.where(anyhow, random.uniform(-np.pi, np.pi, count), yaw)
    pitch = np.where(anyhow, np.arcsin(random.uniform(-1, 1, count)), pitch)
    roll = random.uniform(-np.pi, np.pi, count)
    views: Array = turn_z(roll) @ turn_x(-pitch) @ np.diag([1.0, -1.0, -1.0]) @ turn_y(yaw)
    return views


def _elevations(joints: Array) -> Array:
    """Return (n, 2) angles of index finger and thumb tip (from the knuckles) to the image plane, in radians."""
    index = joints[:, 8] - joints[:, 5]
    thumb = joints[:, 4] - joints[:, [5, 9, 13, 17]].mean(axis=1)
    both = np.stack([index, thumb], axis=1)
    elevations: Array = np.arcsin(np.abs(both[..., 2]) / np.linalg.norm(both, axis=2))
    return elevations


def _facing(joints: Array) -> Array:
    normal = np.cross(joints[:, 5] - joints[:, 0], joints[:, 17] - joints[:, 0])
    facing: Array = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
    return facing


def _misread(angles: Array, views: Array, random: Random) -> Array:
    """Return (n, 23) errors of joint angles: a landmark model reports whole fingers as too bent or too straight.

    Errors are much larger for hands far away or in poor light. From the back, closed fingers are hidden, and are
    reported as bent at the knuckles rather than in the middle.
    """
    size = _BEND_ERROR_RAD * _badness(len(angles), random)
    errors: Array = random.normal(0, 1, angles.shape) * size
    hidden = np.clip(views[:, 2, 2:], 0, 1) * random.uniform(0, 0.55, (len(angles), 1))
    moved = np.clip(angles[:, PIP], 0, None) * hidden
    errors[:, PIP] -= moved
    errors[:, MCP] += 0.4 * moved
    return errors


def _badness(count: int, random: Random) -> Array:
    """Return (count, 1) factors on the errors, about 1, rarely 3."""
    factors: Array = np.exp(random.normal(-0.3, 0.5, (count, 1)))
    return factors


def _landmarks(joints: Array, random: Random) -> tuple[Array, Array]:
    """Return pixels and world landmarks, with errors, of (n, 21, 3) joints in the camera frame."""
    count = len(joints)
    centred = joints - joints.mean(axis=1, keepdims=True)
    badness = _badness(count, random)[..., None]
    shared = random.normal(0, 1, centred.shape) * (_SHARED_ERROR_M, _SHARED_ERROR_M, 0) * badness
    distance = random.uniform(0.3, 2.5, (count, 1))
    seen = centred + shared
    flat = seen[..., :2] / (1 + centred[..., 2:] / distance[..., None])
    pixels = 1000 * (flat + random.normal(0, _IMAGE_ERROR_M, flat.shape) * badness)
    depth = (random.uniform(0.5, 1.15, (count, 1, 1)), random.normal(0, _DEPTH_ERROR_M, (count, 21, 1)))
    world = seen + random.normal(0, _WORLD_ERROR_M, centred.shape) * badness
    world[..., 2:] = world[..., 2:] * depth[0] + depth[1] * badness
    return pixels, world
