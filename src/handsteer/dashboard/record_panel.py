"""The card that starts and ends recordings, with links to the last one."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress

from nicegui import ui

from handsteer.dashboard.elements import box, button, card, switch, text
from handsteer.dashboard.page import Page
from handsteer.dashboard.recordings import RECORDINGS_PATH, Recordings, duration_text, size_text
from handsteer.dashboard.remote_graph import RemoteGraph
from handsteer.dashboard.viewers import LeaseStatus
from handsteer.errors import HandsteerError
from handsteer.recordings.folder import RecordingState

_ANSWER_TIMEOUT_S = 5.0
_SIZE_PERIOD_S = 1.0
_NOTHING = "Keeps all topics in a file, for a replay and a report."


class RecordPanel:
    """Starts and ends recordings for the driver; everybody sees them.

    Args:
        page: Shows the panel.
        graph: What is recorded.
        recordings: Serves files and reports.
    """

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
