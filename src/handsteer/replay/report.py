"""Writes a report on a recording: one HTML page."""

from pathlib import Path

from handsteer.errors import RecordingError
from handsteer.recordings import open_recording
from handsteer.replay.drive_facts import DriveFacts
from handsteer.replay.drive_reader import read_drive
from handsteer.replay.report_page import render


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
    _write(output, render(facts))
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
