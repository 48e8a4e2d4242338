"""Renders the hand: traced on a coarse grid around it, shaded, upscaled and composed with a background."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.hand.kinematics import Array, Skeleton
from handsteer.hand.placement import Pinhole, Placement
from handsteer.hand.surface import Cones, Float, Material, hand_cones
from handsteer.hand.tracing import BLOCK, Field, Grid, trace

Image = NDArray[np.uint8]

SKINS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "light": ((0.56, 0.66, 0.88), (0.52, 0.60, 0.89), (0.74, 0.78, 0.97)),
    "medium": ((0.34, 0.46, 0.70), (0.33, 0.42, 0.70), (0.56, 0.62, 0.84)),
    "dark": ((0.14, 0.20, 0.36), (0.15, 0.20, 0.37), (0.34, 0.40, 0.56)),
}
"""Reflectance (blue, green, red; 0 to 1) of the skin, of its redder parts, and of the nails."""

_STRIPS = 3
_TOLERANCE = 0.08  # in cells
_NEAR_M = 0.002  # end of the tracing of whole blocks
_EDGE = 0.75  # nearness at the hand's outline
_GAMMA = 0.8
_SPECULAR, _SHININESS = 0.24, 14.0
_AMBIENT, _DIFFUSE = 0.46, 0.62
_OCCLUSION, _OCCLUSION_REACH_M = 0.22, 0.010


@dataclass(frozen=True)
class Look:
    """The appearance of the hand.

    Attributes:
        skin: A key of :data:`SKINS`.
        sleeve: Whether the arm has a sleeve.
        sleeve_colour: Blue, green, red, 0 to 1.
        light: (3,) direction to the light in the camera frame, of any length.
        brightness: Factor on all light.
    """

    skin: str = "medium"
    sleeve: bool = True
    sleeve_colour: tuple[float, float, float] = (0.42, 0.30, 0.20)
    light: tuple[float, float, float] = (-0.45, -0.75, -0.75)
    brightness: float = 1.0


def render(skeleton: Skeleton, placement: Placement, camera: Pinhole, look: Look, background: Image) -> Image:
    """Return a picture of the first hand of ``skeleton``.

    Args:
        skeleton: The posed hand.
        placement: Its pose in the camera frame.
        camera: The camera.
        look: Its appearance.
        background: (height, width, 3) uint8 BGR of the camera's size; not modified.

    Returns:
        (height, width, 3) uint8, BGR.
    """
    cones = hand_cones(skeleton, sleeve=look.sleeve).placed(placement)
    picture = background.copy()
    grid = Grid.around(cones, camera)
    if grid is not None:
        _lay_over(picture, grid, *_trace_grid(grid, cones, camera, look))
    return picture


def _trace_grid(grid: Grid, cones: Cones, camera: Pinhole, look: Look) -> tuple[Float, Float]:
    """Return (rows, columns, 3) colours, 0 to 1, and each cell's (rows, columns) nearness to the hand, 1 on it.

    Processed in strips: each contains few cones, and their data stays in the processor's cache.
    """
    colour = np.zeros((grid.rows, grid.columns, 3), np.float32)
    cover = np.zeros((grid.rows, grid.columns), np.float32)
    near = _near_depth(grid, cones, camera)
    rows, columns = np.nonzero(np.isfinite(near))
    for cells in np.array_split(np.arange(len(rows)), _STRIPS):
        if len(cells):
            row, column = rows[cells], columns[cells]
            strip = cones.only(grid.cones_between(int(row[0]), int(row[-1]), cones, camera))
            directions = grid.directions(column + 0.5, row + 0.5, camera)
            cell_rad = grid.cell_px / camera.focal_px
            colour[row, column], cover[row, column] = _look_along(directions, near[row, column], cell_rad, strip, look)
    return colour, cover


def _near_depth(grid: Grid, cones: Cones, camera: Pinhole) -> Float:
    """Return the (rows, columns) depth to which each cell's ray is surely free; infinite if it misses the hand.

    Blocks of cells are traced as one thick ray each (the first pass of cone marching).
    """
    shape = grid.rows // BLOCK, grid.columns // BLOCK
    row, column = (at.ravel() * BLOCK + BLOCK / 2 for at in np.indices(shape))
    width_rad = (BLOCK * np.sqrt(0.5) + 1.0) * grid.cell_px / camera.focal_px
    near, far = cones.depths()
    start = np.full(len(row), near, np.float32)
    directions = grid.directions(column, row, camera)
    hits = trace(Field(cones), directions, start, end=far, tolerance=_NEAR_M, width_rad=width_rad)
    depth = np.where(hits.clearance <= 2 * _NEAR_M, hits.travelled, np.inf).astype(np.float32)
    return depth.reshape(shape).repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)


def _look_along(directions: Float, near: Float, cell_rad: float, cones: Cones, look: Look) -> tuple[Float, Float]:
    """Return (n, 3) colours and (n,) nearness along (3, n) directions, ``cell_rad`` apart."""
    field = Field(cones)
    cell_m = cell_rad * float(np.median(near))
    hits = trace(field, directions, near, end=cones.depths()[1], tolerance=_TOLERANCE * cell_m)
    colour = np.zeros((len(near), 3), np.float32)
    seen = hits.clearance < 1.7 * cell_m
    clearance = hits.clearance[seen]
    colour[seen] = _shade(cones, hits.points[:, seen], clearance, directions[:, seen], look)
    return colour, np.clip(1.0 + _TOLERANCE - hits.clearance / np.float32(cell_m), 0.0, 1.0)


def _shade(cones: Cones, points: Float, clearance: Float, directions: Float, look: Look) -> Float:
    """Return the (n, 3) colours, 0 to 1, of the skin at (3, n) points with (n,) ``clearance`` from it."""
    field = Field(cones)
    normals, weights = field.surface(points)
    light = np.array(look.light, np.float32)
    light /= np.linalg.norm(light)
    facing = light @ normals
    half = light[:, None] - directions
    half /= np.linalg.norm(half, axis=0)
    shine = np.maximum(np.einsum("in,in->n", half, normals), 0.0) ** _SHININESS
    # Skin is translucent: its shadows begin later than those of an opaque surface.
    diffuse = np.clip((facing + 0.35) / 1.35, 0.0, 1.0)
    gap = field.distance(points + normals * np.float32(_OCCLUSION_REACH_M)) - clearance
    open_sky = np.clip(gap / np.float32(_OCCLUSION_REACH_M), 0.0, 1.0)
    lit = (_AMBIENT + _DIFFUSE * diffuse) * (1.0 - _OCCLUSION * (1.0 - open_sky))
    palette = np.array([*SKINS[look.skin], look.sleeve_colour], np.float32)
    base = weights.T @ palette[cones.material]
    cloth = weights.T @ (cones.material == Material.SLEEVE).astype(np.float32)
    colours = base * lit[:, None] + (_SPECULAR * shine * (1.0 - cloth))[:, None]
    shaded: Float = np.clip(look.brightness * colours, 0.0, 1.0) ** np.float32(_GAMMA)
    return shaded


def _lay_over(picture: Image, grid: Grid, colour: Float, cover: Float) -> None:
    """Upscale the traced cells and compose them with the picture, in place."""
    width = min(int(np.ceil(grid.columns * grid.cell_px)), picture.shape[1] - grid.left)
    height = min(int(np.ceil(grid.rows * grid.cell_px)), picture.shape[0] - grid.top)
    scale = np.array([[grid.cell_px, 0, 0.5 * grid.cell_px - 0.5], [0, grid.cell_px, 0.5 * grid.cell_px - 0.5]])
    layers = np.dstack([colour * np.float32(255), cover])
    large = cv2.warpAffine(layers, scale, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    patch = picture[grid.top : grid.top + height, grid.left : grid.left + width]
    weight = large[..., 3]
    # Upscaling blurs the border of a cell; a steeper step restores the sharp outline.
    sharp = np.clip((weight - _EDGE) * np.float32(min(grid.cell_px, 4.0)) + 0.5, 0.0, 1.0)
    patch[:] = cv2.blendLinear(large[..., :3].astype(np.uint8), patch, sharp, 1.0 - sharp)


def true_pixels(skeleton: Skeleton, placement: Placement, camera: Pinhole) -> Array:
    """Return the (21, 2) pixels of the first hand's joints."""
    return camera.project(placement.apply(skeleton.joints[0]))
