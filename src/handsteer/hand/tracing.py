"""Finding where rays meet the skin: sphere tracing through the smooth union of round cones, by numpy."""

from dataclasses import dataclass

import numpy as np

from handsteer.hand.surface import BLEND_M, Cones, Float

_STEPS = 16
_SLOWEST, _LEAP_M = 0.4, np.float32(0.004)  # bounds on the longer steps: least fall a metre, metres added


class Field:
    """The distance to the skin, for many points at once; all in the frame of the cones.

    Arrays are (M cones, n points), so that every sum over the cones runs along the points.
    """

    def __init__(self, cones: Cones) -> None:
        axis = cones.end - cones.start
        # Squares of distances are taken about the hand, so that single precision is enough.
        middle = cones.start.mean(axis=0)
        self._middle: Float = middle[:, None].astype(np.float32)
        first = cones.start - middle
        self._start: Float = first.astype(np.float32)
        self._axis: Float = axis.astype(np.float32)
        square = np.sum(axis**2, axis=1)
        self._square: Float = square[:, None].astype(np.float32)
        self._inverse: Float = (1.0 / np.maximum(square, 1e-12))[:, None].astype(np.float32)
        self._along: Float = np.sum(first * axis, axis=1)[:, None].astype(np.float32)
        self._offset: Float = np.sum(first**2, axis=1)[:, None].astype(np.float32)
        self._radius: Float = cones.start_radius[:, None].astype(np.float32)
        self._growth: Float = (cones.end_radius - cones.start_radius)[:, None].astype(np.float32)

    def distance(self, points: Float) -> Float:
        """Return (n,) signed distances in metres of (3, n) points."""
        distances, _, _ = self._each(points - self._middle)
        nearest = distances.min(axis=0)
        distances -= nearest
        distances *= np.float32(-1.0 / BLEND_M)
        np.exp(distances, out=distances)
        summed: Float = nearest - np.float32(BLEND_M) * np.log(distances.sum(axis=0))
        return summed

    def surface(self, points: Float) -> tuple[Float, Float]:
        """Return (3, n) outward unit normals, and (M, n) how much each cone counts, at (3, n) points."""
        points = points - self._middle
        distances, along, centre_distances = self._each(points)
        weights = np.exp((distances.min(axis=0) - distances) * np.float32(1.0 / BLEND_M))
        weights /= weights.sum(axis=0)
        pull = weights / np.maximum(centre_distances, np.float32(1e-6))
        normals = points * pull.sum(axis=0) - self._start.T @ pull - self._axis.T @ (pull * along)
        normals /= np.maximum(np.linalg.norm(normals, axis=0), np.float32(1e-6))
        return normals, weights

    def _each(self, points: Float) -> tuple[Float, Float, Float]:
        """Return (M, n) distances to each cone, positions along it (0..1), distances to its axis."""
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
class Hits:
    """Where n rays meet the skin, or pass it closest.

    Attributes:
        points: (3, n) metres.
        travelled: (n,) how far along the rays, metres.
        clearance: (n,) signed distance of the ray to the skin there, metres; about 0 where it hits.
    """

    points: Float
    travelled: Float
    clearance: Float


def trace(
    field: Field, directions: Float, start: Float, *, end: float, tolerance: float, width_rad: float = 0.0
) -> Hits:
    """Follow rays from the camera to the skin.

    A step is the distance (J. C. Hart, *Sphere tracing*, 1996), and longer where a ray grazes: as far as the skin
    would be if the distance went on falling as it did in the last step. A step too far is taken back by the next.

    Args:
        field: The skin.
        directions: (3, n) unit vectors.
        start: (n,) where to start on each ray, metres; outside the skin.
        end: How far along a ray to give up, metres.
        tolerance: How near counts as a hit, metres.
        width_rad: Radius of a ray, growing with its distance, that must not touch the skin: then all rays within it
            can go on from there.
    """
    here, best, ahead = start, start.copy(), directions
    clearance = np.full(len(best), np.inf, np.float32)
    active = np.arange(len(best))
    before, step = clearance.copy(), np.ones_like(start)
    for _ in range(_STEPS):
        distance = field.distance(ahead * here)
        if width_rad:
            distance -= np.float32(width_rad) * here
        gap = np.abs(distance)
        closer = gap < np.abs(clearance[active])
        nearer = active[closer]
        clearance[nearer], best[nearer] = distance[closer], here[closer]
        falling = np.clip((before - distance) / step, _SLOWEST, 1.0)
        step = np.minimum(distance / falling, distance + _LEAP_M)
        going = (gap > tolerance) & (here < end)
        active, ahead = active[going], ahead[:, going]
        here, before, step = here[going] + step[going], distance[going], step[going]
        if not len(active):
            break
    return Hits(directions * best, best, clearance)
