"""``handsteer run``: drive the robot."""

import json as json_format
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from handsteer.cli import signals
from handsteer.cli.app import ConfigFile, Flag, Parameters
from handsteer.cli.running import freeze_loaded_objects, say, signals_ignored
from handsteer.cli.running import settings as make_settings
from handsteer.clock import RealClock, SteppedClock
from handsteer.config import Config
from handsteer.config.driving import PRESETS
from handsteer.dashboard.page_process import PageProcess
from handsteer.errors import ConfigError
from handsteer.graph import Graph
from handsteer.live.process import LiveProcess
from handsteer.parameters import from_parameters
from handsteer.recordings.audit_log import AuditLog, audit_log_path
from handsteer.study.session import Task
from handsteer.summary import Summary
from handsteer.transports import join
from handsteer.transports.base import Session

_NODE = "handsteer"


def run(
    *ros_args: str,
    camera: str | None = None,
    robot: str | None = None,
    world: str | None = None,
    host: str | None = None,
    port: int | None = None,
    token: Flag = False,
    headless: Flag = False,
    duration: float | None = None,
    fast: Flag = False,
    record: Path | None = None,
    foxglove: int | None = None,
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Drive the robot with the signs that the camera sees.

    Example: handsteer run --camera 0 --robot turtlebot4

    Parameters
    ----------
    ros_args
        ROS arguments, for a real robot. ROS 2: --ros-args -r cmd_vel:=/base/cmd_vel -r __ns:=/r1.
        ROS 1: cmd_vel:=/base/cmd_vel.
    camera
        auto, virtual, browser (of the device that shows the page), a webcam's index or /dev/videoN, an address (rtsp,
        http), a video file or a folder of photos.
    robot
        sim, the simulated robot. For a real one that subscribes to cmd_vel: ros2 (rclpy), dds or zenoh (ROS 2 without
        a ROS installation), auto (ros2 if installed, else dds) or ros1. Or a preset of topics and limits, with auto:
        turtlebot3_burger, turtlebot3_waffle, turtlebot4 or turtlesim.
    world
        Name of a shipped world, or a YAML file.
    host
        Address that the page is served on; 0.0.0.0 makes it reachable from other machines, with a token.
    port
        Port of the page; 0 picks a free one.
    token
        Require the token in the printed address from this machine too; for machines with several users.
    headless
        Run without the page.
    duration
        End after this many seconds.
    fast
        Run as fast as possible on simulated time, without the page; the same input gives the same commands.
    record
        Record all topics to this MCAP file, which must not exist yet, for `handsteer replay` and `handsteer report`.
    foxglove
        Serve all topics to Foxglove and PlotJuggler on this port, such as 8765; 0 picks a free one. With
        --foxglove.drive true they may also drive.
    json
        Print a summary in JSON at the end, and nothing else.
    config_file
        YAML file with parameters; options override it.
    """
    headless = headless or fast
    shorthand = {
        "camera": {"source": camera},
        "robot": {**_robot(robot), "world": world},
        "dashboard": {"host": host, "port": port, "token": "always" if token else None},
        "foxglove": {"port": foxglove},
    }
    base = {"camera": {"at_end": "end"}} if headless else {}

    def settle(service: dict[str, Any]) -> Config:
        return make_settings(config_file, parameters, shorthand, base, service)

    if headless and settle({}).camera.source == "browser":
        raise ConfigError("--camera browser needs the page, which --headless and --fast leave out")
    if fast and settle({}).foxglove.port >= 0:
        raise ConfigError("--foxglove shows a run in real time: leave out --fast, or record the run and open the file")
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration: {duration:g} should be greater than 0 seconds")
    with _linked(settle, ros_args, fast=fast) as (settings, link):
        summary = drive(settings, link, duration, config_file, record=record, headless=headless, fast=fast)
    print(json_format.dumps(summary.as_dict()) if json else _summary_text(summary))
    return 0


def _robot(name: str | None) -> dict[str, str | None]:
    """Return the parameters that ``--robot name`` stands for: the kind of the robot, or a preset."""
    return {"kind": "auto", "preset": name} if name in PRESETS else {"kind": name}


@contextmanager
def _linked(
    settle: Callable[[dict[str, Any]], Config], ros_args: tuple[str, ...], *, fast: bool
) -> Iterator[tuple[Config, Session | None]]:
    """Join the graph of a real robot; yield the parameters, including those from the graph, and the link."""
    settings = settle({})
    kind = settings.robot.kind
    if settings.control.robots:
        raise ConfigError("control.robots is for `handsteer control`: a run drives one robot")
    if kind == "sim":
        if ros_args:
            raise ConfigError(f"{ros_args[0]!r}: ROS arguments need a real robot, such as --robot auto")
        yield settings, None
        return
    if fast:
        raise ConfigError(f"--fast runs on simulated time, which a real robot (robot.kind {kind}) does not follow")
    link = join(kind, _NODE, ros_args)
    try:
        yield settle(from_parameters(link.parameters, "robot", link.name)), link
    finally:
        with signals_ignored():
            link.close()


def drive(
    settings: Config,
    link: Session | None = None,
    duration: float | None = None,
    file: Path | None = None,
    study: Task | None = None,
    *,
    record: Path | None = None,
    headless: bool = False,
    fast: bool = False,
) -> Summary:
    """Run a graph until it ends, ``duration`` seconds have passed, or a signal comes; return its statistics."""
    # Started first: it loads its libraries while this process loads the models.
    page = None if headless else PageProcess()
    live = None if settings.foxglove.port < 0 else LiveProcess()
    try:
        with (
            Graph(settings, SteppedClock() if fast else RealClock(), link=link, steering=page is None) as graph,
            _audit_log(graph, is_simulated_time=fast),
        ):
            if record is not None:
                graph.record(record)
            if live is not None:
                if page is not None:
                    live.share_seat(page.seat)
                    page.on_driver = live.note_driver
                address = live.serve(graph.transport, graph.clock, graph.topics, settings.foxglove)
                drive_too = ", and may drive" if settings.foxglove.drive else ""
                say(f"Foxglove and PlotJuggler see all topics at {address}{drive_too}")
            try:
                _run_until_end(graph, duration, file, study, page, fast=fast)
            except KeyboardInterrupt:
                say("stopping the robot")
            finally:
                with signals_ignored():
                    graph.stop()
            return graph.summary()
    finally:
        with signals_ignored():
            if page is not None:
                page.stop()
            if live is not None:
                live.stop()


def _audit_log(graph: Graph, *, is_simulated_time: bool) -> AbstractContextManager[object]:
    path = audit_log_path(graph.config.recording.audit_log, is_simulated_time=is_simulated_time)
    return nullcontext() if path is None else closing(AuditLog(graph.transport, path))


def _run_until_end(
    graph: Graph, duration: float | None, file: Path | None, study: Task | None, page: PageProcess | None, *, fast: bool
) -> None:
    if fast:
        graph.run_stepped(*([] if duration is None else [duration]))
        return
    freeze_loaded_objects()
    if page is None:
        graph.start()
        graph.wait(duration, until=signals.were_raised)
        return
    url = page.serve(graph, file, study)
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
        _path_text(summary),
    ]
    if summary.course:
        lines.append(f"course: {summary.course}")
    if summary.trouble:
        lines.append(f"at the end, the robot {summary.trouble}")
    if summary.latency_median_ms is not None and summary.latency_p99_ms is not None:
        median, p99 = (
            f"{summary.latency_median_ms:.1f} ms (median)",
            f"{summary.latency_p99_ms:.1f} ms (99th percentile)",
        )
        lines.append(f"capture to Twist: {median}, {p99}")
    return "\n".join(lines)


def _path_text(summary: Summary) -> str:
    pose = summary.final_pose
    if pose is None:
        return "the robot's position is unknown"
    path = f"the robot went {summary.path_length_m:.2f} m to x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {pose.yaw:.2f} rad"
    return path if summary.contacts is None else f"{path}, with {summary.contacts} contacts"
