"""The charts of a report, as plotly's figures: plain data, whose colours the page adds.

Texts from a recording are escaped, because plotly reads HTML in texts.
"""

import base64
import html
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.replay.drive_facts import DriveFacts, Thing
from handsteer.types import NONE, SIGNS

Figure = dict[str, Any]

_COLOURS = ("#e5484d", "#2f9e5b", "#8e5bd0", "#2b7fd9", "#e08a1e", "#1aa0a8")
_MORE_COLOURS = ("#c2569f", "#7d8c2c", "#5b6ee1", "#b5793f")
_GREY, _COMMANDED, _DRIVEN, _STAND, _BUMP = "#8a94a6", "#e08a1e", "#2b7fd9", "#e5484d", "#8e5bd0"
_BINS = 60
_MOST_LABELS = 60


@dataclass
class _Panel:
    """A part of the timeline, above others.

    Attributes:
        title: Of its axis.
        traces: Its curves.
        share: Height compared with others.
        axis: Further properties of its axis.
    """

    title: str
    traces: list[dict[str, Any]]
    share: float = 1.0
    axis: dict[str, Any] = field(default_factory=dict)


def timeline(facts: DriveFacts) -> Figure | None:
    """Return signs, confidence and velocities over one time axis; None if none is known."""
    panels = [panel for panel in (_signs(facts), _confidence(facts), *_velocities(facts)) if panel.traces]
    if not panels:
        return None
    figure: Figure = {"data": [], "layout": {"height": 60 + round(190 * sum(panel.share for panel in panels))}}
    gap = 0.05 if len(panels) > 1 else 0.0
    shares = np.array([panel.share for panel in panels])
    heights = shares / shares.sum() * (1 - gap * (len(panels) - 1))
    top = 1.0
    for index, (panel, height) in enumerate(zip(panels, heights, strict=True), 1):
        name = f"y{index}" if index > 1 else "y"
        figure["data"] += [{**trace, "yaxis": name, "xaxis": "x"} for trace in panel.traces]
        bottom = max(0.0, top - float(height))
        figure["layout"]["yaxis" + name[1:]] = {
            "domain": [bottom, top],
            "title": {"text": panel.title},
            "fixedrange": True,
            **panel.axis,
        }
        top = bottom - gap
    figure["layout"]["xaxis"] = {
        "anchor": f"y{len(panels)}" if len(panels) > 1 else "y",
        "title": {"text": "s since the recording began"},
        "range": [0, facts.duration_s or 1],
    }
    figure["layout"]["hovermode"] = "closest"
    return figure


def drive_map(facts: DriveFacts) -> Figure | None:
    """Return the driven path among obstacles and gates; None if nothing of them is known."""
    traces = [
        _path(_with_gaps(facts.driven.table()[:, [0, 3, 4]], facts.leaps_s), "by odometry", _GREY, "dot"),
        _path(_with_gaps(facts.truth.table(), facts.leaps_s), "driven path", _DRIVEN, "solid"),
    ]
    traces = [trace for trace in traces if trace is not None]
    if len(traces) == 1 and traces[0] is not None:
        traces[0] |= {"name": "driven path", "line": {"color": _DRIVEN, "width": 2}}
    places = [(str(number), stand) for number, stand in enumerate(facts.stands, 1) if stand.x is not None]
    if places:
        is_labelled = len(places) <= _MOST_LABELS
        traces.append(
            {
                "type": "scatter",
                "mode": "markers+text" if is_labelled else "markers",
                "name": "stopped",
                "x": [stand.x for _, stand in places],
                "y": [stand.y for _, stand in places],
                "text": [number for number, _ in places],
                "textposition": "top right",
                "hovertext": [_escape(f"{number}. {stand.reason}") for number, stand in places],
                "hoverinfo": "text",
                "marker": {"color": _STAND, "size": 8, "symbol": "square"},
            }
        )
    bumps = [(x, y) for _, x, y in facts.bumps if x is not None]
    if bumps:
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "bumps",
                "x": [x for x, _ in bumps],
                "y": [y for _, y in bumps],
                "marker": {"color": _BUMP, "size": 10, "symbol": "x"},
            }
        )
    if not (traces or facts.things):
        return None
    layout = {
        "height": 560,
        "shapes": [_shape(thing) for thing in facts.things],
        "xaxis": {"title": {"text": "x in m"}, "zeroline": False, "constrain": "domain", **_bounds(facts, 0)},
        "yaxis": {
            "title": {"text": "y in m"},
            "scaleanchor": "x",
            "scaleratio": 1,
            "zeroline": False,
            "constrain": "domain",
            **_bounds(facts, 1),
        },
        "hovermode": "closest",
    }
    return {"data": traces, "layout": layout}


def latencies(facts: DriveFacts) -> Figure | None:
    """Return how often each latency occurred; None if they are unknown."""
    table = facts.latencies_ms.table(len(facts.latencies_ms))
    if not len(table):
        return None
    values = table[:, 1]
    # A few stalls would hide the rest; they are counted in the last bar.
    end = max(float(np.percentile(values, 99.5)) * 1.2, float(values.min()) + 1.0)
    counts, edges = np.histogram(np.minimum(values, end), bins=_BINS)
    hover = [
        f"{low:.1f} to {high:.1f} ms: {count} frames"
        for low, high, count in zip(edges[:-1], edges[1:], counts, strict=True)
    ]
    beyond = int((values > end).sum())
    if beyond:
        hover[-1] = f"{edges[-2]:.1f} ms and more, up to {values.max():.0f} ms: {counts[-1]} frames"
    bars = {
        "type": "bar",
        "x": _typed((edges[:-1] + edges[1:]) / 2),
        "y": _typed(counts),
        "width": float(edges[1] - edges[0]),
        "text": None,
        "hovertext": hover,
        "hoverinfo": "text",
        "marker": {"color": _DRIVEN},
        "name": "frames",
    }
    layout = {
        "height": 320,
        "bargap": 0,
        "showlegend": False,
        "xaxis": {"title": {"text": "ms from the capture of a frame to its command"}},
        "yaxis": {"title": {"text": "frames"}},
    }
    return {"data": [bars], "layout": layout}


def _signs(facts: DriveFacts) -> _Panel:
    """Return a row per sign, with a thick line while it was the confirmed one."""
    names = sorted(facts.signs, key=_rank, reverse=True)
    traces = []
    for row, name in enumerate(names):
        spans = [span for span in facts.spans if span.sign == name]
        times = [time_s for span in spans for time_s in (span.begin_s, span.end_s, np.nan)]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": _escape(name),
                "showlegend": False,
                "x": _typed(times),
                "y": _typed([row] * len(times)),
                # Short signs would be left out of a long time.
                "line": {"width": 12, "color": _colour(name, row), "simplify": False},
                "text": _escape(name),
                "hovertemplate": "%{text}, %{x:.2f} s<extra></extra>",
            }
        )
    labels = {
        "tickvals": [*range(len(names))],
        "ticktext": [_escape(name) for name in names],
        "range": [-0.6, len(names) - 0.4],
        "title": None,
        "zeroline": False,
    }
    return _Panel("", traces, 0.3 + 0.12 * len(names), labels)


def _confidence(facts: DriveFacts) -> _Panel:
    table = facts.confidence.table()
    if not len(table):
        return _Panel("", [])
    seen = [_escape(name) for name in facts.seen]
    trace = {
        "type": "scatter",
        "mode": "lines",
        "name": "confidence",
        "showlegend": False,
        "x": _typed(table[:, 0]),
        "y": _typed(table[:, 1]),
        "text": [seen[int(index)] for index in table[:, 2]],
        "hovertemplate": "%{text} with %{y:.2f}, %{x:.2f} s<extra></extra>",
        "line": {"width": 1.2, "color": _MORE_COLOURS[2]},
    }
    return _Panel("confidence", [trace], 0.6, {"range": [-0.03, 1.03]})


def _velocities(facts: DriveFacts) -> list[_Panel]:
    commanded, driven = facts.commanded.table(), facts.driven.table()
    panels = []
    for column, title in ((1, "m/s"), (2, "rad/s")):
        traces = []
        if len(commanded):
            traces.append(_line(commanded, column, "commanded", _COMMANDED) | {"line": _hv(_COMMANDED)})
        if len(driven):
            traces.append(_line(driven, column, "driven, by odometry", _DRIVEN))
        if column == 1 and facts.stands:
            traces.append(_stand_marks(facts))
        for trace in traces:
            trace["showlegend"] = column == 1
            trace["legendgroup"] = trace["name"]
        panels.append(_Panel(title, traces))
    return panels


def _line(table: NDArray[np.float64], column: int, name: str, colour: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": _typed(table[:, 0]),
        "y": _typed(table[:, column]),
        "line": {"width": 1.5, "color": colour},
        "hovertemplate": "%{y:.3f}, %{x:.2f} s<extra>" + name + "</extra>",
    }


def _hv(colour: str) -> dict[str, Any]:
    """Return a line that keeps its value until the next point, as a command does."""
    return {"width": 1.5, "color": colour, "shape": "hv"}


def _stand_marks(facts: DriveFacts) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "markers",
        "name": "stopped",
        "x": _typed([stand.time_s for stand in facts.stands]),
        "y": _typed([0] * len(facts.stands)),
        "hovertext": [_escape(f"{number}. {stand.reason}") for number, stand in enumerate(facts.stands, 1)],
        "hoverinfo": "text",
        "marker": {"color": _STAND, "size": 7, "symbol": "square"},
    }


def _path(table: NDArray[np.float64], name: str, colour: str, dash: str) -> dict[str, Any] | None:
    if not len(table):
        return None
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": _typed(table[:, 1]),
        "y": _typed(table[:, 2]),
        "text": None,
        "customdata": _typed(table[:, 0]),
        "hovertemplate": "%{x:.2f}, %{y:.2f} m at %{customdata:.1f} s<extra>" + name + "</extra>",
        "line": {"width": 2, "color": colour, "dash": dash},
    }


def _with_gaps(table: NDArray[np.float64], leaps_s: Iterable[float]) -> NDArray[np.float64]:
    """Return a path with a gap at each of ``leaps_s``."""
    if not len(table):
        return table
    at = np.searchsorted(table[:, 0], sorted(leaps_s))
    return np.insert(table, at, np.nan, axis=0)


def _bounds(facts: DriveFacts, axis: int) -> dict[str, Any]:
    """Return the range of an axis of the map that shows everything: plotly does not look at shapes for it."""
    values = [table[:, column + axis] for table, column in ((facts.driven.table(), 3), (facts.truth.table(), 1))]
    values += [np.array(_corners(thing))[:, axis] for thing in facts.things]
    joined = np.concatenate(values)
    if not len(joined):
        return {}
    margin = 0.04 * float(np.ptp(joined)) + 0.2
    return {"range": [float(joined.min()) - margin, float(joined.max()) + margin]}


def _shape(thing: Thing) -> dict[str, Any]:
    red, green, blue = thing.rgb
    colour = f"rgb({red},{green},{blue})"
    look = {"line": {"color": colour, "width": 3 if thing.kind == "gate" else 1}, "fillcolor": colour, "layer": "below"}
    if thing.kind == "disc":
        radius = thing.length / 2
        box = {"x0": thing.x - radius, "x1": thing.x + radius, "y0": thing.y - radius, "y1": thing.y + radius}
        return {"type": "circle", "opacity": 0.55, **box, **look}
    path = "M" + "L".join(f"{x:.4f},{y:.4f}" for x, y in _corners(thing)) + "Z"
    return {"type": "path", "opacity": 0.9 if thing.kind == "gate" else 0.55, "path": path, **look}


def _corners(thing: Thing) -> list[tuple[float, float]]:
    """Return the corners of the rectangle around a thing, in metres."""
    half_x, half_y = thing.length / 2, thing.width / 2
    cos, sin = math.cos(thing.yaw), math.sin(thing.yaw)
    return [
        (thing.x + cos * x - sin * y, thing.y + sin * x + cos * y)
        for x, y in ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))
    ]


def _rank(sign: str) -> tuple[int, str]:
    known = (*SIGNS, NONE)
    return (known.index(sign) if sign in SIGNS else len(known) + (sign == NONE), sign)


def _colour(sign: str, row: int) -> str:
    if sign == NONE:
        return _GREY
    return _COLOURS[SIGNS.index(sign)] if sign in SIGNS else _MORE_COLOURS[row % len(_MORE_COLOURS)]


def _escape(text: str) -> str:
    return html.escape(text, quote=False)


def _typed(values: ArrayLike) -> dict[str, str]:
    """Return numbers as plotly's typed array, a third of the size of text."""
    return {"dtype": "f4", "bdata": base64.b64encode(np.asarray(values, "<f4").tobytes()).decode()}
