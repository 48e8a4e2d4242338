"""The command ``handsteer``: one verb a job. Only this module prints and exits."""

import json as json_format
import logging
import os
import signal
import sys
import webbrowser
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, CycloptsError, Parameter, ValidationError
from pydantic import ValidationError as PydanticError

from handsteer import __version__, config
from handsteer.errors import ConfigError, HandsteerError

if TYPE_CHECKING:
    from handsteer.doctor import Finding
    from handsteer.graph import Graph, Summary
    from handsteer.recognize import FrameResult

_EXAMPLES = """Examples:
  handsteer run                                  drive, and open the page
  handsteer run --headless --duration 30 --json  no page, one summary at the end
  handsteer recognize photo.jpg                  which sign is it?
  handsteer doctor                               what works on this machine
"""

app = App(
    name="handsteer",
    help="Drive a mobile robot with your hand signs.",
    help_epilogue=_EXAMPLES,
    version=__version__,
    help_format="plaintext",
    result_action="return_value",
)

Flag = Annotated[bool, Parameter(negative="")]
Parameters = Annotated[config.Config | None, Parameter(name="*", group="Every parameter (also in a --config file)")]
ConfigFile = Annotated[Path | None, Parameter(name="--config")]


@app.command
def run(
    *,
    camera: str | None = None,
    robot: str | None = None,
    world: str | None = None,
    port: int | None = None,
    headless: Flag = False,
    duration: float | None = None,
    fast: Flag = False,
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Drive the robot with the signs that the camera sees.

    Example: handsteer run --camera 0 --world obstacles

    Parameters
    ----------
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address (rtsp, http), a video file or a folder of photos.
    robot
        sim, the simulated diff-drive robot.
    world
        Name of a shipped world, or a YAML file.
    port
        Port of the page on 127.0.0.1; 0 takes a free one.
    headless
        Without the page.
    duration
        End after so many seconds.
    fast
        As fast as the machine goes, on simulated time, without the page; the same input gives the same commands.
    json
        Print one JSON summary at the end, and nothing else.
    config_file
        YAML file with parameters; those given here go before it.
    """
    headless = headless or fast
    shorthand = {"camera": {"source": camera}, "robot": {"kind": robot, "world": world}, "dashboard": {"port": port}}
    settings = _settings(config_file, parameters, shorthand, {"camera": {"at_end": "end"}} if headless else {})
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration: {duration:g} should be greater than 0 seconds")
    from handsteer.clock import RealClock, SteppedClock  # noqa: PLC0415 - keeps --help quick
    from handsteer.graph import Graph  # noqa: PLC0415

    with Graph(settings, SteppedClock() if fast else RealClock()) as graph:
        try:
            _run_until_end(graph, settings, duration, headless=headless, fast=fast)
        except KeyboardInterrupt:
            _log("stopping: the robot is told to stand")
        graph.stop()
        summary = graph.summary()
    print(json_format.dumps(summary.as_dict()) if json else _summary_text(summary))
    return 0


@app.command
def recognize(
    source: Path, /, *, json: Flag = False, config_file: ConfigFile = None, parameters: Parameters = None
) -> int:
    """Print which sign each frame of a photo, a folder of photos or a video shows.

    Example: handsteer recognize drive.mp4 --json

    Parameters
    ----------
    source
        A photo, a folder of photos or a video file.
    json
        Print one JSON object a line, with the landmarks.
    config_file
        YAML file with parameters; those given here go before it.
    """
    settings = _settings(config_file, parameters)
    from handsteer.graph import open_recognizer  # noqa: PLC0415
    from handsteer.recognize import recognize as results  # noqa: PLC0415

    for result in results(source, open_recognizer(settings)):
        print(json_format.dumps(result.as_dict()) if json else _result_text(result), flush=True)
    return 0


@app.command
def models() -> int:
    """Fetch the landmark models, once, into the user's data directory.

    Example: handsteer models

    On a machine without network, set HANDSTEER_MODELS to a folder that has them.
    """
    from tqdm import tqdm  # noqa: PLC0415

    from handsteer.landmarks.models import fetch_models  # noqa: PLC0415

    bar: tqdm[Any] | None = None

    def progress(done: int, total: int) -> None:
        nonlocal bar
        bar = bar or tqdm(total=total, unit="B", unit_scale=True, desc="landmark models")
        bar.update(done - bar.n)

    paths = fetch_models(progress)
    if bar is not None:
        bar.close()
    print(f"the landmark models are in {paths[0].parent}")
    return 0


@app.command
def doctor(*, port: int = 8080, json: Flag = False) -> int:
    """Say what works on this machine; exit code 1 if something that is needed is missing.

    Example: handsteer doctor

    Parameters
    ----------
    port
        Where the page would be.
    json
        Print one JSON list.
    """
    from handsteer.doctor import examine  # noqa: PLC0415

    findings = examine(port)
    if json:
        print(json_format.dumps([vars(finding) for finding in findings]))
    else:
        print("\n".join(_finding_text(finding) for finding in findings))
    return 1 if any(finding.verdict == "missing" for finding in findings) else 0


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit code 0 when all went well, 2 when the input was wrong."""
    logging.basicConfig(level=logging.INFO, format="handsteer: %(message)s", stream=sys.stderr)
    for noisy in ("uvicorn", "asyncio", "httpx", "watchfiles"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        sys.exit(app(arguments, exit_on_error=False, print_error=False) or 0)
    except CycloptsError as error:
        _fail(_usage_problem(error))
    except HandsteerError as error:
        _fail(str(error))
    except BrokenPipeError:  # the reader of our output has left, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except KeyboardInterrupt:
        sys.exit(130)


def _run_until_end(
    graph: "Graph", settings: config.Config, duration: float | None, *, headless: bool, fast: bool
) -> None:
    if fast:
        graph.run_stepped(*([] if duration is None else [duration]))
        return
    if headless:
        graph.start()
        graph.wait(duration)
        return
    from handsteer.dashboard.server import Dashboard  # noqa: PLC0415

    dashboard = Dashboard(graph.transport, graph.clock, graph.steering, settings.dashboard)
    url = dashboard.start()
    try:
        graph.start()
        _log(f"the page is at {url}; Ctrl-C ends")
        if settings.dashboard.open_browser:
            webbrowser.open(url)
        graph.wait(duration)
    finally:
        graph.stop()
        dashboard.stop()


def _settings(
    file: Path | None, given: config.Config | None, shorthand: dict[str, Any] | None = None, base: Any = None
) -> config.Config:
    """Return the parameters: defaults, then ``base``, the file, the shorthand options, and the options by full name."""
    short = {
        section: {name: value for name, value in values.items() if value is not None}
        for section, values in (shorthand or {}).items()
    }
    full = given.model_dump(exclude_unset=True) if given else {}
    return config.load(file, base or {}, short, full)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _usage_problem(error: CycloptsError) -> str:
    if isinstance(error, ValidationError) and isinstance(error.__cause__, PydanticError):
        return config.describe(error.__cause__)
    return f"{str(error).rstrip('.')}; see handsteer --help"


def _fail(message: str) -> None:
    _log(" ".join(message.split()))
    sys.exit(2)


def _log(message: str) -> None:
    print(f"handsteer: {message}", file=sys.stderr, flush=True)


def _summary_text(summary: "Summary") -> str:
    pose = summary.final_pose
    signs = ", ".join(f"{sign} {count}" for sign, count in sorted(summary.signs.items(), key=lambda item: -item[1]))
    lines = [
        f"ran for {summary.duration_s:.1f} s: {summary.frames} frames, {summary.fps:.1f} frames/s",
        f"signs: {signs or 'none'}",
        f"the robot went {summary.path_length_m:.2f} m to x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {pose.yaw:.2f} rad, "
        f"with {summary.contacts} contacts",
    ]
    if summary.latency_median_ms is not None and summary.latency_p99_ms is not None:
        lines.append(
            f"capture to Twist: {summary.latency_median_ms:.1f} ms, 99 of 100 below {summary.latency_p99_ms:.1f} ms"
        )
    return "\n".join(lines)


def _result_text(result: "FrameResult") -> str:
    hand = f"{result.handedness} hand" if result.handedness else "no hand"
    seen = "" if result.seen == result.sign else f", {result.seen} seen"
    where = f"{result.source}  {result.frame:5d}  {result.time_s:8.3f} s"
    return f"{where}  {result.sign:10s}  {result.confidence:4.0%}  {hand}{seen}"


def _finding_text(finding: "Finding") -> str:
    mark = {"ok": "ok", "optional": "--", "missing": "!!"}[finding.verdict]
    return f"{mark}  {finding.name:8s} {finding.detail}"
