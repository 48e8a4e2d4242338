"""Backgrounds for the rendered hand: a plain wall, or a cluttered room."""

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ConfigError

Image = NDArray[np.uint8]


def make_background(kind: str, width: int, height: int, seed: int = 0) -> Image:
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
    image: Image = np.clip(picture + noise, 0, 255).astype(np.uint8)
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
