"""A report on a recording: one HTML page that needs no network.

A recording is untrusted. All texts from it are escaped, and the page's Content-Security-Policy permits no network and
no scripts but its own two.
"""

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from handsteer.errors import RecordingError, needing
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.replay.drive_facts import DriveFacts, Lap, Stand
from handsteer.plugins.record.replay.drive_reader import read_drive
from handsteer.plugins.record.replay.report_charts import drive_map, latencies, timeline
from handsteer.plugins.record.replay.report_words import Total, heading, sign_totals, totals
from handsteer.types import stopwatch

with needing("reports", "record", "plotly"):
    from plotly.offline import get_plotlyjs

_MOST_STANDS = 300
_LONGEST = 300


def write_report(recording: Path, output: Path, *, force: bool = False) -> DriveFacts:
    """Write a page about a recording that opens without network, and return what it is about.

    Args:
        recording: An MCAP file, which may be cut off, or a bag of ROS 1 or 2.
        output: The page; it appears complete or not at all.
        force: Whether to overwrite it.

    Raises:
        RecordingError: The recording cannot be read or contains nothing to report, or the page exists or cannot be
            written.
        PackageMissing: The package plotly or mcap is not installed.
    """
    file = open_recording(recording)
    if output.resolve() == recording.resolve():
        raise RecordingError(f"{output} is the recording: give another name for the report")
    if output.exists() and not force:
        raise RecordingError(f"{output} exists already: give another name, or --force to overwrite it")
    facts = read_drive(file)
    _write(output, _page(facts))
    return facts


def _write(path: Path, text: str) -> None:
    part = path.with_name(f"{path.name}.part")
    try:
        try:
            part.write_text(text, encoding="utf-8", errors="replace")
            part.replace(path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise RecordingError(f"cannot write the report to {path}: {error.strerror or error}") from None


def _page(facts: DriveFacts) -> str:
    plotly, script = get_plotlyjs(), _static("report.js")
    charts = {"timeline": timeline(facts), "map": drive_map(facts), "latency": latencies(facts)}
    figures = json.dumps(
        {name: chart for name, chart in charts.items() if chart}, separators=(",", ":"), allow_nan=False
    )
    policy = (
        f"default-src 'none'; script-src {script_hash(plotly)} {script_hash(script)}; "
        "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    parts = [
        _problems(facts),
        _totals("Totals", totals(facts)),
        _totals("Signs", sign_totals(facts)),
        _chart("timeline", "Signs and velocities", charts["timeline"], "It contains no signs and no velocities."),
        _chart("map", "Map", charts["map"], "It contains no path and no obstacles."),
        _laps(facts),
        _stands(facts),
        _unexplained(facts),
        _chart(
            "latency", "Latency", charts["latency"], f"Latencies are unknown: {facts.no_latency}.", _percentiles(facts)
        ),
        _events(facts),
        _about(facts),
    ]
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_text(facts.path.name)} - handsteer report</title>
<link rel="icon" href="data:,">
<style>{_static("report.css")}</style>
</head>
<body>
<main>
<h1>{_text(facts.path.name)}</h1>
<p>{_text(heading(facts))}</p>
{"".join(parts)}
</main>
<script type="application/json" id="figures">{inert(figures)}</script>
<script>{plotly}</script>
<script>{script}</script>
</body>
</html>
"""


def _problems(facts: DriveFacts) -> str:
    if not facts.problems:
        return ""
    items = "".join(f"<li>{_text(problem)}</li>" for problem in facts.problems)
    return f'<section class="problems"><h2>About the recording</h2><ul>{items}</ul></section>'


def _totals(title: str, found: list[Total]) -> str:
    if not found:
        return ""
    items = "".join(
        f"<div><dt>{_text(total.name)}</dt><dd>{_text(total.value)}<small>{_text(total.more)}</small></dd></div>"
        for total in found
    )
    return f"<section><h2>{title}</h2><dl>{items}</dl></section>"


def _chart(name: str, title: str, chart: dict[str, Any] | None, without: str, more: str = "") -> str:
    content = f'{more}<div id="{name}"></div>' if chart else f'<p class="quiet">{_text(without)}</p>'
    return f"<section><h2>{title}</h2>{content}</section>"


def _percentiles(facts: DriveFacts) -> str:
    median, high = facts.latency_ms(50), facts.latency_ms(99)
    if median is None or high is None:
        return ""
    count = len(facts.latencies_ms)
    return (
        f"<p>From the capture of a frame to its command: median {median:.1f} ms, 99 % within {high:.1f} ms; "
        f"{count} frames.</p>"
    )


def _laps(facts: DriveFacts) -> str:
    if not facts.laps:
        return ""
    rows = "".join(
        f"<tr><td>{number}</td><td>{_lap_began(lap)}</td><td>{lap.course.passed}/{lap.course.gates}</td>"
        f"<td>{len(lap.course.missed)}</td><td>{lap.course.bumps}</td><td>{stopwatch(lap.course.time_s)}</td>"
        f"<td>{f'{lap.course.score_s:.1f} s' if lap.course.phase == 'finished' else 'not finished'}</td></tr>"
        for number, lap in enumerate(facts.laps, 1)
    )
    names = ("lap", "began at", "gates", "missed", "bumps", "time", "score")
    head = "".join(f"<th>{name}</th>" for name in names)
    return f'<section><h2>Laps</h2><div class="wide"><table><tr>{head}</tr>{rows}</table></div></section>'


def _lap_began(lap: Lap) -> str:
    return f"{lap.began_s:.1f} s" if lap.began_s >= 0 else f"{-lap.began_s:.1f} s before the recording"


def _stands(facts: DriveFacts) -> str:
    if not facts.stands:
        return '<section><h2>Stops</h2><p class="quiet">It was never commanded to stand after it drove.</p></section>'
    items = "".join(_stand(number, stand) for number, stand in enumerate(facts.stands[:_MOST_STANDS], 1))
    rest = facts.stand_count - _MOST_STANDS
    more = f"<p>and {rest} more</p>" if rest > 0 else ""
    return f'<section><h2>Stops</h2><ol class="stands">{items}</ol>{more}</section>'


def _unexplained(facts: DriveFacts) -> str:
    title = "Motion without a live reason"
    if not facts.unexplained:
        return f'<section><h2>{title}</h2><p class="quiet">There was none.</p></section>'
    rows = "".join(
        f"<tr><td>{each.begin_s:.2f} s</td><td>{each.end_s - each.begin_s:.2f} s</td><td>{_text(each.why)}</td></tr>"
        for each in facts.unexplained[:_MOST_STANDS]
    )
    rest = len(facts.unexplained) - _MOST_STANDS
    more = f"<p>and {rest} more</p>" if rest > 0 else ""
    head = "<tr><th>at</th><th>for</th><th>why not</th></tr>"
    table = f'<div class="wide"><table>{head}{rows}</table></div>'
    return f'<section class="problems"><h2>{title}</h2>{table}{more}</section>'


def _stand(number: int, stand: Stand) -> str:
    picture = ""
    if stand.picture is not None:
        data = base64.b64encode(stand.picture).decode()
        what = "the frame that led to it" if stand.has_led else "the newest frame then"
        picture = f'<img src="data:image/jpeg;base64,{data}" alt="{what}" title="{what}" loading="lazy">'
    lasted = "to the end" if stand.duration_s is None else f"for {stand.duration_s:.1f} s"
    sign = f'<p class="quiet">sign: {_text(stand.sign)}</p>' if stand.sign else ""
    cause = f'<p class="quiet">then: {_text(stand.cause)}</p>' if stand.cause else ""
    return (
        f"<li>{picture}<div><p><b>{number}.</b> at {stand.time_s:.2f} s, {lasted}</p>"
        f"<p>{_text(stand.reason)}</p>{cause}{sign}</div></li>"
    )


def _events(facts: DriveFacts) -> str:
    rows = [(f"{event.time_s:.2f} s", event.who, event.sentence) for event in facts.events]
    return _details("Who did what", ("at", "who", "what"), rows)


def _about(facts: DriveFacts) -> str:
    rows = [(name, value) for name, value in facts.about.items() if name != "config"]
    return _details("Software", ("name", "version or SHA-256"), rows)


def _details(title: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table that is folded up at first; nothing without rows."""
    if not rows:
        return ""
    head = "".join(f"<th>{name}</th>" for name in names)
    body = "".join(f"<tr>{''.join(f'<td>{_text(cell)}</td>' for cell in row)}</tr>" for row in rows)
    table = f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'
    return f"<section><details><summary>{title}</summary>{table}</details></section>"


def _text(text: str) -> str:
    return html.escape(text if len(text) <= _LONGEST else text[:_LONGEST] + "...")


def inert(text: str) -> str:
    """Return the JSON ``text`` in a form in which no HTML begins or ends."""
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _static(name: str) -> str:
    return resources.files("handsteer.plugins.record.replay").joinpath("static", name).read_text(encoding="utf-8")


def script_hash(script: str) -> str:
    """Return the source by which a Content-Security-Policy permits ``script``."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
