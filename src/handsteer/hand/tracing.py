"""Intersects rays with the skin: sphere tracing of the smooth union of round cones, in NumPy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.hand.kinematics import Array
from handsteer.hand.placement import Pinhole
from handsteer.hand.surface import BLEND_M, MARGIN_M, Cones, Float

_MOST_CELLS, _CELLS_A_PIXEL = 14000, 0.11
BLOCK = 4
"""Cells per side of the blocks that are traced first."""
_LEAST_CELL_PX = 1.0
_NEAREST_M = 0.05  # minimum depth for the projection


@dataclass(frozen=True)
class Grid:
    """A grid over a part of the image.

    Attributes:
        left: Pixels from the image's left edge.
        top: Pixels from its top.
        columns: Cells.
        rows: Cells.
        cell_px: Size of a cell in pixels.
    """

    left: int
    top: int
    columns: int
    rows: int
    cell_px: float

    @classmethod
    def around(cls, cones: Cones, camera: Pinhole) -> "Grid | None":
        """Return the grid around the projection of the cones; None if they are out of view."""
        pixels, reach = _seen(cones, camera)
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor((pixels - reach[..., None]).min(axis=(0, 1))), 0, size)
        high = np.clip(np.ceil((pixels + reach[..., None]).max(axis=(0, 1))), 0, size)
        if np.any(high - low < 1):
            return None
        cells = min(_MOST_CELLS, _CELLS_A_PIXEL * camera.width * camera.height)
        cell = max(_LEAST_CELL_PX, float(np.sqrt(np.prod(high - low) / cells)))
        blocks = np.ceil((high - low) / (cell * BLOCK)).astype(int)
        return cls(int(low[0]), int(low[1]), int(blocks[0]) * BLOCK, int(blocks[1]) * BLOCK, cell)

    def directions(self, columns: ArrayLike, rows: ArrayLike, camera: Pinhole) -> Float:
        """Return (3, n) unit vectors to the (n,) positions ``columns`` and ``rows``, in cells."""
        x, y = np.asarray(columns) * self.cell_px + self.left, np.asarray(rows) * self.cell_px + self.top
        return camera.rays(x, y)

    def cones_between(self, first_row: int, last_row: int, cones: Cones, camera: Pinhole) -> NDArray[np.bool_]:
        """Return (M,) flags of the cones that may be visible between two rows of cells."""
        pixels, reach = _seen(cones, camera)
        rows = (pixels[..., 1] - self.top) / self.cell_px
        reach = reach / self.cell_px + 1.5
        inside = ((rows + reach).max(axis=1) >= first_row) & ((rows - reach).min(axis=1) <= last_row)
        return np.asarray(inside)


def _seen(cones: Cones, camera: Pinhole) -> tuple[Array, Array]:
    """Return the (M, 2, 2) pixels of the cones' ends and their (M, 2) radii in pixels."""
    ends = np.stack([cones.start, cones.end], axis=1)
    ends[..., 2] = np.maximum(ends[..., 2], _NEAREST_M)
    radii = np.stack([cones.start_radius, cones.end_radius], axis=1) + MARGIN_M
    return camera.project(ends), radii / ends[..., 2] * camera.focal_px


_STEPS = 16
_SLOWEST, _LEAP_M = 0.4, np.float32(0.004)  # bounds on the longer steps: least fall per metre, metres added


class Field:
    """The distance to the skin for many points at once, in the frame of the cones.

    Arrays are (M cones, n points), so that sums over the cones run along the points.
    """

    def __init__(self, cones: Cones) -> None:
        axis = cones.end - cones.start
        # Squared distances are relative to the hand, so that single precision suffices.
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
        """Return (3, n) outward unit normals, and (M, n) weights of the cones, at (3, n) points."""
        points = points - self._middle
        distances, along, centre_distances = self._each(points)
        weights = np.exp((distances.min(axis=0) - distances) * np.float32(1.0 / BLEND_M))
        weights /= weights.sum(axis=0)
        pull = weights / np.maximum(centre_distances, np.float32(1e-6))
        normals = points * pull.sum(axis=0) - self._start.T @ pull - self._axis.T @ (pull * along)
        normals /= np.maximum(np.linalg.norm(normals, axis=0), np.float32(1e-6))
        return normals, weights

    def _each(self, points: Float) -> tuple[Float, Float, Float]:
        """Return (M, n) distances to each cone, positions along it (0 to 1), and distances to its axis."""
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
    """The points at which n rays hit the skin, or pass it closest.

    Attributes:
        points: (3, n) metres.
        travelled: (n,) distances along the rays, metres.
        clearance: (n,) signed distances to the skin there, metres; about 0 for a hit.
    """

    points: Float
    travelled: Float
    clearance: Float


def trace(
    field: Field, directions: Float, start: Float, *, end: float, tolerance: float, width_rad: float = 0.0
) -> Hits:
    """Trace rays from the camera to the skin.

    A step is the distance (J. C. Hart, *Sphere tracing*, 1996), and longer for grazing rays: as far as the skin would
    be if the distance decreased further as in the last step. A step too far is corrected by the next.

    Args:
        field: The skin.
        directions: (3, n) unit vectors.
        start: (n,) start on each ray, metres; outside the skin.
        end: Maximum distance along a ray, metres.
        tolerance: Distance that counts as a hit, metres.
        width_rad: Radius of a ray, growing with its distance, that must not touch the skin, so that all rays within it
            can continue from there.
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
