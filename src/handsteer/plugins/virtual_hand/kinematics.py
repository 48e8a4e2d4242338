"""Forward kinematics of the hand, vectorised over hands.

The *hand frame* is that of a right hand: origin at the wrist, x to the thumb's side, y along the middle finger, z out
of the palm (metres). Seen with the palm to the viewer and the fingers up, x is right, y up, and z towards the viewer. A
left hand is the mirror image, made by its placement in the camera frame (:mod:`handsteer.plugins.virtual_hand.poses`).

Joints are in the order of the landmark models: wrist, then thumb, index, middle, ring and little finger, each from its
base to its tip. Angles are in radians, in the order of :data:`ANGLES`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

FINGERS = ("index", "middle", "ring", "little")

ANGLES: tuple[str, ...] = (
    "wrist_flexion",
    "wrist_deviation",
    "thumb_spread",
    "thumb_opposition",
    "thumb_mcp",
    "thumb_ip",
    "thumb_rotation",
    *(f"{finger}_{joint}" for finger in FINGERS for joint in ("spread", "mcp", "pip", "dip")),
)
"""Names of the angles; zero is a flat hand with straight fingers and the thumb along the index finger.

``wrist_flexion`` bends the palm towards the forearm, ``wrist_deviation`` the thumb's side. ``spread`` rotates a digit
in the plane of the palm towards the thumb's side. ``mcp``, ``pip``, ``dip`` and ``ip`` bend it towards the palm (the
thumb: towards its own pulp). ``thumb_opposition`` lifts the thumb out of the plane of the palm, ``thumb_rotation``
rotates it about its own axis, its pulp from the fingers to the viewer of the palm.
"""

LIMITS: Array = np.radians(
    [
        *((-60, 70), (-20, 30)),
        *((-10, 75), (-15, 75), (-20, 80), (-30, 85), (-60, 60)),
        *((-20, 25), (-25, 95), (-5, 110), (-10, 80)),
        *((-20, 20), (-25, 95), (-5, 110), (-10, 80)),
        *((-25, 20), (-25, 95), (-5, 115), (-10, 80)),
        *((-35, 20), (-25, 95), (-5, 115), (-10, 80)),
    ]
)
"""(23, 2) smallest and largest angle in radians: active range of healthy adults (AAOS, *Joint Motion*, rounded)."""

BONE_LENGTHS_M: Array = np.array(
    [
        *(0.034, 0.0462, 0.0316, 0.0273),
        *(0.0945, 0.0398, 0.0224, 0.0197),
        *(0.0920, 0.0446, 0.0263, 0.0214),
        *(0.0860, 0.0414, 0.0257, 0.0213),
        *(0.0810, 0.0327, 0.0181, 0.0197),
    ]
)
"""(20,) lengths of the bones that end at joints 1 to 20, in metres.

Phalanges and the thumb's metacarpal are the means of A. Buryanov and V. Kotiuk, *Proportions of hand segments*, Int. J.
Morphol. 28(3), 2010, the distal ones including the soft tip; the first of each digit runs from the wrist through the
palm.
"""

_PALM = np.array(
    [
        [0.0230, 0.0235, 0.0090],
        [0.0260, 0.0905, -0.0020],
        [0.0040, 0.0915, -0.0030],
        [-0.0165, 0.0840, -0.0010],
        [-0.0340, 0.0730, 0.0040],
    ]
)
_PALM_DIRECTIONS: Array = _PALM / np.linalg.norm(_PALM, axis=1, keepdims=True)

_REST_SPREAD = np.radians([0.0, 3.0, 0.0, -4.0, -9.0])
# Bent fingers point to the scaphoid, on the thumb's side of the wrist, so their bending axes are rotated.
_REST_TWIST = np.radians([-85.0, -4.0, 2.0, 9.0, 17.0])


@dataclass(frozen=True)
class Skeleton:
    """Posed hands in the hand frame.

    Attributes:
        joints: (N, 21, 3) positions in metres.
        axes: (N, 5, 3, 3, 3) rotations of the three moving bones of each digit; the columns are the bone's bending
            axis, its direction, and the side of its pulp.
        forearm: (N, 3) unit vectors from the wrist to the elbow.
    """

    joints: Array
    axes: Array
    forearm: Array


def angles_of(**degrees: float) -> Array:
    """Return the (23,) angles in radians with the named ones set in degrees, the others zero.

    Raises:
        KeyError: A name is unknown.
    """
    angles = np.zeros(len(ANGLES))
    for name, value in degrees.items():
        if name not in ANGLES:
            raise KeyError(f"no angle {name!r} in the hand; there are {', '.join(ANGLES)}")
        angles[ANGLES.index(name)] = np.radians(value)
    return angles


def clamp(angles: ArrayLike) -> Array:
    """Return (..., 23) angles clamped to :data:`LIMITS`."""
    clamped: Array = np.clip(np.asarray(angles, float), LIMITS[:, 0], LIMITS[:, 1])
    return clamped


def pose_joints(angles: ArrayLike, bone_lengths: ArrayLike = BONE_LENGTHS_M) -> Array:
    """Return the (N, 21, 3) joints in metres in the hand frame; arguments as for :func:`pose_skeleton`."""
    return pose_skeleton(angles, bone_lengths).joints


def pose_skeleton(angles: ArrayLike, bone_lengths: ArrayLike = BONE_LENGTHS_M) -> Skeleton:
    """Return hands posed by their joint angles (forward kinematics).

    Args:
        angles: (N, 23) or (23,) radians, in the order of :data:`ANGLES`; not clamped.
        bone_lengths: (N, 20) or (20,) metres, in the order of :data:`BONE_LENGTHS_M`.
    """
    angles = np.atleast_2d(np.asarray(angles, float))
    count = len(angles)
    lengths = np.broadcast_to(np.asarray(bone_lengths, float), (count, 20)).reshape(count, 5, 4)
    axes = _digit_axes(angles)
    joints = np.zeros((count, 5, 4, 3))
    joints[:, :, 0] = _PALM_DIRECTIONS * lengths[:, :, 0, None]
    bones = axes[..., :, 1] * lengths[:, :, 1:, None]
    joints[:, :, 1:] = joints[:, :, :1] + np.cumsum(bones, axis=2)
    wrist = np.zeros((count, 1, 3))
    return Skeleton(np.concatenate([wrist, joints.reshape(count, 20, 3)], axis=1), axes, _forearm(angles))


def _digit_axes(angles: Array) -> Array:
    """Return (N, 5, 3, 3, 3) orientations of the moving bones."""
    thumb, fingers = angles[:, 2:7], angles[:, 7:].reshape(-1, 4, 4)
    digits = np.concatenate([thumb[:, None, :4], fingers], axis=1)
    twist = np.tile(_REST_TWIST, (len(angles), 1))
    spread = turn_z(-(digits[..., 0] + _REST_SPREAD))
    bend = turn_x(digits[..., 1:])
    # A finger's twist rotates its bending axis. The thumb rotates about its own length, after it has been lifted.
    twist[:, 0] += thumb[:, 4]
    twisted = turn_y(twist)
    first = np.where(_IS_THUMB, bend[:, :, 0] @ twisted, twisted @ bend[:, :, 0])
    first = spread @ first
    middle = first @ bend[:, :, 1]
    return np.stack([first, middle, middle @ bend[:, :, 2]], axis=2)


_IS_THUMB = np.array([True, False, False, False, False])[:, None, None]


def _forearm(angles: Array) -> Array:
    """Return (N, 3) directions to the elbow; -y with a straight wrist."""
    flexion, deviation = angles[:, 0], angles[:, 1]
    return np.stack(
        [np.sin(deviation) * np.cos(flexion), -np.cos(deviation) * np.cos(flexion), np.sin(flexion)], axis=-1
    )


def turn_x(angle: ArrayLike) -> Array:
    """Return (..., 3, 3) rotations about x by (...) radians."""
    return _turn(angle, 1, 2)


def turn_y(angle: ArrayLike) -> Array:
    """Return (..., 3, 3) rotations about y by (...) radians."""
    return _turn(angle, 2, 0)


def turn_z(angle: ArrayLike) -> Array:
    """Return (..., 3, 3) rotations about z by (...) radians."""
    return _turn(angle, 0, 1)


def _turn(angle: ArrayLike, first: int, second: int) -> Array:
    angle = np.asarray(angle, float)
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., range(3), range(3)] = 1.0
    matrix[..., first, first] = matrix[..., second, second] = np.cos(angle)
    matrix[..., second, first] = np.sin(angle)
    matrix[..., first, second] = -np.sin(angle)
    return matrix
