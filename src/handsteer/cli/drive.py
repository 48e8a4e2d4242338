"""Drives the robot, for the verbs ``run`` and ``study``: what is loaded only when it drives."""

import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handsteer import doors
from handsteer.cli import signals
from handsteer.cli.running import freeze_loaded_objects, say, signals_ignored
from handsteer.clock import RealClock, SteppedClock
from handsteer.config import Config
from handsteer.errors import ConfigError
from handsteer.graph import Graph
from handsteer.parameters import from_parameters
from handsteer.summary import Summary
from handsteer.transports import join, transports
from handsteer.transports.base import Session

if TYPE_CHECKING:
    from handsteer.plugins.foxglove.process import LiveProcess
    from handsteer.plugins.page.page_process import PageProcess
    from handsteer.plugins.study.session import Task

_NODE = "handsteer"


@contextmanager
def linked(
    settle: Callable[[dict[str, Any]], Config], ros_args: tuple[str, ...], *, fast: bool
) -> Iterator[tuple[Config, Session | None]]:
    """Join the graph of a real robot; yield the parameters, including those from the graph, and the link."""
    settings = settle({})
    kind = settings.robot.kind
    if settings.control.robots:
        raise ConfigError("control.robots is for `handsteer control`: a run drives one robot")
    if kind not in transports():
        if ros_args:
            raise ConfigError(f"{ros_args[0]!r}: ROS arguments need a robot in a graph of ROS, such as --robot auto")
        if fast and kind != "sim":
            raise ConfigError(f"--fast runs on simulated time, which the robot {kind} does not follow")
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
    study: "Task | None" = None,
    *,
    record: Path | None = None,
    headless: bool = False,
    fast: bool = False,
) -> Summary:
    """Run a graph until it ends, ``duration`` seconds have passed, or a signal comes; return its statistics."""
    # Started first: it loads its libraries while this process loads the models.
    page: PageProcess | None = None if headless else doors.COMPANIONS.load("page")()
    live: LiveProcess | None = None if settings.foxglove.port < 0 else doors.COMPANIONS.load("foxglove")()
    try:
        with (
            Graph(settings, SteppedClock() if fast else RealClock(), link=link, steering=page is None) as graph,
            doors.COMPANIONS.load("audit_log")(graph, is_simulated_time=fast),
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


def _run_until_end(
    graph: Graph,
    duration: float | None,
    file: Path | None,
    study: "Task | None",
    page: "PageProcess | None",
    *,
    fast: bool,
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


def summary_text(summary: Summary) -> str:
    """Return the statistics of a run as text."""
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
        p99 = f"{summary.latency_p99_ms:.1f} ms (99th percentile)"
        lines.append(f"capture to Twist: {summary.latency_median_ms:.1f} ms (median), {p99}")
    return "\n".join(lines)


def _path_text(summary: Summary) -> str:
    pose = summary.final_pose
    if pose is None:
        return "the robot's position is unknown"
    path = f"the robot went {summary.path_length_m:.2f} m to x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {pose.yaw:.2f} rad"
    return path if summary.contacts is None else f"{path}, with {summary.contacts} contacts"
