"""Intersects rays with the skin, the smooth union of round cones, in NumPy.

Rays are bundled in square tiles of the picture, each with the few cones that are near it. Where the ray enters each
cone has a closed form (a quadratic equation), and the smooth union adds at most millimetres to the first of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import Array
from handsteer.plugins.virtual_hand.poses import Pinhole
from handsteer.plugins.virtual_hand.surface import BLEND_M, MARGIN_M, Cones, Float, Material

TILE = 8
"""Cells per side of a tile."""
NEAREST_M = 0.05
"""Depth from which things are drawn, metres."""
_MOST_CELLS, _CELLS_A_PIXEL = 14000, 0.11
_LEAST_CELL_PX = 1.0
_GROUPS = 4  # of tiles, traced one after the other
_REACH_M = 0.006  # distance from a cone beyond which it hardly changes the skin
_OUTSIDE_M = 0.002  # what the smooth union adds to the outline at most, nearly
_MOST_BLEND_M = np.float32(0.0015)  # what it adds elsewhere, seldom more
_MISSED = np.float32(1000.0)  # how much farther a cone counts that a ray misses, per metre by which it does
_LEAST_FALL = 0.3  # of the distance to the skin along a ray, in a step
_LEAST_STEEP, _LEAST_SQUARE = 1e-3, 1e-10  # so that nothing is divided by zero
_FAR_M = 100.0  # out of sight
_SKY_M = np.float32(0.010)


@dataclass(frozen=True)
class Grid:
    """A grid over a part of the image.

    Attributes:
        left: Pixels from the image's left edge.
        top: Pixels from its top.
        columns: Tiles.
        rows: Tiles.
        cell_px: Size of a cell in pixels; a tile has :data:`TILE` cells per side.
    """

    left: int
    top: int
    columns: int
    rows: int
    cell_px: float

    @classmethod
    def around(cls, cones: Cones, camera: Pinhole) -> "Grid | None":
        """Return the grid around the projection of the cones; None if they are out of view."""
        if not len(cones.start):
            return None
        pixels, scale = _seen(cones, camera)
        reach = (np.stack([cones.start_radius, cones.end_radius], axis=1) + MARGIN_M) * scale
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor((pixels - reach[..., None]).min(axis=(0, 1))), 0, size)
        high = np.clip(np.ceil((pixels + reach[..., None]).max(axis=(0, 1))), 0, size)
        if np.any(high - low < 1):
            return None
        cells = min(_MOST_CELLS, _CELLS_A_PIXEL * camera.width * camera.height)
        cell = max(_LEAST_CELL_PX, float(np.sqrt(np.prod(high - low) / cells)))
        tiles = np.ceil((high - low) / (cell * TILE)).astype(int)
        return cls(int(low[0]), int(low[1]), int(tiles[0]), int(tiles[1]), cell)

    def directions(self, tiles: NDArray[np.int64], camera: Pinhole) -> Float:
        """Return (T, 3, n) unit vectors to the cells of T tiles, numbered row by row."""
        row, column = np.divmod(np.arange(TILE * TILE), TILE)
        first_row, first_column = np.divmod(tiles[:, None], self.columns)
        x = (first_column * TILE + column + 0.5) * self.cell_px + self.left
        y = (first_row * TILE + row + 0.5) * self.cell_px + self.top
        return camera.rays(x.astype(np.float32), y.astype(np.float32)).swapaxes(0, 1)

    def near(self, cones: Cones, camera: Pinhole) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the numbers of the T tiles that the hand may be seen in, and (T, M) flags of the cones near each."""
        side = TILE * self.cell_px
        pixels, scale = (each.astype(np.float32) for each in _seen(cones, camera))
        radii = np.stack([cones.start_radius, cones.end_radius], axis=1).astype(np.float32) * scale
        axis = pixels[:, 1] - pixels[:, 0]
        row, column = np.divmod(np.arange(self.rows * self.columns, dtype=np.float32)[:, None], self.columns)
        x = (column + 0.5) * side + self.left - pixels[:, 0, 0]
        y = (row + 0.5) * side + self.top - pixels[:, 0, 1]
        along = (x * axis[:, 0] + y * axis[:, 1]) / np.maximum(np.sum(axis**2, axis=1), np.float32(1e-6))
        np.clip(along, 0.0, 1.0, out=along)
        gap = np.hypot(x - along * axis[:, 0], y - along * axis[:, 1])
        gap -= radii[:, 0] + along * (radii[:, 1] - radii[:, 0]) + np.float32(np.sqrt(0.5) * side)
        gap /= scale.max(axis=1)
        outside = _OUTSIDE_M + 1.5 * self.cell_px / scale.min()
        tiles = np.flatnonzero(gap.min(axis=1) < outside)
        return tiles, gap[tiles] < max(_REACH_M, outside)


def _seen(cones: Cones, camera: Pinhole) -> tuple[Array, Array]:
    """Return the (M, 2, 2) pixels of the cones' ends, and the (M, 2) pixels of a metre there."""
    ends = np.stack([cones.start, cones.end], axis=1)
    return camera.project(ends), camera.focal_px / ends[..., 2]


@dataclass(frozen=True)
class Hits:
    """What the rays to T tiles of n cells hit, or where they pass the skin closest.

    Attributes:
        directions: (T, 3, n) unit vectors.
        travelled: (T, n) distances along the rays, metres.
        normals: (T, 3, n) outward unit vectors.
        materials: (T, 4, n) shares of each :class:`~handsteer.plugins.virtual_hand.surface.Material`.
        clearance: (T, n) distances to the skin, metres; 0 or less for a hit.
        sky: (T, n) share of the space just above the skin that is free.
    """

    directions: Float
    travelled: Float
    normals: Float
    materials: Float
    clearance: Float
    sky: Float


def trace(grid: Grid, cones: Cones, camera: Pinhole) -> tuple[NDArray[np.int64], Hits]:
    """Return the numbers of the tiles that the hand may be seen in, and what their rays hit."""
    tiles, near = grid.near(cones, camera)
    # Tiles with about as many cones are traced together, and their data stays in the processor's cache.
    order = np.argsort(near.sum(axis=1), kind="stable")
    tiles, near = tiles[order], near[order]
    directions = grid.directions(tiles, camera)
    groups = np.array_split(np.arange(len(tiles)), max(1, min(_GROUPS, len(tiles))))
    rows = _rows(cones)
    parts = [_Bundle(rows, near[group], directions[group]).hits() for group in groups]
    fields = [np.concatenate(field) for field in zip(*parts, strict=True)]
    return tiles, Hits(directions, *fields)


def _rows(cones: Cones) -> Float:
    """Return (M + 1, 15) numbers of the cones, as :class:`_Bundle` takes them apart; the last is out of sight."""
    axis = cones.end - cones.start
    length = np.maximum(np.linalg.norm(axis, axis=1), 1e-9)[:, None]
    axis /= length
    growth = (cones.end_radius - cones.start_radius)[:, None] / length
    offset, square = np.sum(cones.start * axis, axis=1), np.sum(cones.start**2, axis=1)
    materials = np.eye(len(Material))[cones.material]
    rows = np.zeros((len(axis) + 1, 15), np.float32)
    rows[:-1] = np.column_stack([cones.start, axis, materials, length, cones.start_radius, growth, offset, square])
    rows[-1, -1] = _FAR_M**2
    return rows


class _Bundle:
    """Rays to T tiles, n cells each, with the at most K cones near each tile; arrays are (T, K, n) or broadcast to it.

    Args:
        rows: The cones, of :func:`_rows`.
        near: (T, M) flags of the cones near each tile.
        directions: (T, 3, n) unit vectors.
    """

    def __init__(self, rows: Float, near: NDArray[np.bool_], directions: Float) -> None:
        counts = near.sum(axis=1)
        which = np.argsort(~near, axis=1, kind="stable")[:, : counts.max(initial=1)]
        which[np.arange(which.shape[1]) >= counts[:, None]] = len(rows) - 1
        columns = rows[which]
        self._directions = directions
        self._start, self._axis, self._materials = columns[..., :3], columns[..., 3:6], columns[..., 6:10]
        numbers = (columns[..., column, None] for column in range(10, 15))
        self._length, self._radius, self._growth, self._offset, self._square = numbers

    def hits(self) -> tuple[Float, Float, Float, Float, Float]:
        """Return the fields of :class:`Hits`, without the directions."""
        travelled, clearance = self._first()
        points = self._directions * travelled
        distances, along, centre_distances = self._each(points)
        distance, weights = _smooth_least(distances)
        materials = self._materials.swapaxes(1, 2) @ weights
        weights /= centre_distances
        normals = points * weights.sum(axis=1, keepdims=True) - self._start.swapaxes(1, 2) @ weights
        weights *= along
        normals -= self._axis.swapaxes(1, 2) @ weights
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.float32(1e-6))
        raised = points.copy()
        raised += normals * _SKY_M
        above, _ = _smooth_least(self._each(raised)[0])
        sky = np.clip((above - distance) / _SKY_M, 0.0, 1.0)
        clearance = np.minimum(clearance, distance)
        return travelled[:, 0], normals, materials, clearance[:, 0], sky[:, 0]

    def _first(self) -> tuple[Float, Float]:
        """Return (T, 1, n) distances along the rays to the skin, and bounds on the clearance from it, metres."""
        balls = self._balls()
        travelled = balls.enter(_MOST_BLEND_M)
        travelled = np.maximum(travelled, balls.enter(balls.union(travelled)[2]))
        # A step of Newton's method; a ray that misses the skin stays where it passes closest.
        distance, fall, _ = balls.union(travelled)
        hits = (balls.clearance < 0) | (distance < 0)
        step = np.where(hits, distance / np.clip(fall, _LEAST_FALL, 1.0), 0.0)
        return np.maximum(travelled + step, NEAREST_M), balls.clearance

    def _balls(self) -> "_Balls":
        """Find the ball of each cone that a ray enters first, or passes closest to."""
        # With the ray's direction d, the axis u and its start s: t along the ray is at level + slope * (t - middle)
        # along the axis, and there the square of its distance from the axis is (t - middle)^2 + square - (...)^2.
        slope, middle = self._axis @ self._directions, self._start @ self._directions
        level, square = slope * middle - self._offset, self._square - middle * middle
        # The quadratic equation of where this is the square of the radius, as if the cone had no ends. In place, as
        # the time goes into reading and writing memory.
        radius = self._growth * level
        radius += self._radius
        turn = self._growth * radius
        turn += level
        turn *= slope
        across = slope * slope
        steep = across * (-1.0 - self._growth**2)
        steep += 1.0
        np.maximum(steep, _LEAST_STEEP, out=steep)
        radius *= radius
        radius += level * level
        radius -= square
        radius *= steep
        radius += turn * turn
        np.maximum(radius, 0.0, out=radius)
        turn -= np.sqrt(radius, out=radius)
        turn /= steep
        turn *= slope
        turn += level
        along = np.clip(turn, 0.0, self._length, out=turn)
        # How close the ray passes to that point of the axis.
        np.subtract(1.0, across, out=across)
        across *= along
        across -= level
        across -= level
        across *= along
        square += across
        np.maximum(square, _LEAST_SQUARE, out=square)
        return _Balls(middle + along * slope, square, self._radius + self._growth * along)

    def _each(self, points: Float) -> tuple[Float, Float, Float]:
        """Return the distances of (T, 3, n) points to each cone, positions along it, and distances to its axis."""
        level = self._axis @ points
        level -= self._offset
        along = np.clip(level, 0.0, self._length)
        level *= -2.0
        level += along
        level *= along
        level += self._square
        level -= 2.0 * (self._start @ points)
        level += np.einsum("tin,tin->tn", points, points)[:, None]
        np.maximum(level, _LEAST_SQUARE, out=level)
        centre_distances = np.sqrt(level, out=level)
        radius = along * self._growth
        radius += self._radius
        return centre_distances - radius, along, centre_distances


class _Balls:
    """Balls that rays enter or pass, one of each cone.

    Args:
        middle: (T, K, n) distances along the rays at which they pass the centres closest, metres.
        square: (T, K, n) squares of how close.
        radius: (T, K, n) radii, metres.
    """

    def __init__(self, middle: Float, square: Float, radius: Float) -> None:
        self._middle, self._square, self._radius = middle, square, radius
        self._gap = np.sqrt(square) - radius
        self.clearance: Float = self._gap.min(axis=1, keepdims=True)

    def enter(self, blend: Float | np.float32) -> Float:
        """Return where the rays enter the first ball, or pass closest to one, if all are thicker by ``blend``."""
        missed = self._gap - np.maximum(self.clearance, blend)
        np.maximum(missed, 0.0, out=missed)
        missed *= _MISSED
        missed += self._middle
        inside = self._radius + blend
        inside *= inside
        inside -= self._square
        np.maximum(inside, 0.0, out=inside)
        missed -= np.sqrt(inside, out=inside)
        first: Float = missed.min(axis=1, keepdims=True)
        return first

    def union(self, travelled: Float) -> tuple[Float, Float, Float]:
        """Return the distance to their smooth union there, how much it falls along the ray, and what the union adds."""
        ahead = travelled - self._middle
        distances = ahead * ahead
        distances += self._square
        np.sqrt(distances, out=distances)
        ahead /= distances
        distances -= self._radius
        nearest = distances.min(axis=1, keepdims=True)
        distance, weights = _smooth_least(distances)
        ahead *= weights
        return distance, -ahead.sum(axis=1, keepdims=True), nearest - distance


def _smooth_least(distances: Float) -> tuple[Float, Float]:
    """Return the (T, 1, n) smooth minimum of (T, K, n) distances, and their weights, in place of the distances."""
    nearest = distances.min(axis=1, keepdims=True)
    weights = np.subtract(nearest, distances, out=distances)
    weights *= np.float32(1.0 / BLEND_M)
    np.exp(weights, out=weights)
    total = weights.sum(axis=1, keepdims=True)
    weights /= total
    np.log(total, out=total)
    total *= np.float32(BLEND_M)
    nearest -= total
    return nearest, weights
