"""A confusion matrix as a picture."""

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.signs.figures import Confusion

_CELL = 76
_MARGIN = 24
_LEFT, _TOP = 150, 96
_FONT = cv2.FONT_HERSHEY_SIMPLEX

# BGR, at a share of 1; at 0 a cell is white.
_RIGHT = np.array([142, 96, 24])
_WRONG = np.array([48, 56, 200])
_INK = (40, 40, 40)
_GRID = (210, 210, 210)


def draw_confusion(confusion: Confusion, title: str) -> NDArray[np.uint8]:
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
    title_width = cv2.getTextSize(title, _FONT, 0.6, 1)[0][0]
    picture = np.full((height, max(width, title_width + 2 * _MARGIN), 3), 255, np.uint8)
    _write(picture, title, (_MARGIN, 34), 0.6)
    _write(picture, "shown", (_MARGIN, _TOP - 12), 0.45)
    for column, label in enumerate(labels):
        _centre(picture, label, (_LEFT + _CELL * column + _CELL // 2, _TOP - 16), 0.42, _INK)
    for row, (at, label) in enumerate(rows):
        y = _TOP + _CELL * row
        _write(picture, label, (_MARGIN, y + _CELL // 2 + 5), 0.5)
        for column, count in enumerate(confusion.counts[at]):
            share = count / sum(confusion.counts[at])
            _draw_cell(picture, (_LEFT + _CELL * column, y), count, share, right=at == column)
    return picture


def _draw_cell(picture: NDArray[np.uint8], corner: tuple[int, int], count: int, share: float, *, right: bool) -> None:
    x, y = corner
    colour = (255 + share * ((_RIGHT if right else _WRONG) - 255)).astype(np.uint8)
    picture[y : y + _CELL, x : x + _CELL] = colour
    cv2.rectangle(picture, (x, y), (x + _CELL, y + _CELL), _GRID, 1)
    if count:
        ink = (255, 255, 255) if share > 0.5 else _INK
        _centre(picture, str(count), (x + _CELL // 2, y + _CELL // 2), 0.6, ink)
        _centre(picture, f"{share:.0%}" if share >= 0.01 else "< 1%", (x + _CELL // 2, y + _CELL // 2 + 20), 0.4, ink)


def _write(picture: NDArray[np.uint8], text: str, origin: tuple[int, int], scale: float) -> None:
    cv2.putText(picture, text, origin, _FONT, scale, _INK, 1, cv2.LINE_AA)


def _centre(
    picture: NDArray[np.uint8], text: str, middle: tuple[int, int], scale: float, ink: tuple[int, int, int]
) -> None:
    widest = cv2.getTextSize(text, _FONT, scale, 1)[0][0]
    scale *= min(1.0, (_CELL - 4) / widest)
    (width, height), _ = cv2.getTextSize(text, _FONT, scale, 1)
    cv2.putText(picture, text, (middle[0] - width // 2, middle[1] + height // 2), _FONT, scale, ink, 1, cv2.LINE_AA)
