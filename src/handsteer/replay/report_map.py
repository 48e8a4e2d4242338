"""The map of a report, as plotly's figure: the driven path among obstacles and gates."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handsteer.replay.drive_facts import DriveFacts, Thing
from handsteer.replay.report_charts import DRIVEN, GREY, Figure, scatter, stops, typed

_BUMP = "#8e5bd0"
_MOST_LABELS = 60


def drive_map(facts: DriveFacts) -> Figure | None:
    """Return the driven path among obstacles and gates; None if nothing of them is known."""
    traces = [*_paths(facts), *_stands(facts), *_bumps(facts)]
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


def _paths(facts: DriveFacts) -> list[dict[str, Any]]:
    """Return the path in the world, and the one by odometry, which drifts; only the latter is known of a real robot."""
    odometry = _with_gaps(facts.driven.table()[:, [0, 3, 4]], facts.leaps_s)
    truth = _with_gaps(facts.truth.table(), facts.leaps_s)
    if not len(truth):
        return [_path(odometry, "driven path", DRIVEN, "solid")] if len(odometry) else []
    paths = [_path(truth, "driven path", DRIVEN, "solid")]
    return [_path(odometry, "by odometry", GREY, "dot"), *paths] if len(odometry) else paths


def _stands(facts: DriveFacts) -> list[dict[str, Any]]:
    stands = [(number, stand) for number, stand in enumerate(facts.stands, 1) if stand.place is not None]
    x, y = _columns([stand.place for _, stand in stands])
    mode = "markers+text" if len(stands) <= _MOST_LABELS else "markers"
    labels = [str(number) for number, _ in stands]
    return [stops(stands, x, y, size=8, mode=mode, text=labels, textposition="top right")] if stands else []


def _bumps(facts: DriveFacts) -> list[dict[str, Any]]:
    x, y = _columns(facts.bumps)
    return [scatter("markers", "bumps", x, y, marker={"color": _BUMP, "size": 10, "symbol": "x"})] if x else []


def _columns(places: Iterable[tuple[float, float] | None]) -> tuple[list[float], list[float]]:
    known = [place for place in places if place is not None]
    return [x for x, _ in known], [y for _, y in known]


def _path(table: NDArray[np.float64], name: str, colour: str, dash: str) -> dict[str, Any]:
    hover = "%{x:.2f}, %{y:.2f} m at %{customdata:.1f} s<extra>" + name + "</extra>"
    line = {"width": 2, "color": colour, "dash": dash}
    times = typed(table[:, 0])
    return scatter("lines", name, table[:, 1], table[:, 2], customdata=times, hovertemplate=hover, line=line)


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
