"""The plots of an evaluation, drawn with OpenCV to avoid a further dependency."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.training.evaluation.photo_metrics import Confusion, Tally
from handsteer.training.evaluation.report import Calibration
from handsteer.types import NONE

Colour = tuple[int, int, int]
"""Blue, green and red, each 0 to 255."""
Picture = NDArray[np.uint8]

INK: Colour = (40, 40, 40)
GRID: Colour = (210, 210, 210)
BLUE: Colour = (142, 96, 24)
RED: Colour = (48, 56, 200)
COLOURS: tuple[Colour, ...] = (BLUE, RED, (60, 140, 40), (30, 150, 230), (150, 60, 150), (120, 120, 120), (160, 160, 0))
"""Colours of successive lines, chosen to be distinguishable with most kinds of colour blindness."""

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 150, 60, 64
_SIDE = 480
_TICKS = 5


def write(picture: Picture, text: str, origin: tuple[int, int], scale: float, ink: Colour = INK) -> None:
    """Write ``text`` with its lower left corner at ``origin``."""
    cv2.putText(picture, text, origin, _FONT, scale, ink, 1, cv2.LINE_AA)


def centre(
    picture: Picture, text: str, middle: tuple[int, int], scale: float, *, ink: Colour = INK, widest: int = 10_000
) -> None:
    """Write ``text`` centred at ``middle``, smaller if it would be wider than ``widest`` pixels."""
    scale *= min(1.0, widest / text_width(text, scale))
    (width, height), _ = cv2.getTextSize(text, _FONT, scale, 1)
    write(picture, text, (middle[0] - width // 2, middle[1] + height // 2), scale, ink)


def text_width(text: str, scale: float) -> int:
    """Return the width of ``text`` in pixels."""
    return max(1, int(cv2.getTextSize(text, _FONT, scale, 1)[0][0]))


class Plot:
    """Axes in percent, with space for a legend on the right.

    Args:
        title: A line above the axes.
        x: Label of the x axis.
        y: Label of the y axis.
        x_range: The ends of the x axis, 0 to 1.
        y_range: The ends of the y axis, 0 to 1.

    Attributes:
        picture: (height, width, 3) uint8, BGR.
    """

    def __init__(
        self,
        title: str,
        x: str,
        y: str,
        x_range: tuple[float, float] = (0.0, 1.0),
        y_range: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        width = max(_LEFT + _SIDE + _RIGHT, text_width(title, 0.55) + 32)
        self.picture: Picture = np.full((_TOP + _SIDE + _BOTTOM, width, 3), 255, np.uint8)
        self._x, self._y = x_range, y_range
        self._entries = 0
        write(self.picture, title, (16, 26), 0.55)
        write(self.picture, y, (16, _TOP - 12), 0.45)
        centre(self.picture, x, (_LEFT + _SIDE // 2, _TOP + _SIDE + 48), 0.45)
        for step in range(_TICKS + 1):
            self._tick(step / _TICKS)

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return the pixel of a point."""
        right = (x - self._x[0]) / (self._x[1] - self._x[0])
        up = (y - self._y[0]) / (self._y[1] - self._y[0])
        return _LEFT + round(_SIDE * right), _TOP + round(_SIDE * (1 - up))

    def line(self, points: Sequence[tuple[float, float]], colour: Colour, *, dots: bool = True) -> None:
        """Draw a line through ``points``, with a dot at each."""
        pixels = [self.at(*point) for point in points]
        for begin, end in pairwise(pixels):
            cv2.line(self.picture, begin, end, colour, 1, cv2.LINE_AA)
        for pixel in pixels if dots else []:
            cv2.circle(self.picture, pixel, 3, colour, -1, cv2.LINE_AA)

    def range(self, x: float, low: float, high: float, colour: Colour) -> None:
        """Draw an error bar from ``low`` to ``high``."""
        begin, end = self.at(x, low), self.at(x, high)
        cv2.line(self.picture, begin, end, colour, 1, cv2.LINE_AA)
        for px, py in (begin, end):
            cv2.line(self.picture, (px - 4, py), (px + 4, py), colour, 1, cv2.LINE_AA)

    def note(self, text: str, x: float, y: float, colour: Colour = INK) -> None:
        """Write ``text`` above a point."""
        px, py = self.at(x, y)
        centre(self.picture, text, (px, py - 12), 0.36, ink=colour)

    def legend(self, text: str, colour: Colour) -> None:
        """Add a line to the legend."""
        y = _TOP + 14 + 22 * self._entries
        cv2.circle(self.picture, (_LEFT + _SIDE + 18, y), 5, colour, -1, cv2.LINE_AA)
        write(self.picture, text, (_LEFT + _SIDE + 30, y + 5), 0.42)
        self._entries += 1

    def _tick(self, part: float) -> None:
        x, y = (low + part * (high - low) for low, high in (self._x, self._y))
        (across, bottom), (left, up) = self.at(x, self._y[0]), self.at(self._x[0], y)
        cv2.line(self.picture, (across, bottom), (across, _TOP), GRID, 1)
        cv2.line(self.picture, (left, up), (left + _SIDE, up), GRID, 1)
        centre(self.picture, f"{100 * x:.3g}%", (across, bottom + 18), 0.42)
        centre(self.picture, f"{100 * y:.3g}%", (left - 32, up), 0.42)


_CELL = 76
_MARGIN = 24
_LEFT, _TOP = 150, 96


def draw_confusion(confusion: Confusion, title: str) -> Picture:
    """Return a picture of ``confusion``, below a ``title``: (height, width, 3) uint8, BGR.

    A row for each true sign that occurs, and a column for each recognised sign. The shade of a cell is its share of the
    row: blue if right, red if wrong. Rows without photos are left out.
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
    # Interpolates from white at a share of 0 to the full colour at 1.
    colour = (255 + share * (np.array(BLUE if right else RED) - 255)).astype(np.uint8)
    picture[y : y + _CELL, x : x + _CELL] = colour
    cv2.rectangle(picture, (x, y), (x + _CELL, y + _CELL), GRID, 1)
    if count:
        ink = (255, 255, 255) if share > 0.5 else INK
        centre(picture, str(count), (x + _CELL // 2, y + _CELL // 2), 0.6, ink=ink)
        percent = f"{share:.0%}" if share >= 0.01 else "< 1%"
        centre(picture, percent, (x + _CELL // 2, y + _CELL // 2 + 20), 0.4, ink=ink)


_TOPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Ends of axes that give round ticks."""


def draw_reliability(figures: Calibration, title: str) -> Picture:
    """Return a picture of the calibration ``figures``, below a ``title``: (height, width, 3) uint8, BGR.

    A dot for each bin at its mean likelihood and share of right hands, with the 95 % interval and the number of hands.
    Dots below the diagonal are overconfident, dots above it underconfident.
    """
    error = figures.expected_error
    plot = Plot(title, "likelihood of the likeliest sign", "share that shows it; the number of hands")
    plot.line([(0.0, 0.0), (1.0, 1.0)], GRID, dots=False)
    points = []
    for each in figures.bins:
        interval = each.right.interval
        if each.confidence is not None and each.right.rate is not None and interval is not None:
            plot.range(each.confidence, *interval, BLUE)
            plot.note(str(each.right.of), each.confidence, interval[1])
            points.append((each.confidence, each.right.rate))
    plot.line(points, BLUE)
    plot.legend("-" if error is None else f"ECE {error:.1%}", BLUE)
    return plot.picture


def draw_sweep(rows: Mapping[float, Tally], title: str) -> Picture:
    """Return a picture of the effect of thresholds, below a ``title``: (height, width, 3) uint8, BGR.

    On the left recall, on the right false alarms: a line for each sign, a dot for each threshold in ``rows``, 0.25 to
    1; in black the share of all photos that would move the robot wrongly.
    """
    tallies = list(rows.values())
    shown = [sign for sign in tallies[0].recall if sign != NONE]
    signs = list(tallies[0].false_alarms)
    colours = {sign: COLOURS[number % len(COLOURS)] for number, sign in enumerate(signs)}
    recall = {sign: [tally.recall[sign].rate or 0.0 for tally in tallies] for sign in shown}
    alarms = {sign: [tally.false_alarms[sign].rate or 0.0 for tally in tallies] for sign in signs}
    motion = [tally.false_motion.rate or 0.0 for tally in tallies]
    most = max(motion + [share for line in alarms.values() for share in line])
    left = Plot(title, "threshold", "recall", x_range=(0.25, 1.0))
    right = Plot(
        "",
        "threshold",
        "of those that don't show the sign, how many gave it",
        x_range=(0.25, 1.0),
        y_range=(0.0, next(top for top in _TOPS if top >= most)),
    )
    for plot, lines in ((left, recall), (right, alarms)):
        for sign, line in lines.items():
            plot.line(list(zip(rows, line, strict=True)), colours[sign])
            plot.legend(sign, colours[sign])
    right.line(list(zip(rows, motion, strict=True)), INK)
    right.legend("moves wrongly", INK)
    return np.hstack([left.picture, right.picture])
