"""Recordings for the page: downloads, and reports, which a process of low priority makes."""

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from fastapi import FastAPI
from starlette.responses import FileResponse, PlainTextResponse, Response

from handsteer.nodes.run_recording import RecordingState
from handsteer.plugins.page.recording_folder import RecordingFolder

RECORDINGS_PATH: Final = "/recordings"
_TIMEOUT_S: Final = 600.0
_LOW_PRIORITY: Final = 10
# A recording may contain anything: the report runs its scripts in an origin of its own, without the page's cookies.
_SANDBOX: Final = {"Content-Security-Policy": "sandbox allow-scripts allow-downloads"}


@dataclass(frozen=True)
class ReportState:
    """The report on one recording.

    Attributes:
        stage: Whether it is there, being made, or neither.
        problem: Why it could not be made; empty if nothing is wrong.
    """

    stage: Literal["none", "making", "ready"] = "none"
    problem: str = ""


class Recordings:
    """The recordings of one folder, and their reports next to them.

    Args:
        folder: The folder.
        current: Returns the recording that is being made, or the last one.
    """

    def __init__(self, folder: Path, current: Callable[[], RecordingState | None]) -> None:
        self._folder = RecordingFolder(folder)
        self._current = current
        self._reports: dict[str, ReportState] = {}
        self._worker = ThreadPoolExecutor(1, "report")
        self._process: subprocess.Popen[str] | None = None
        self._closed = False

    def has(self, recording: RecordingState) -> bool:
        """Return whether a recording is in the folder, complete, and can be downloaded."""
        return recording.ended_s is not None and self._folder.find(recording.path.name) == recording.path.absolute()

    def report(self, name: str) -> ReportState:
        """Return the state of the report on the recording ``name``."""
        return self._reports.get(name, ReportState())

    def make_report(self, name: str) -> None:
        """Begin to make the report on the recording ``name``, unless it is there or being made; returns at once."""
        path = self._complete(name)
        if path is None or self._closed or self.report(name).stage != "none":
            return
        self._reports[name] = ReportState("making")
        self._worker.submit(self._make, path)

    def download(self, name: str) -> Response:
        """Return the recording ``name`` as an answer of the server; 404 if there is none."""
        path = self._complete(name)
        if path is None:
            return _missing()
        return FileResponse(path, media_type="application/octet-stream", filename=name)

    def show_report(self, name: str) -> Response:
        """Return the report on the recording ``name`` as an answer of the server; 404 if there is none."""
        path = self._complete(name)
        if path is None or self.report(name).stage != "ready":
            return _missing()
        return FileResponse(path.with_suffix(".html"), media_type="text/html", headers=_SANDBOX)

    def close(self) -> None:
        """End the making of reports permanently."""
        self._closed = True
        if self._process is not None:
            self._process.kill()
        self._worker.shutdown(wait=False, cancel_futures=True)

    def _complete(self, name: str) -> Path | None:
        path, current = self._folder.find(name), self._current()
        is_growing = current is not None and current.ended_s is None and current.path.absolute() == path
        return None if is_growing else path

    def _make(self, path: Path) -> None:
        problem = self._run([*_REPORT, str(path), "--output", str(path.with_suffix(".html")), "--force"])
        self._reports[path.name] = ReportState("none", problem) if problem else ReportState("ready")

    def _run(self, command: list[str]) -> str:
        """Return what went wrong; empty if nothing did."""
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            self._process = process
            if hasattr(os, "setpriority"):
                os.setpriority(os.PRIO_PROCESS, process.pid, _LOW_PRIORITY)
            try:
                _, errors = process.communicate(timeout=_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                return f"the report was not ready after {_TIMEOUT_S:.0f} s"
            finally:
                self._process = None
        lines = errors.strip().splitlines()
        return "" if process.returncode == 0 else (lines[-1] if lines else "it failed").removeprefix("handsteer: ")


def duration_text(recording: RecordingState, now_s: float) -> str:
    """Return for how long a recording was made until ``now_s`` of the graph's clock, such as ``1:05``."""
    until_s = now_s if recording.ended_s is None else recording.ended_s
    minutes, seconds = divmod(max(0, int(until_s - recording.began_s)), 60)
    return f"{minutes}:{seconds:02d}"


def size_text(count: int) -> str:
    """Return the size of a file of ``count`` bytes, such as ``3.1 MB``."""
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.2f} GB"


def serve_recordings(application: FastAPI, recordings: Callable[[], Recordings | None]) -> None:
    """Serve the recordings and reports of what ``recordings`` returns; they are read on threads of the server."""

    @application.get(f"{RECORDINGS_PATH}/{{name}}")
    def recording(name: str) -> Response:
        current = recordings()
        return _missing() if current is None else current.download(name)

    @application.get(f"{RECORDINGS_PATH}/{{name}}/report")
    def report(name: str) -> Response:
        current = recordings()
        return _missing() if current is None else current.show_report(name)


_REPORT: Final = [sys.executable, "-P", "-m", "handsteer", "report"]


def _missing() -> Response:
    return PlainTextResponse("there is no such recording", 404)
