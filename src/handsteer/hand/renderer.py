"""Pictures of the hand: traced on a coarse grid around it, shaded, enlarged and laid over a background."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.hand.kinematics import Array, Skeleton
from handsteer.hand.placement import Pinhole, Placement
from handsteer.hand.surface import Cones, Float, Material, hand_cones
from handsteer.hand.tracing import Field, Rays, trace

Image = NDArray[np.uint8]

SKINS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "light": ((0.56, 0.66, 0.88), (0.52, 0.60, 0.89), (0.74, 0.78, 0.97)),
    "medium": ((0.34, 0.46, 0.70), (0.33, 0.42, 0.70), (0.56, 0.62, 0.84)),
    "dark": ((0.14, 0.20, 0.36), (0.15, 0.20, 0.37), (0.34, 0.40, 0.56)),
}
"""Reflected light (blue, green, red; 0 to 1) of the skin, of its redder parts, and of the nails."""

_GRID_CELLS = 14000
_FINEST_PX = 1.0
_MARGIN_M = 0.006
_GAMMA = 0.8
_SPECULAR, _SHININESS = 0.16, 14.0
_AMBIENT, _DIFFUSE = 0.46, 0.62
_OCCLUSION, _OCCLUSION_REACH_M = 0.30, 0.010


@dataclass(frozen=True)
class Look:
    """What the hand looks like.

    Attributes:
        skin: A key of :data:`SKINS`.
        sleeve: Whether the arm wears one.
        sleeve_colour: Blue, green, red, 0 to 1.
        light: (3,) direction to the light in the camera frame; its length does not matter.
        brightness: Factor on all light.
    """

    skin: str = "medium"
    sleeve: bool = True
    sleeve_colour: tuple[float, float, float] = (0.42, 0.30, 0.20)
    light: tuple[float, float, float] = (-0.45, -0.75, -0.75)
    brightness: float = 1.0


def render(skeleton: Skeleton, placement: Placement, camera: Pinhole, look: Look, background: Image) -> Image:
    """Return the picture of the first hand of ``skeleton``.

    Args:
        skeleton: The posed hand.
        placement: Where it is.
        camera: What it is seen by.
        look: What it looks like.
        background: (height, width, 3) uint8 BGR of the camera's size; not changed.

    Returns:
        (height, width, 3) uint8, BGR.
    """
    cones = _placed(hand_cones(skeleton, sleeve=look.sleeve), placement)
    picture = background.copy()
    grid = _Grid.around(cones, camera)
    if grid is None:
        return picture
    colour, cover = _trace_grid(grid, cones, camera, look)
    _lay_over(picture, grid, colour, cover)
    return picture


def _placed(cones: Cones, placement: Placement) -> Cones:
    return Cones(
        placement.apply(cones.start),
        placement.apply(cones.end),
        cones.start_radius,
        cones.end_radius,
        cones.material,
    )


@dataclass(frozen=True)
class _Grid:
    """The part of the image that is traced: its corner and size in cells of ``cell_px`` pixels."""

    left: float
    top: float
    columns: int
    rows: int
    cell_px: float

    @classmethod
    def around(cls, cones: Cones, camera: Pinhole) -> "_Grid | None":
        """Return the grid around what the camera sees of the cones, or None when that is nothing."""
        centres = np.concatenate([cones.start, cones.end])
        radii = np.concatenate([cones.start_radius, cones.end_radius]) + _MARGIN_M
        front = np.maximum(centres[:, 2], 0.05)
        pixels = camera.project(np.column_stack([centres[:, :2], front]))
        reach = (radii / front * camera.focal_px)[:, None] + 2.0
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor((pixels - reach).min(axis=0)), 0, size)
        high = np.clip(np.ceil((pixels + reach).max(axis=0)), 0, size)
        if np.any(high - low < 1):
            return None
        cell = max(_FINEST_PX, float(np.sqrt(np.prod(high - low) / _GRID_CELLS)))
        columns, rows = (int(n) for n in np.ceil((high - low) / cell))
        return cls(float(low[0]), float(low[1]), columns, rows, cell)

    def near_depth(self, cones: Cones, camera: Pinhole) -> Float:
        """Return (rows, columns) how far off the nearest cone can be, metres; infinite where there is none.

        The outlines of the cones are painted one over the other, the nearest last.
        """
        depth = np.full((self.rows, self.columns), np.inf, np.float32)
        ends = np.stack([cones.start, cones.end], axis=1)
        radii = np.stack([cones.start_radius, cones.end_radius], axis=1) + _MARGIN_M
        near = np.maximum(_least_distance(cones) - radii.max(axis=1), 0.02)
        front = np.maximum(ends[..., 2], 0.05)
        pixels = camera.project(np.concatenate([ends[..., :2], front[..., None]], axis=-1))
        cells = np.clip((pixels - [self.left, self.top]) / self.cell_px, -2000, 2000).astype(np.int32)
        reach = np.minimum(radii / front * camera.focal_px / self.cell_px + 1.5, 2000).astype(np.int32)
        for i in np.argsort(-near):
            _paint_outline(depth, cells[i], reach[i], float(near[i]))
        return depth


def _least_distance(cones: Cones) -> Array:
    """Return (M,) how near the axes of the cones come to the camera, metres."""
    axis = cones.end - cones.start
    square = np.maximum(np.sum(axis**2, axis=1), 1e-12)
    along = np.clip(-np.sum(cones.start * axis, axis=1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(cones.start + along[:, None] * axis, axis=1))


def _paint_outline(depth: Float, cells: NDArray[np.int32], reach: NDArray[np.int32], value: float) -> None:
    (first, last), (first_reach, last_reach) = cells, reach
    cv2.circle(depth, first.tolist(), int(first_reach), value, cv2.FILLED)
    cv2.circle(depth, last.tolist(), int(last_reach), value, cv2.FILLED)
    along = (last - first).astype(float)
    length = float(np.hypot(*along))
    if length < 1:
        return
    across = np.array([-along[1], along[0]]) / length
    corners = [first + across * first_reach, last + across * last_reach]
    corners += [last - across * last_reach, first - across * first_reach]
    cv2.fillConvexPoly(depth, np.round(corners).astype(np.int32), value)


def _trace_grid(grid: _Grid, cones: Cones, camera: Pinhole, look: Look) -> tuple[Float, Float]:
    """Return (rows, columns, 3) colours 0..1 and (rows, columns) how much of each cell the hand covers."""
    near = grid.near_depth(cones, camera)
    rows, columns = np.nonzero(np.isfinite(near))
    directions = camera.rays(grid.left + (columns + 0.5) * grid.cell_px, grid.top + (rows + 0.5) * grid.cell_px)
    # Distances are taken about the hand, so that single precision is enough.
    centre = cones.start.mean(axis=0)
    about = Cones(cones.start - centre, cones.end - centre, cones.start_radius, cones.end_radius, cones.material)
    field = Field(about)
    start = near[rows, columns]
    far = float(np.linalg.norm(np.concatenate([cones.start, cones.end]), axis=1).max())
    depth = float(np.median(start)) if len(start) else 1.0
    cell_m = grid.cell_px / camera.focal_px * depth
    hits = trace(field, Rays(-centre.astype(np.float32), directions, start), end=far + 0.05, tolerance=0.1 * cell_m)
    colour = np.zeros((grid.rows, grid.columns, 3), np.float32)
    cover = np.zeros((grid.rows, grid.columns), np.float32)
    seen = hits.clearance < 1.2 * cell_m
    points, directions = hits.points[:, seen], directions[:, seen]
    colour[rows[seen], columns[seen]] = _shade(field, cones, points, directions, look)
    cover[rows[seen], columns[seen]] = np.clip(1.0 - hits.clearance[seen] / cell_m, 0.0, 1.0)
    return colour, cover


def _shade(field: Field, cones: Cones, points: Float, directions: Float, look: Look) -> Float:
    """Return (n, 3) colours 0..1 of the skin at (3, n) points."""
    normals, weights = field.surface(points)
    light = np.array(look.light, np.float32)
    light /= np.linalg.norm(light)
    facing = light @ normals
    half = light[:, None] - directions
    half /= np.linalg.norm(half, axis=0)
    shine = np.maximum(np.einsum("in,in->n", half, normals), 0.0) ** _SHININESS
    # Skin lets light through: its shadows begin later than a plaster hand's.
    diffuse = np.clip((facing + 0.35) / 1.35, 0.0, 1.0)
    gap = field.distance(points + normals * np.float32(_OCCLUSION_REACH_M))
    open_sky = np.clip(gap / np.float32(_OCCLUSION_REACH_M), 0.0, 1.0)
    lit = (_AMBIENT + _DIFFUSE * diffuse) * (1.0 - _OCCLUSION * (1.0 - open_sky))
    palette = np.array([*SKINS[look.skin], look.sleeve_colour], np.float32)
    base = weights.T @ palette[cones.material]
    cloth = weights.T @ (cones.material == Material.SLEEVE).astype(np.float32)
    colours = base * lit[:, None] + (_SPECULAR * shine * (1.0 - cloth))[:, None]
    shaded: Float = np.clip(look.brightness * colours, 0.0, 1.0) ** np.float32(_GAMMA)
    return shaded


def _lay_over(picture: Image, grid: _Grid, colour: Float, cover: Float) -> None:
    """Enlarge the traced cells and lay them over the picture, in place."""
    width = min(int(np.ceil(grid.columns * grid.cell_px)), picture.shape[1] - int(grid.left))
    height = min(int(np.ceil(grid.rows * grid.cell_px)), picture.shape[0] - int(grid.top))
    scale = np.array([[grid.cell_px, 0, 0.5 * grid.cell_px - 0.5], [0, grid.cell_px, 0.5 * grid.cell_px - 0.5]])
    layers = np.dstack([colour * np.float32(255), cover])
    large = cv2.warpAffine(layers, scale, (width, height), flags=cv2.INTER_LINEAR)
    left, top = int(grid.left), int(grid.top)
    patch = picture[top : top + height, left : left + width]
    weight = large[..., 3]
    # The border of a cell is blurred by the enlargement; a steeper step gives back the sharp outline.
    sharp = np.clip((weight - 0.5) * np.float32(min(grid.cell_px, 3.0)) + 0.5, 0.0, 1.0)
    patch[:] = cv2.blendLinear(large[..., :3].astype(np.uint8), patch, sharp, 1.0 - sharp)


def true_pixels(skeleton: Skeleton, placement: Placement, camera: Pinhole) -> Array:
    """Return (21, 2) pixels where the camera sees the joints of the first hand."""
    return camera.project(placement.apply(skeleton.joints[0]))
