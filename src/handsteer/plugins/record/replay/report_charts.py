"""The charts and the map of a report, as plotly's figures: plain data, whose colours the page adds.

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

from handsteer.plugins.record.replay.drive_facts import DriveFacts, Stand, Thing
from handsteer.types import NONE, SIGNS

Figure = dict[str, Any]

_COLOURS = ("#e5484d", "#2f9e5b", "#8e5bd0", "#2b7fd9", "#e08a1e", "#1aa0a8")
_MORE_COLOURS = ("#c2569f", "#7d8c2c", "#5b6ee1", "#b5793f")
_GREY, _DRIVEN, _COMMANDED, _STAND, _BUMP = "#8a94a6", "#2b7fd9", "#e08a1e", "#e5484d", "#8e5bd0"
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


def drive_map(facts: DriveFacts) -> Figure | None:
    """Return the driven path among obstacles and gates; None if nothing of them is known."""
    traces = [*_paths(facts), *_stops_on_map(facts), *_bumps(facts)]
    if not (traces or facts.things):
        return None
    equal = {"scaleanchor": "x", "scaleratio": 1}
    axes = [
        {"title": {"text": f"{name} in m"}, "zeroline": False, "constrain": "domain", **_bounds(facts, axis)}
        for axis, name in enumerate("xy")
    ]
    layout = {
        "height": 560,
        "shapes": [_shape(thing) for thing in facts.things],
        "xaxis": axes[0],
        "yaxis": axes[1] | equal,
        "hovermode": "closest",
    }
    return {"data": traces, "layout": layout}


def _signs(facts: DriveFacts) -> _Panel:
    """Return a row per sign, with a thick line while it was the confirmed one."""
    names = sorted(facts.signs, key=_rank, reverse=True)
    traces = []
    for row, name in enumerate(names):
        spans = [span for span in facts.spans if span.sign == name]
        times = [time_s for span in spans for time_s in (span.begin_s, span.end_s, np.nan)]
        # Short signs would be left out of a long time.
        line = {"width": 12, "color": _colour(name, row), "simplify": False}
        hover = {"text": _escape(name), "hovertemplate": "%{text}, %{x:.2f} s<extra></extra>"}
        traces.append(_scatter("lines", _escape(name), times, [row] * len(times), line=line, showlegend=False, **hover))
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
    trace = _scatter(
        "lines",
        "confidence",
        table[:, 0],
        table[:, 1],
        showlegend=False,
        text=[seen[int(index)] for index in table[:, 2]],
        hovertemplate="%{text} with %{y:.2f}, %{x:.2f} s<extra></extra>",
        line={"width": 1.2, "color": _MORE_COLOURS[2]},
    )
    return _Panel("confidence", [trace], 0.6, {"range": [-0.03, 1.03]})


def _velocities(facts: DriveFacts) -> list[_Panel]:
    commanded, driven = facts.commanded.table(), facts.driven.table()
    panels = []
    for column, title in ((1, "m/s"), (2, "rad/s")):
        traces = []
        if len(commanded):
            # It holds until the next one.
            traces.append(_line(commanded, column, "commanded", {"color": _COMMANDED, "shape": "hv"}))
        if len(driven):
            traces.append(_line(driven, column, "driven, by odometry", {"color": _DRIVEN}))
        if column == 1 and facts.stands:
            times = [stand.time_s for stand in facts.stands]
            traces.append(_stops([*enumerate(facts.stands, 1)], times, [0] * len(times), size=7))
        for trace in traces:
            trace["showlegend"] = column == 1
            trace["legendgroup"] = trace["name"]
        panels.append(_Panel(title, traces))
    return panels


def _line(table: NDArray[np.float64], column: int, name: str, line: dict[str, Any]) -> dict[str, Any]:
    hover = "%{y:.3f}, %{x:.2f} s<extra>" + name + "</extra>"
    return _scatter("lines", name, table[:, 0], table[:, column], line={"width": 1.5, **line}, hovertemplate=hover)


def _rank(sign: str) -> tuple[int, str]:
    known = (*SIGNS, NONE)
    return (known.index(sign) if sign in SIGNS else len(known) + (sign == NONE), sign)


def _colour(sign: str, row: int) -> str:
    if sign == NONE:
        return _GREY
    return _COLOURS[SIGNS.index(sign)] if sign in SIGNS else _MORE_COLOURS[row % len(_MORE_COLOURS)]


def _paths(facts: DriveFacts) -> list[dict[str, Any]]:
    """Return the path in the world, and the one by odometry, which drifts; only the latter is known of a real robot."""
    odometry = _with_gaps(facts.driven.table()[:, [0, 3, 4]], facts.leaps_s)
    truth = _with_gaps(facts.truth.table(), facts.leaps_s)
    if not len(truth):
        return [_path(odometry, "driven path", _DRIVEN, "solid")] if len(odometry) else []
    paths = [_path(truth, "driven path", _DRIVEN, "solid")]
    return [_path(odometry, "by odometry", _GREY, "dot"), *paths] if len(odometry) else paths


def _stops_on_map(facts: DriveFacts) -> list[dict[str, Any]]:
    stands = [(number, stand) for number, stand in enumerate(facts.stands, 1) if stand.place is not None]
    x, y = _columns([stand.place for _, stand in stands])
    mode = "markers+text" if len(stands) <= _MOST_LABELS else "markers"
    labels = [str(number) for number, _ in stands]
    return [_stops(stands, x, y, size=8, mode=mode, text=labels, textposition="top right")] if stands else []


def _bumps(facts: DriveFacts) -> list[dict[str, Any]]:
    x, y = _columns(facts.bumps)
    return [_scatter("markers", "bumps", x, y, marker={"color": _BUMP, "size": 10, "symbol": "x"})] if x else []


def _columns(places: Iterable[tuple[float, float] | None]) -> tuple[list[float], list[float]]:
    known = [place for place in places if place is not None]
    return [x for x, _ in known], [y for _, y in known]


def _path(table: NDArray[np.float64], name: str, colour: str, dash: str) -> dict[str, Any]:
    hover = "%{x:.2f}, %{y:.2f} m at %{customdata:.1f} s<extra>" + name + "</extra>"
    line = {"width": 2, "color": colour, "dash": dash}
    times = _typed(table[:, 0])
    return _scatter("lines", name, table[:, 1], table[:, 2], customdata=times, hovertemplate=hover, line=line)


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


def _stops(
    stands: list[tuple[int, Stand]], x: ArrayLike, y: ArrayLike, *, size: int, mode: str = "markers", **more: Any
) -> dict[str, Any]:
    """Return marks of numbered stops at ``x`` and ``y``, with their reasons."""
    reasons = [_escape(f"{number}. {stand.reason}") for number, stand in stands]
    marker = {"color": _STAND, "size": size, "symbol": "square"}
    return _scatter(mode, "stopped", x, y, hovertext=reasons, hoverinfo="text", marker=marker, **more)


def _scatter(mode: str, name: str, x: ArrayLike, y: ArrayLike, **more: Any) -> dict[str, Any]:
    return {"type": "scatter", "mode": mode, "name": name, "x": _typed(x), "y": _typed(y), **more}


def _escape(text: str) -> str:
    """Return a text of a recording for plotly."""
    return html.escape(text, quote=False)


def _typed(values: ArrayLike) -> dict[str, str]:
    """Return numbers as plotly's typed array, smaller than text."""
    return {"dtype": "f4", "bdata": base64.b64encode(np.asarray(values, "<f4").tobytes()).decode()}
