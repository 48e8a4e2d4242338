"""The hand's skin: a smooth union of round cones that follows the skeleton.

A round cone is swept by a ball whose radius changes along a line. The smooth union of cones at distances d_i is ``-k
log(sum(exp(-d_i / k)))`` (I. Quilez, *Smooth minimum*), which also gives the weight of each.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import BONE_LENGTHS_M, Array, Skeleton
from handsteer.plugins.virtual_hand.poses import Placement

Float = NDArray[np.float32]

BLEND_M = 0.0020
"""k of the smooth union, in metres: how far adjacent cones blend."""


MARGIN_M = 0.006
"""Maximum that the smooth union adds to the cones, in metres."""


class Material(IntEnum):
    """The material of a cone."""

    SKIN = 0
    FLUSHED = 1
    NAIL = 2
    SLEEVE = 3


@dataclass(frozen=True)
class Cones:
    """M round cones.

    Attributes:
        start: (M, 3) centre of the first ball, metres.
        end: (M, 3) centre of the last ball, metres.
        start_radius: (M,) metres.
        end_radius: (M,) metres.
        material: (M,) :class:`Material`.
    """

    start: Array
    end: Array
    start_radius: Array
    end_radius: Array
    material: NDArray[np.int64]

    def placed(self, placement: Placement) -> "Cones":
        """Transform these cones from the hand frame to the camera frame."""
        return replace(self, start=placement.apply(self.start), end=placement.apply(self.end))

    def beyond(self, depth: float) -> "Cones":
        """Return what of these cones, in the camera frame, has its axis beyond ``depth`` in metres."""
        first, last = self.start[:, 2] - depth, self.end[:, 2] - depth
        if min(first.min(), last.min()) >= 0:
            return self
        slope = np.where(first == last, 1.0, first - last)
        crossing = np.clip(first / slope, 0.0, 1.0)
        low, high = np.where(first < 0, crossing, 0.0), np.where(last < 0, crossing, 1.0)
        axis, growth = self.end - self.start, self.end_radius - self.start_radius
        cut = Cones(
            self.start + low[:, None] * axis,
            self.start + high[:, None] * axis,
            self.start_radius + low * growth,
            self.start_radius + high * growth,
            self.material,
        )
        return cut.only((first >= 0) | (last >= 0))

    def only(self, which: NDArray[np.bool_]) -> "Cones":
        """Return the selected cones."""
        radii = self.start_radius[which], self.end_radius[which]
        return Cones(self.start[which], self.end[which], *radii, self.material[which])


_RADII_M = (
    (0.0128, 0.0102, 0.0092, 0.0078),
    (0.0102, 0.0084, 0.0074, 0.0062),
    (0.0104, 0.0086, 0.0076, 0.0064),
    (0.0098, 0.0080, 0.0071, 0.0060),
    (0.0088, 0.0069, 0.0061, 0.0052),
)
"""Radii at the base, at both joints and at the tip, in metres, from thumb to little finger."""

_PALM = (
    # (start, end, start radius, end radius) in the hand frame, in metres: wrist to the four knuckles,
    ((0.0130, 0.004, 0.0), (0.0250, 0.0850, -0.001), 0.0140, 0.0098),
    ((0.0050, 0.004, 0.0), (0.0040, 0.0860, -0.002), 0.0140, 0.0102),
    ((-0.0050, 0.004, 0.0), (-0.0160, 0.0790, -0.001), 0.0140, 0.0100),
    ((-0.0130, 0.004, 0.0), (-0.0325, 0.0685, 0.003), 0.0140, 0.0096),
    # the ball of the little finger, the pads below the fingers, the hollow of the hand.
    ((-0.0170, 0.018, 0.005), (-0.0280, 0.0560, 0.004), 0.0125, 0.0105),
    ((0.0235, 0.0890, 0.0022), (-0.0305, 0.0720, 0.0045), 0.0088, 0.0083),
    ((0.0215, 0.0800, 0.0014), (-0.0285, 0.0655, 0.0035), 0.0098, 0.0094),
    ((0.0185, 0.0710, 0.0008), (-0.0260, 0.0590, 0.0025), 0.0107, 0.0103),
    ((0.0150, 0.0620, 0.0004), (-0.0230, 0.0530, 0.0018), 0.0114, 0.0111),
    ((0.0110, 0.0520, 0.0000), (-0.0190, 0.0460, 0.0015), 0.0121, 0.0119),
    ((0.0080, 0.0400, 0.0000), (-0.0150, 0.0375, 0.0015), 0.0128, 0.0126),
)

_SLEEVE_FROM_M, _ARM_LENGTH_M = 0.075, 0.8


_Cone = tuple[Array, Array, float, float, Material]
"""Centres of the first and the last ball, their radii, and the material."""


def hand_cones(skeleton: Skeleton, *, sleeve: bool = True) -> Cones:
    """Return the cones of the first hand of ``skeleton``, in the hand frame."""
    joints, axes = skeleton.joints[0], skeleton.axes[0]
    rows = [*_palm(joints)]
    for digit in range(5):
        rows += _digit(joints[1 + 4 * digit : 5 + 4 * digit], axes[digit], _RADII_M[digit], digit)
    rows += _arm(skeleton.forearm[0], sleeve)
    return Cones(*(np.array(column) for column in zip(*rows, strict=True)))


def _palm(joints: Array) -> Iterator[_Cone]:
    scale = float(np.linalg.norm(joints[9])) / float(BONE_LENGTHS_M[8])
    for start, end, start_radius, end_radius in _PALM:
        yield np.array(start) * scale, np.array(end) * scale, start_radius * scale, end_radius * scale, Material.SKIN
    base, knuckle, index = joints[1], joints[2], joints[5]
    # The ball of the thumb, and the skin between thumb and index finger.
    yield base * 0.85, base + 0.75 * (knuckle - base), 0.0165, 0.0135, Material.SKIN
    yield 0.5 * index + 0.2 * base, 0.45 * base + 0.55 * knuckle, 0.0100, 0.0085, Material.SKIN


def _digit(joints: Array, axes: Array, radii: tuple[float, ...], digit: int) -> Iterator[_Cone]:
    along, back, tip_radius = axes[2][:, 1], -axes[2][:, 2], radii[3]
    tip = joints[3] - along * tip_radius
    ends = (joints[0], joints[1], joints[2], tip)
    for bone in range(3):
        material = Material.FLUSHED if bone == 2 else Material.SKIN
        # Cones end before the joints, to compensate for what the union adds there.
        inset = 0.14 * (ends[bone + 1] - ends[bone])
        yield ends[bone] + inset, ends[bone + 1] - inset * (bone < 2), radii[bone], radii[bone + 1], material
    yield from _knuckles(ends, axes, radii, digit)
    nail_from = tip + along * (0.2 * tip_radius) + back * 0.38 * tip_radius
    nail_to = tip - along * (0.75 * tip_radius) + back * 0.46 * tip_radius
    yield nail_from, nail_to, 0.70 * tip_radius, 0.74 * tip_radius, Material.NAIL


def _knuckles(ends: tuple[Array, ...], axes: Array, radii: tuple[float, ...], digit: int) -> Iterator[_Cone]:
    """Yield bumps on the back of the joints, which protrude more the more a joint is bent."""
    before = np.array([0.0, 0.0, 1.0]) if digit else axes[0][:, 2]
    for joint in range(2):
        after = axes[joint][:, 2]
        bent = float(np.clip(1.0 - before @ after, 0.0, 1.0))
        back = -(before + after) / max(float(np.linalg.norm(before + after)), 1e-6)
        centre, radius = ends[joint] + back * (0.0042 * bent), (0.62 + 0.34 * bent) * radii[joint]
        yield centre, centre, radius, radius, Material.FLUSHED
        before = after


def _arm(forearm: Array, sleeve: bool) -> Iterator[_Cone]:
    across = np.cross(forearm, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    for side in (-1, 0, 1):
        yield across * 0.010 * side, across * 0.014 * side + forearm * 0.26, 0.0160, 0.0290, Material.SKIN
    if not sleeve:
        yield forearm * 0.26, forearm * _ARM_LENGTH_M, 0.036, 0.050, Material.SKIN
        return
    for side in (-1, 1):
        offset = across * 0.010 * side
        yield offset + forearm * _SLEEVE_FROM_M, offset + forearm * _ARM_LENGTH_M, 0.031, 0.060, Material.SLEEVE
