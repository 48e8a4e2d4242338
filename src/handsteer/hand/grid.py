"""The part of the picture that is traced: a coarse grid around what the camera sees of the cones."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.hand.kinematics import Array
from handsteer.hand.placement import Pinhole
from handsteer.hand.surface import MARGIN_M, Cones, Float

_MOST_CELLS, _CELLS_A_PIXEL = 14000, 0.11
BLOCK = 4
"""Cells a side of the blocks that are traced first."""
_LEAST_CELL_PX = 1.0
_NEAREST_M = 0.05  # what is nearer is seen as if it were this far


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
        """Return the grid around what the camera sees of the cones, or None when that is nothing."""
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
        """Return (3, n) unit vectors to the (n,) places ``columns`` and ``rows``, in cells."""
        x, y = np.asarray(columns) * self.cell_px + self.left, np.asarray(rows) * self.cell_px + self.top
        return camera.rays(x, y)

    def cones_between(self, first_row: int, last_row: int, cones: Cones, camera: Pinhole) -> NDArray[np.bool_]:
        """Return (M,) which of the cones may be seen from one row of cells to another."""
        pixels, reach = _seen(cones, camera)
        rows = (pixels[..., 1] - self.top) / self.cell_px
        reach = reach / self.cell_px + 1.5
        inside = ((rows + reach).max(axis=1) >= first_row) & ((rows - reach).min(axis=1) <= last_row)
        return np.asarray(inside)


def _seen(cones: Cones, camera: Pinhole) -> tuple[Array, Array]:
    """Return (M, 2, 2) pixels of the ends of the cones and (M, 2) their radii in pixels."""
    ends = np.stack([cones.start, cones.end], axis=1)
    ends[..., 2] = np.maximum(ends[..., 2], _NEAREST_M)
    radii = np.stack([cones.start_radius, cones.end_radius], axis=1) + MARGIN_M
    return camera.project(ends), radii / ends[..., 2] * camera.focal_px
