"""The reliability diagram, and thresholds swept, as pictures."""

from collections.abc import Mapping

import numpy as np

from handsteer.signs.calibration import Calibration
from handsteer.signs.figures import Tally
from handsteer.signs.plot import BLUE, COLOURS, GRID, INK, Picture, Plot
from handsteer.types import NONE

_TOPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Where an axis may end, so that its ticks are round."""


def draw_reliability(figures: Calibration, title: str) -> Picture:
    """Return a picture of ``figures``: (height, width, 3) uint8, BGR.

    A dot for each bin at its mean likelihood and the share that is right, with its 95 % interval and how many hands are
    in it. Dots below the diagonal are too sure, dots above it not sure enough.

    Args:
        figures: What to draw.
        title: A line above it.
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
    """Return a picture of what thresholds do: (height, width, 3) uint8, BGR.

    At the left recall, at the right what it costs: a line for each sign, a dot for each threshold; in black how many of
    all photos would move the robot as they should not.

    Args:
        rows: What is counted with each threshold, 0.25 to 1.
        title: A line above it.
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
