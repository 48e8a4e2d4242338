"""The plots of an evaluation, drawn with Matplotlib."""

from collections.abc import Mapping, Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from handsteer.plugins.teach.evaluation.photo_metrics import Confusion, Tally
from handsteer.plugins.teach.evaluation.report import Calibration
from handsteer.types import NONE

_CELL_IN: Final = 0.76
_RIGHT, _WRONG, _GREY = "#18608e", "#c83830", "#d2d2d2"
_SHADES: Final = LinearSegmentedColormap.from_list("shades", [_WRONG, "white", _RIGHT])
# Distinguishable with most kinds of colour blindness.
_LINES: Final = (_RIGHT, _WRONG, "#288c3c", "#e6961e", "#963c96", "#787878", "#00a0a0")


def draw_confusion(confusion: Confusion, title: str) -> Figure:
    """Return a plot of ``confusion``, below a ``title``.

    A row for each true sign that occurs, and a column for each recognised sign. The shade of a cell is its share of the
    row: blue if right, red if wrong. Rows without photos are left out.
    """
    labels = confusion.labels
    rows = [at for at in range(len(labels)) if sum(confusion.counts[at])]
    figure = Figure((_CELL_IN * len(labels) + 2, _CELL_IN * len(rows) + 1.5), layout="constrained")
    axes = figure.add_subplot(title=title, xlabel="seen", ylabel="shown")
    axes.set_xticks(range(len(labels)), labels, rotation=45)
    axes.set_yticks(range(len(rows)), [labels[at] for at in rows])
    shares = [[count / sum(confusion.counts[at]) for count in confusion.counts[at]] for at in rows]
    signed = [
        [share if at == column else -share for column, share in enumerate(line)]
        for at, line in zip(rows, shares, strict=True)
    ]
    axes.imshow(signed, cmap=_SHADES, vmin=-1, vmax=1, aspect="auto")
    for row, at in enumerate(rows):
        for column, count in enumerate(confusion.counts[at]):
            share = shares[row][column]
            percent = f"{share:.0%}" if share >= 0.01 else "< 1%"
            ink = "white" if share > 0.5 else "black"
            axes.text(column, row, f"{count}\n{percent}" if count else "", ha="center", va="center", color=ink)
    return figure


def draw_reliability(figures: Calibration, title: str) -> Figure:
    """Return a plot of the calibration ``figures``, below a ``title``.

    A dot for each bin at its mean likelihood and share of right hands, with the 95 % interval and the number of hands.
    Dots below the diagonal are overconfident, dots above it underconfident.
    """
    figure = Figure((7, 6), layout="constrained")
    axes = figure.add_subplot(title=title)
    axes.plot([0, 1], [0, 1], color=_GREY)
    points = [
        (each.confidence, each.right.rate, *each.right.interval, each.right.of)
        for each in figures.bins
        if each.confidence is not None and each.right.rate is not None and each.right.interval is not None
    ]
    for x, _, low, high, hands in points:
        axes.vlines(x, low, high, color=_RIGHT)
        axes.annotate(str(hands), (x, high), (0, 3), textcoords="offset points", ha="center", fontsize="small")
    error = figures.expected_error
    label = f"expected calibration error {'-' if error is None else f'{error:.1%}'}"
    axes.plot([point[0] for point in points], [point[1] for point in points], "o-", color=_RIGHT, label=label)
    _in_percent(axes, "likelihood of the likeliest sign", "share that shows it; the number of hands")
    return figure


def draw_sweep(rows: Mapping[float, Tally], title: str) -> Figure:
    """Return a plot of the effect of thresholds, below a ``title``.

    On the left recall, on the right false alarms: a line for each sign, a dot for each threshold in ``rows``; in black
    the share of all photos that would move the robot wrongly.
    """
    tallies = list(rows.values())
    shown = [sign for sign in tallies[0].recall if sign != NONE]
    signs = list(tallies[0].false_alarms)
    colours = {sign: _LINES[number % len(_LINES)] for number, sign in enumerate(signs)}
    figure = Figure((13, 6), layout="constrained")
    figure.suptitle(title)
    left, right = figure.subplots(1, 2)
    for sign in shown:
        left.plot(list(rows), _rates([tally.recall[sign].rate for tally in tallies]), "o-", c=colours[sign], label=sign)
    for sign in signs:
        alarms = _rates([tally.false_alarms[sign].rate for tally in tallies])
        right.plot(list(rows), alarms, "o-", c=colours[sign], label=sign)
    motion = _rates([tally.false_motion.rate for tally in tallies])
    right.plot(list(rows), motion, "o-", c="black", label="moves wrongly")
    _in_percent(left, "threshold", "recall")
    _in_percent(right, "threshold", "false alarms: share of pictures without the sign")
    return figure


def _rates(rates: Sequence[float | None]) -> list[float]:
    return [rate or 0.0 for rate in rates]


def _in_percent(axes: Axes, x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.xaxis.set_major_formatter(PercentFormatter(1))
    axes.yaxis.set_major_formatter(PercentFormatter(1))
    axes.grid(color=_GREY)
    if axes.get_legend_handles_labels()[1]:
        axes.legend()
