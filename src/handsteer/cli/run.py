"""``handsteer run``: drive the robot."""

import json as json_format
import webbrowser

from handsteer.cli.options import ConfigFile, Flag, Parameters, say
from handsteer.cli.options import settings as make_settings
from handsteer.clock import RealClock, SteppedClock
from handsteer.config import Config
from handsteer.errors import ConfigError
from handsteer.graph import Graph, Summary


def run(
    *,
    camera: str | None = None,
    robot: str | None = None,
    world: str | None = None,
    host: str | None = None,
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
        auto, virtual, browser (that of whoever looks at the page), a webcam's index or /dev/videoN, an address (rtsp,
        http), a video file or a folder of photos.
    robot
        sim, the simulated diff-drive robot.
    world
        Name of a shipped world, or a YAML file.
    host
        Address of this machine that the page is served on; 0.0.0.0 lets other machines in, with a token.
    port
        Port of the page; 0 takes a free one.
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
    shorthand = {
        "camera": {"source": camera},
        "robot": {"kind": robot, "world": world},
        "dashboard": {"host": host, "port": port},
    }
    settings = make_settings(config_file, parameters, shorthand, {"camera": {"at_end": "end"}} if headless else {})
    if headless and settings.camera.source == "browser":
        raise ConfigError("--camera browser needs the page, which --headless and --fast leave out")
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration: {duration:g} should be greater than 0 seconds")
    with Graph(settings, SteppedClock() if fast else RealClock()) as graph:
        try:
            _run_until_end(graph, settings, duration, headless=headless, fast=fast)
        except KeyboardInterrupt:
            say("stopping: the robot is told to stand")
        graph.stop()
        summary = graph.summary()
    print(json_format.dumps(summary.as_dict()) if json else _summary_text(summary))
    return 0


def _run_until_end(graph: Graph, settings: Config, duration: float | None, *, headless: bool, fast: bool) -> None:
    if fast:
        graph.run_stepped(*([] if duration is None else [duration]))
        return
    if headless:
        graph.start()
        graph.wait(duration)
        return
    # The page's libraries take a second to load, which a headless run need not wait for.
    from handsteer.dashboard.server import Dashboard  # noqa: PLC0415

    dashboard = Dashboard(graph.transport, graph.clock, graph.steering, settings.dashboard, graph.cameras)
    url = dashboard.start()
    try:
        graph.start()
        say(f"the page is at {url}; Ctrl-C ends")
        if settings.dashboard.open_browser:
            webbrowser.open(url)
        graph.wait(duration)
    finally:
        graph.stop()
        dashboard.stop()


def _summary_text(summary: Summary) -> str:
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
