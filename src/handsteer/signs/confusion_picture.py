"""A confusion matrix as a picture."""

import cv2
import numpy as np

from handsteer.signs.figures import Confusion
from handsteer.signs.plot import BLUE, GRID, INK, RED, Picture, centre, text_width, write

_CELL = 76
_MARGIN = 24
_LEFT, _TOP = 150, 96


def draw_confusion(confusion: Confusion, title: str) -> Picture:
    """Return a picture of ``confusion``: (height, width, 3) uint8, BGR.

    A row for each true sign that occurs, a column for each sign that was seen. A cell is as dark as its share of its
    row: blue where that is right, red where it is wrong. Rows without photos are left out.

    Args:
        confusion: What to draw.
        title: A line above it.
    """
    labels = confusion.labels
    rows = [(at, label) for at, label in enumerate(labels) if sum(confusion.counts[at])]
    height = _TOP + _CELL * len(rows) + _MARGIN
    width = _LEFT + _CELL * len(labels) + _MARGIN
    picture: Picture = np.full((height, max(width, text_width(title, 0.6) + 2 * _MARGIN), 3), 255, np.uint8)
    write(picture, title, (_MARGIN, 34), 0.6)
    write(picture, "shown", (_MARGIN, _TOP - 12), 0.45)
    for column, label in enumerate(labels):
        centre(picture, label, (_LEFT + _CELL * column + _CELL // 2, _TOP - 16), 0.42, widest=_CELL - 4)
    for row, (at, label) in enumerate(rows):
        y = _TOP + _CELL * row
        write(picture, label, (_MARGIN, y + _CELL // 2 + 5), 0.5)
        for column, count in enumerate(confusion.counts[at]):
            share = count / sum(confusion.counts[at])
            _draw_cell(picture, (_LEFT + _CELL * column, y), count, share, right=at == column)
    return picture


def _draw_cell(picture: Picture, corner: tuple[int, int], count: int, share: float, *, right: bool) -> None:
    x, y = corner
    # The colour at a share of 1; at 0 a cell is white.
    colour = (255 + share * (np.array(BLUE if right else RED) - 255)).astype(np.uint8)
    picture[y : y + _CELL, x : x + _CELL] = colour
    cv2.rectangle(picture, (x, y), (x + _CELL, y + _CELL), GRID, 1)
    if count:
        ink = (255, 255, 255) if share > 0.5 else INK
        centre(picture, str(count), (x + _CELL // 2, y + _CELL // 2), 0.6, ink=ink)
        percent = f"{share:.0%}" if share >= 0.01 else "< 1%"
        centre(picture, percent, (x + _CELL // 2, y + _CELL // 2 + 20), 0.4, ink=ink)
