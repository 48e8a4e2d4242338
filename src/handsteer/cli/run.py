"""``handsteer run``: drive the robot."""

import json as json_format
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from handsteer.cli import signals
from handsteer.cli.app import ConfigFile, Flag, Parameters
from handsteer.cli.running import keep_what_is_loaded, say, uninterrupted
from handsteer.cli.running import settings as make_settings
from handsteer.clock import RealClock, SteppedClock
from handsteer.config import Config
from handsteer.dashboard.page_process import PageProcess
from handsteer.errors import ConfigError
from handsteer.graph import Graph, Summary
from handsteer.parameters import from_parameters
from handsteer.presets import PRESETS
from handsteer.transports import join
from handsteer.transports.protocol import Session

_NODE = "handsteer"


def run(
    *words: str,
    camera: str | None = None,
    robot: str | None = None,
    world: str | None = None,
    host: str | None = None,
    port: int | None = None,
    token: Flag = False,
    headless: Flag = False,
    duration: float | None = None,
    fast: Flag = False,
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Drive the robot with the signs that the camera sees.

    Example: handsteer run --camera 0 --robot turtlebot4

    Parameters
    ----------
    words
        For a real robot, in the words of its graph. ROS 2: --ros-args -r cmd_vel:=/base/cmd_vel -r __ns:=/r1.
        ROS 1: cmd_vel:=/base/cmd_vel.
    camera
        auto, virtual, browser (that of whoever looks at the page), a webcam's index or /dev/videoN, an address (rtsp,
        http), a video file or a folder of photos.
    robot
        sim, the simulated one. Or a real one, whatever listens to cmd_vel there: ros2 (by rclpy), dds or zenoh (ROS 2
        without ROS here), auto (ros2 where it is, else dds) or ros1. Or, by auto, turtlebot3_burger,
        turtlebot3_waffle, turtlebot4 or turtlesim, whose topics and limits are known.
    world
        Name of a shipped world, or a YAML file.
    host
        Address of this machine that the page is served on; 0.0.0.0 lets other machines in, with a token.
    port
        Port of the page; 0 takes a free one.
    token
        Ask everybody for the token in the printed address, on this machine too: for machines that several people use.
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
        "robot": {**_robot(robot), "world": world},
        "dashboard": {"host": host, "port": port, "token": "always" if token else None},
    }
    base = {"camera": {"at_end": "end"}} if headless else {}

    def settle(service: dict[str, Any]) -> Config:
        return make_settings(config_file, parameters, shorthand, base, service)

    if headless and settle({}).camera.source == "browser":
        raise ConfigError("--camera browser needs the page, which --headless and --fast leave out")
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration: {duration:g} should be greater than 0 seconds")
    with _linked(settle, words, fast=fast) as (settings, link):
        summary = _drive(settings, link, duration, config_file, headless=headless, fast=fast)
    print(json_format.dumps(summary.as_dict()) if json else _summary_text(summary))
    return 0


def _robot(name: str | None) -> dict[str, str | None]:
    """Return the parameters that ``--robot name`` is short for: the kind of robot, or one that is known."""
    return {"kind": "auto", "preset": name} if name in PRESETS else {"kind": name}


@contextmanager
def _linked(
    settle: Callable[[dict[str, Any]], Config], words: tuple[str, ...], *, fast: bool
) -> Iterator[tuple[Config, Session | None]]:
    """Join the graph of a real robot; yield the parameters, those that were given there included, and the link."""
    settings = settle({})
    kind = settings.robot.kind
    if settings.control.robots:
        raise ConfigError("control.robots is for `handsteer control`: a run drives one robot")
    if kind == "sim":
        if words:
            raise ConfigError(f"{words[0]!r}: a simulated robot has no graph to take it; choose one by --robot auto")
        yield settings, None
        return
    if fast:
        raise ConfigError(f"--fast runs on simulated time, which a real robot (robot.kind {kind}) does not follow")
    link = join(kind, _NODE, words)
    try:
        yield settle(from_parameters(link.parameters, "robot", link.name)), link
    finally:
        with uninterrupted():
            link.close()


def _drive(
    settings: Config, link: Session | None, duration: float | None, file: Path | None, *, headless: bool, fast: bool
) -> Summary:
    # It loads its libraries while this process loads the models.
    page = None if headless else PageProcess()
    try:
        with Graph(settings, SteppedClock() if fast else RealClock(), link=link, steering=page is None) as graph:
            try:
                _run_until_end(graph, duration, file, page, fast=fast)
            except KeyboardInterrupt:
                say("stopping: the robot is told to stand")
            finally:
                with uninterrupted():
                    graph.stop()
            return graph.summary()
    finally:
        if page is not None:
            with uninterrupted():
                page.stop()


def _run_until_end(
    graph: Graph, duration: float | None, file: Path | None, page: PageProcess | None, *, fast: bool
) -> None:
    if fast:
        graph.run_stepped(*([] if duration is None else [duration]))
        return
    keep_what_is_loaded()
    if page is None:
        graph.start()
        graph.wait(duration, until=signals.were_raised)
        return
    url = page.serve(graph, file)
    graph.start()
    say(f"the page is at {url}; Ctrl-C ends")
    if graph.config.dashboard.opens_browser:
        webbrowser.open(url)
    graph.wait(duration, until=lambda: page.is_gone or signals.were_raised())
    if page.is_gone and not signals.were_raised():
        raise page.why_gone()


def _summary_text(summary: Summary) -> str:
    signs = ", ".join(f"{sign} {count}" for sign, count in sorted(summary.signs.items(), key=lambda item: -item[1]))
    lines = [
        f"ran for {summary.duration_s:.1f} s: {summary.frames} frames, {summary.fps:.1f} frames/s",
        f"signs: {signs or 'none'}",
        _way_text(summary),
    ]
    if summary.course:
        lines.append(f"course: {summary.course}")
    if summary.trouble:
        lines.append(f"at the end, the robot {summary.trouble}")
    if summary.latency_median_ms is not None and summary.latency_p99_ms is not None:
        lines.append(
            f"capture to Twist: {summary.latency_median_ms:.1f} ms, 99 of 100 below {summary.latency_p99_ms:.1f} ms"
        )
    return "\n".join(lines)


def _way_text(summary: Summary) -> str:
    pose = summary.final_pose
    if pose is None:
        return "the robot has not said where it is"
    way = f"the robot went {summary.path_length_m:.2f} m to x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {pose.yaw:.2f} rad"
    return way if summary.contacts is None else f"{way}, with {summary.contacts} contacts"
