"""The page ``/``: camera, recognised sign, robot state, world, manual steering, velocities, and recordings."""

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from typing import Final

from nicegui import ui

from handsteer.errors import HandsteerError
from handsteer.nodes.run_recording import RecordingState
from handsteer.plugins.page.camera import CameraPanel
from handsteer.plugins.page.elements import STATIC, box, button, card, switch, tag, text
from handsteer.plugins.page.legend import LegendPanel
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page, PageContext
from handsteer.plugins.page.recordings import RECORDINGS_PATH, Recordings, duration_text, size_text
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.steer_panel import SteerPanel, TopicPanel
from handsteer.plugins.page.viewers import LeaseStatus
from handsteer.plugins.page.world_panel import WorldPanel
from handsteer.plugins.page.world_state import SPAN_S, Sample, VelocityHistory
from handsteer.types import Velocity

_PLOTS = ("uplot/uPlot.min.css", "uplot/uPlot.iife.min.js")
_PLOT_EVERY = 3
"""The plots are updated every third time the page is: samples are not urgent."""


class DrivePage(Page):
    """Drives the robot, and explains its behaviour."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/", "drive.css", "steer.css", "steer.js", "sticks.js", "world.css", *_PLOTS)
        graph = context.graph
        self._camera = CameraPanel(self, graph, settings=context.settings, coaches=True)
        self._legend = LegendPanel(self, context.settings)
        self._world = WorldPanel(self, graph)
        with box("panels"):
            self._steering = SteerPanel(self)
            self._recording = (
                RecordPanel(self, graph, context.recordings) if graph is not None and context.recordings else None
            )
            _details_button()
            self._velocity = VelocityPanel()
            self._topic = TopicPanel(self, self._steering, has_choice=graph is None)
        self._updates = 0

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        self._world.update(state, node.world)
        for panel in (self._camera, self._velocity, self._topic, self._legend):
            panel.update(state)
        self._steering.update(state, self.lease(node))
        if self._recording is not None:
            self._recording.update(self.lease(node))
        self._updates += 1
        if self._updates % _PLOT_EVERY == 0:
            self._velocity.draw(node.history, node.clock.now())


def _details_button() -> None:
    """Create the button that shows what is technical, and hides it again, in ``static/page.js``."""
    with box("details"):
        button("Details", label="Details: velocities, topic, limits and reaction time").props('aria-expanded="false"')


Row = tuple[float, float | None, float | None]
"""Seconds, and the commanded and measured velocity in m/s or rad/s; None if missing."""

_AT_CURSOR: Final = "{seconds} s ago: commanded {commanded}, measured {measured}"
_ZOOM: Final = "Drag sideways in a plot to zoom in, which pauses the plots"
_PAUSE, _RESUME = "Pause", "Resume"


def rows_of(samples: Sequence[Sample]) -> tuple[list[Row], list[Row]]:
    """Return the rows of the linear and of the angular velocity, rounded for sending."""
    rows = [(round(each.at_s, 2), _rounded(each.commanded), _rounded(each.measured)) for each in samples]
    return (
        [(at_s, commanded[0], measured[0]) for at_s, commanded, measured in rows],
        [(at_s, commanded[1], measured[1]) for at_s, commanded, measured in rows],
    )


def _rounded(velocity: Velocity | None) -> tuple[float | None, float | None]:
    return (None, None) if velocity is None else (round(velocity.linear_mps, 3), round(velocity.angular_radps, 3))


class VelocityPanel:
    """The commanded and measured velocities, as figures, and as plots that can be paused and zoomed."""

    def __init__(self) -> None:
        self._sent: int | None = None
        self._is_paused = False
        with card(f"Velocity, last {SPAN_S:.0f} s", "panel velocity"):
            with box("key"):
                tag("span", "commanded", "commanded")
                tag("span", "measured", "measured")
                self._button = tag("button", "text-button", _PAUSE).props(f'type="button" title="{_ZOOM}"')
                self._button.on("click", lambda: self._hold(on=not self._is_paused))
            self._linear = _Axis("Linear", "m/s", least=0.2, ends=("forward", "backward"), panel=self)
            # Left is positive (REP 103) and drawn upwards.
            self._angular = _Axis("Angular", "rad/s", least=0.5, ends=("left", "right"), panel=self, times=True)

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._linear.update(state.commanded.linear_mps, state.measured.linear_mps)
        self._angular.update(state.commanded.angular_radps, state.measured.angular_radps)

    def draw(self, history: VelocityHistory, now_s: float) -> None:
        """Plot the samples of ``history`` that the browser does not have yet; ``now_s`` is of the graph's clock."""
        afresh = self._sent is None
        self._sent, samples = history.since(self._sent or 0, now_s)
        if samples or afresh:
            for axis, rows in zip((self._linear, self._angular), rows_of(samples), strict=True):
                axis.plot.run_method("add", rows, afresh)

    def begin(self) -> None:
        """Send all samples again, to a plot that has none."""
        self._sent = None

    def pause(self) -> None:
        """Pause the plots."""
        self._hold(on=True)

    def _hold(self, *, on: bool) -> None:
        self._is_paused = on
        for axis in (self._linear, self._angular):
            axis.plot.run_method("pause", on)
        self._button.set_text(_RESUME if on else _PAUSE)


class _Plot(ui.element, component=STATIC / "plot.js"):
    """Two lines, stored in the browser, so that each sample is sent once."""


class _Axis:
    def __init__(
        self, name: str, unit: str, *, least: float, ends: tuple[str, str], panel: VelocityPanel, times: bool = False
    ) -> None:
        with box("axis"):
            with box("line"):
                text("name", name)
                self._commanded = text("commanded-value", "")
                self._measured = text("value", "0.00")
                text("unit", unit)
            with box("frame"):
                self.plot = _Plot().props(f'aria-label="{name} velocity over the last 30 s; its figures stand above"')
                self.plot.props(f':span={SPAN_S} :least={least} :times={str(times).lower()} form="{_AT_CURSOR}"')
                self.plot.on("begin", panel.begin).on("zoom", panel.pause)
                text("end up", ends[0])
                text("end down", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")


_ANSWER_TIMEOUT_S = 5.0
_SIZE_PERIOD_S = 1.0
_NOTHING = "Keeps all topics in a file, for a replay and a report."


class RecordPanel:
    """Starts and ends recordings for the driver; everybody sees them."""

    def __init__(self, page: Page, graph: RemoteGraph, recordings: Recordings) -> None:
        self._page, self._graph, self._recordings = page, graph, recordings
        self._size = ""
        self._name = ""
        with card("Recording", "panel record") as self._card:
            with box("line"):
                self._lamp = box("lamp hidden")
                self._time = text("time", "")
                self._about = text("about", _NOTHING)
            with box("row"):
                self._start = button("Record", self._record, "Start a recording")
                self._end = button("End recording", self._end_recording)
                self._download = ui.link("Download", "").classes("text-button").props("download")
                self._make = button("Make report", self._make_report)
                self._making = text("about", "The report is being made")
                self._report = ui.link("Report", "", new_tab=True).classes("text-button")
            self._trouble = text("trouble", "").props('role="alert"')
        self._error = ""
        ui.timer(_SIZE_PERIOD_S, self._measure)

    def update(self, lease: LeaseStatus) -> None:
        """Show the recording to a viewer with ``lease``."""
        recording = self._graph.state.recording
        is_on = recording is not None and recording.ended_s is None
        may_act = lease.role != "watcher"
        for element, shown in (
            (self._lamp, is_on),
            (self._start, may_act and not is_on),
            (self._end, may_act and is_on),
        ):
            switch(element, "hidden", on=not shown)
        if recording is not None:
            self._show(recording)
        self._show_links(recording)
        problems = [self._error, _problem_of(recording), self._recordings.report(self._name).problem]
        self._trouble.set_text(" ".join(problem for problem in problems if problem))

    def _show(self, recording: RecordingState) -> None:
        self._time.set_text(duration_text(recording, self._graph.clock.now()))
        self._about.set_text(" · ".join(part for part in (self._size, recording.path.name) if part))

    def _show_links(self, recording: RecordingState | None) -> None:
        name = recording.path.name if recording is not None and self._recordings.has(recording) else ""
        if name != self._name:
            self._name = name
            self._download.props(f'href="{RECORDINGS_PATH}/{name}"')
            self._report.props(f'href="{RECORDINGS_PATH}/{name}/report"')
        stage = self._recordings.report(name).stage
        switch(self._download, "hidden", on=not name)
        switch(self._report, "hidden", on=not name or stage != "ready")
        switch(self._make, "hidden", on=not name or stage != "none")
        switch(self._making, "hidden", on=not name or stage != "making")

    async def _record(self) -> None:
        await self._ask(self._graph.record)

    async def _end_recording(self) -> None:
        await self._ask(self._graph.end_recording)

    async def _ask(self, action: Callable[[], Future[None]]) -> None:
        if not self._page.drives():
            self._error = "Only the driver can record: ask to drive first."
            return
        self._error = ""
        try:
            await asyncio.wait_for(asyncio.wrap_future(action()), _ANSWER_TIMEOUT_S)
        except HandsteerError as error:
            self._error = f"{error}."
        except TimeoutError:
            self._error = "The robot's process does not answer: look again in a moment."

    def _make_report(self) -> None:
        if self._name:
            self._recordings.make_report(self._name)

    async def _measure(self) -> None:
        """Note the size of the file; not on the event loop, as a disk may hang."""
        recording = self._graph.state.recording
        if recording is not None:
            with suppress(OSError):
                self._size = size_text((await asyncio.to_thread(recording.path.stat)).st_size)


def _problem_of(recording: RecordingState | None) -> str:
    if recording is None:
        return ""
    ended = f"The recording has ended: {recording.ended_by}. Driving goes on." if recording.ended_by else ""
    lost = f"{recording.lost} messages are missing: the disk was too slow." if recording.lost else ""
    return " ".join(part for part in (ended, lost) if part)
