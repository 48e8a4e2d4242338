"""Finding where rays meet the skin: sphere tracing through the smooth union of round cones, by numpy."""

from dataclasses import dataclass

import numpy as np

from handsteer.hand.surface import BLEND_M, Cones, Float

_STEPS = 40
_REACH = 0.95  # of the distance: the union of cones overstates it a little beside a steep cone


class Field:
    """The distance to the skin, prepared for many points at once.

    Arrays are (M cones, n points), so that every sum over the cones runs along the points.
    """

    def __init__(self, cones: Cones) -> None:
        axis = cones.end - cones.start
        self._start: Float = cones.start.astype(np.float32)
        self._axis: Float = axis.astype(np.float32)
        square = np.sum(axis**2, axis=1)
        self._square: Float = square[:, None].astype(np.float32)
        self._inverse: Float = (1.0 / np.maximum(square, 1e-12))[:, None].astype(np.float32)
        self._along: Float = np.sum(cones.start * axis, axis=1)[:, None].astype(np.float32)
        self._offset: Float = np.sum(cones.start**2, axis=1)[:, None].astype(np.float32)
        self._radius: Float = cones.start_radius[:, None].astype(np.float32)
        self._growth: Float = (cones.end_radius - cones.start_radius)[:, None].astype(np.float32)

    def distance(self, points: Float) -> Float:
        """Return (n,) signed distances in metres of (3, n) points."""
        distances, _, _ = self._each(points)
        nearest = distances.min(axis=0)
        distances -= nearest
        distances *= np.float32(-1.0 / BLEND_M)
        np.exp(distances, out=distances)
        summed: Float = nearest - np.float32(BLEND_M) * np.log(distances.sum(axis=0))
        return summed

    def surface(self, points: Float) -> tuple[Float, Float]:
        """Return (3, n) outward unit normals, and (M, n) how much each cone counts, at (3, n) points."""
        distances, along, centre_distances = self._each(points)
        weights = np.exp((distances.min(axis=0) - distances) * np.float32(1.0 / BLEND_M))
        weights /= weights.sum(axis=0)
        pull = weights / np.maximum(centre_distances, np.float32(1e-6))
        normals = points * pull.sum(axis=0) - self._start.T @ pull - self._axis.T @ (pull * along)
        normals /= np.maximum(np.linalg.norm(normals, axis=0), np.float32(1e-6))
        return normals, weights

    def _each(self, points: Float) -> tuple[Float, Float, Float]:
        """Return (M, n) distances to each cone, positions 0..1 along it, and distances to its axis."""
        along = self._axis @ points
        along -= self._along
        position = along * self._inverse
        np.clip(position, 0.0, 1.0, out=position)
        square = self._start @ points
        square *= -2.0
        square += self._offset
        square += np.einsum("in,in->n", points, points)
        along *= 2.0
        along -= position * self._square
        along *= position
        square -= along
        np.maximum(square, 0.0, out=square)
        np.sqrt(square, out=square)
        distances = position * self._growth
        distances += self._radius
        np.subtract(square, distances, out=distances)
        return distances, position, square


@dataclass(frozen=True)
class Rays:
    """n rays from one point.

    Attributes:
        origin: (3,) metres.
        directions: (3, n) unit vectors.
        start: (n,) where to start on each ray, metres; outside the skin.
    """

    origin: Float
    directions: Float
    start: Float


@dataclass(frozen=True)
class Hits:
    """Where n rays meet the skin, or pass it closest.

    Attributes:
        points: (3, n) metres.
        clearance: (n,) how far the ray passes the skin there, metres; 0 or less where it hits.
    """

    points: Float
    clearance: Float


def trace(field: Field, rays: Rays, *, end: float, tolerance: float) -> Hits:
    """Follow rays to the skin.

    Args:
        field: The skin.
        rays: Where to look.
        end: How far along a ray to give up, metres.
        tolerance: How near counts as a hit, metres.
    """
    travelled, best = rays.start.copy(), rays.start.copy()
    clearance = np.full(len(best), np.inf, np.float32)
    active = np.arange(len(best))
    for _ in range(_STEPS):
        here = travelled[active]
        distance = field.distance(rays.origin[:, None] + rays.directions[:, active] * here)
        closer = distance < clearance[active]
        clearance[active] = np.where(closer, distance, clearance[active])
        best[active] = np.where(closer, here, best[active])
        here = here + distance * np.float32(_REACH)
        travelled[active] = here
        active = active[(distance > tolerance) & (here < end)]
        if not len(active):
            break
    return Hits(rays.origin[:, None] + rays.directions * best, clearance)
