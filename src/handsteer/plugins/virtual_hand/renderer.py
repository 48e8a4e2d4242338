"""Renders the hand: traced on a coarse grid around it, shaded, upscaled and composed with a background."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ConfigError
from handsteer.plugins.virtual_hand.kinematics import Array, Skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole, Placement
from handsteer.plugins.virtual_hand.surface import Float, Material, hand_cones
from handsteer.plugins.virtual_hand.tracing import NEAREST_M, TILE, Grid, Hits, trace

Image = NDArray[np.uint8]

SKINS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "light": ((0.56, 0.66, 0.88), (0.52, 0.60, 0.89), (0.74, 0.78, 0.97)),
    "medium": ((0.34, 0.46, 0.70), (0.33, 0.42, 0.70), (0.56, 0.62, 0.84)),
    "dark": ((0.14, 0.20, 0.36), (0.15, 0.20, 0.37), (0.34, 0.40, 0.56)),
}
"""Reflectance (blue, green, red; 0 to 1) of the skin, of its redder parts, and of the nails."""

_TOUCHING, _EDGE = 1.08, 0.75  # nearness to the hand, of at most 1, where a ray touches it and at its drawn outline
_GAMMA = 0.8
_SPECULAR, _SHININESS = 0.24, 14.0
_AMBIENT, _DIFFUSE = 0.46, 0.62
_OCCLUSION = 0.22
_SLEEVE = (0.42, 0.30, 0.20)  # blue, green, red


@dataclass(frozen=True)
class Look:
    """The appearance of the hand.

    Attributes:
        skin: A key of :data:`SKINS`.
        sleeve: Whether the arm has a sleeve.
        light: (3,) direction to the light in the camera frame, of any length.
        brightness: Factor on all light.
    """

    skin: str = "medium"
    sleeve: bool = True
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
    cones = hand_cones(skeleton, sleeve=look.sleeve).placed(placement).beyond(NEAREST_M)
    picture = background.copy()
    grid = Grid.around(cones, camera)
    if grid is not None:
        tiles, hits = trace(grid, cones, camera)
        layers = np.zeros((grid.rows * grid.columns, 4, TILE, TILE), np.uint8)
        layers[tiles, :3] = (255 * _shade(hits, look)).reshape(-1, 3, TILE, TILE)
        cells_m = hits.travelled * np.float32(grid.cell_px / camera.focal_px)
        nearness = np.clip(_TOUCHING - hits.clearance / cells_m, 0.0, 1.0)
        layers[tiles, 3] = (255 * nearness).reshape(-1, TILE, TILE)
        layers = layers.reshape(grid.rows, grid.columns, 4, TILE, TILE).transpose(0, 3, 1, 4, 2)
        _lay_over(picture, grid, layers.reshape(grid.rows * TILE, grid.columns * TILE, 4))
    return picture


def _shade(hits: Hits, look: Look) -> Float:
    """Return the (T, 3, n) colours, 0 to 1, of what is hit in T tiles of n cells."""
    light = np.array(look.light, np.float32)
    light /= np.linalg.norm(light)
    half = light[:, None] - hits.directions
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shine = np.maximum(np.einsum("tin,tin->tn", half, hits.normals), 0.0) ** _SHININESS
    # Skin is translucent: its shadows begin later than those of an opaque surface.
    diffuse = np.clip((light @ hits.normals + 0.35) / 1.35, 0.0, 1.0)
    lit = (_AMBIENT + _DIFFUSE * diffuse) * (1.0 - _OCCLUSION * (1.0 - hits.sky))
    palette = np.array([*SKINS[look.skin], _SLEEVE], np.float32)
    cloth = hits.materials[:, Material.SLEEVE]
    colours = palette.T @ hits.materials * lit[:, None] + (_SPECULAR * shine * (1.0 - cloth))[:, None]
    shaded: Float = np.clip(look.brightness * colours, 0.0, 1.0) ** np.float32(_GAMMA)
    return shaded


def _lay_over(picture: Image, grid: Grid, layers: Image) -> None:
    """Enlarge (rows, columns, 4) colours and nearness to the hand of the cells, and lay them over the picture."""
    large = cv2.resize(layers, None, fx=grid.cell_px, fy=grid.cell_px, interpolation=cv2.INTER_LINEAR)
    patch = picture[grid.top : grid.top + large.shape[0], grid.left : grid.left + large.shape[1]]
    large = large[: patch.shape[0], : patch.shape[1]]
    # Upscaling blurs the border of a cell; a steeper step restores the sharp outline.
    steps = (np.linspace(0.0, 1.0, 256) - _EDGE) * min(grid.cell_px, 4.0) + 0.5
    table = (255 * np.clip(steps, 0.0, 1.0)).astype(np.uint8)
    weight = cv2.cvtColor(cv2.LUT(cv2.extractChannel(large, 3), table), cv2.COLOR_GRAY2BGR)
    colour = cv2.multiply(cv2.cvtColor(large, cv2.COLOR_BGRA2BGR), weight, scale=1 / 255)
    behind = cv2.multiply(patch, cv2.bitwise_not(weight), scale=1 / 255)
    cv2.add(colour, behind, dst=patch)


def true_pixels(skeleton: Skeleton, placement: Placement, camera: Pinhole) -> Array:
    """Return the (21, 2) pixels of the first hand's joints."""
    return camera.project(placement.apply(skeleton.joints[0]))


def make_background(kind: str, width: int, height: int, seed: int = 0) -> NDArray[np.uint8]:
    """Return a (height, width, 3) uint8 BGR picture; deterministic.

    Args:
        kind: ``plain`` or ``cluttered``.
        width: Pixels.
        height: Pixels.
        seed: Selects one of many walls or rooms.

    Raises:
        ConfigError: ``kind`` is unknown.
    """
    random = np.random.default_rng(seed)
    if kind not in ("plain", "cluttered"):
        raise ConfigError(f"background: {kind!r} should be 'plain' or 'cluttered'")
    picture = _wall(width, height, random)
    if kind == "cluttered":
        _put_things(picture, random)
    noise = random.normal(0, 2.0, (height, width, 1))
    image: NDArray[np.uint8] = np.clip(picture + noise, 0, 255).astype(np.uint8)
    return image


def _wall(width: int, height: int, random: np.random.Generator) -> NDArray[np.float32]:
    """Return a wall lit from one side."""
    colour = random.uniform(120, 205) * np.array([1.0, 1.0, 1.0]) + random.uniform(-14, 14, 3)
    towards = random.uniform(-1, 1, 2)
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    light = 1.0 + 0.10 * (towards[0] * x + towards[1] * y) - 0.05 * (x**2 + y**2)
    wall: NDArray[np.float32] = (light[..., None] * colour).astype(np.float32)
    return wall


def _put_things(picture: NDArray[np.float32], random: np.random.Generator) -> None:
    """Paint shelves, boxes, books and round things, out of focus, in place."""
    height, width = picture.shape[:2]
    unit = max(height, 8) / 480
    for _ in range(26):
        # Colours in real rooms are closer to grey than random ones.
        colour = (random.uniform(25, 225) + random.normal(0, 22, 3)).tolist()
        x, y = random.uniform(0, width), random.uniform(0, height)
        if random.random() < 0.7:
            size = random.uniform((12, 20), (150, 170)) * unit
            turn = random.choice([0.0, 0.0, 90.0, random.uniform(-20, 20)])
            corners = cv2.boxPoints(((x, y), (float(size[0]), float(size[1])), float(turn)))
            cv2.fillConvexPoly(picture, corners.astype(np.int32), colour)
        else:
            cv2.circle(picture, (int(x), int(y)), max(1, int(random.uniform(10, 55) * unit)), colour, cv2.FILLED)
    blur = max(0.8, 1.6 * unit)
    cv2.GaussianBlur(picture, (0, 0), blur, dst=picture)
