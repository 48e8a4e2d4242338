"""The reliability diagram, and thresholds swept, as pictures."""

from collections.abc import Mapping

from handsteer.signs.calibration import Calibration
from handsteer.signs.figures import Tally
from handsteer.signs.plot import BLUE, COLOURS, GRID, Picture, Plot
from handsteer.signs.vocabulary import NONE

_MARKED = (0.3, 0.5, 0.8, 0.95)


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

    A line for each sign that is shown, a dot on it for each threshold: what it costs in false alarms to the right, and
    recall upwards.

    Args:
        rows: What is counted with each threshold.
        title: A line above it.
    """
    first = next(iter(rows.values()))
    signs = [sign for sign in first.recall if sign != NONE]
    lines = {
        sign: [(row.false_alarms[sign].rate or 0.0, row.recall[sign].rate or 0.0) for row in rows.values()]
        for sign in signs
    }
    points = [point for line in lines.values() for point in line]
    widest = max((x for x, _ in points), default=0.0)
    lowest = min((y for _, y in points), default=0.0)
    plot = Plot(
        title,
        "of the photos that don't show the sign, how many gave it",
        "recall, for thresholds from right to left",
        x_range=(0.0, max(0.01, 1.05 * widest)),
        y_range=(max(0.0, lowest - 0.05), 1.0),
    )
    for number, (sign, line) in enumerate(lines.items()):
        colour = COLOURS[number % len(COLOURS)]
        plot.line(line, colour)
        plot.legend(sign, colour)
        for threshold, point in zip(rows, line, strict=True):
            if threshold in _MARKED:
                plot.note(f"{threshold:g}", *point, colour)
    return plot.picture
