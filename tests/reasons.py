"""Whether every motion in the recordings that tests make has a live reason."""

from pathlib import Path

from handsteer.errors import RecordingError
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.recorder import Recorder
from handsteer.plugins.record.replay.drive_reader import read_drive

DELAY_S = 0.3
"""In real time, a machine that is busy with other tests delays a message on its way to the control by as much."""

_made: list[Path] = []


def watch_recordings() -> None:
    """Note each recording of this process that is closed from now on."""
    close = Recorder.close

    def close_and_note(self: Recorder) -> None:
        close(self)
        _made.append(self.path)

    setattr(Recorder, "close", close_and_note)  # noqa: B010 - mypy allows no assignment


def check_made() -> None:
    """Check the recordings that were closed since the last call."""
    while _made:
        check(_made.pop())


def expect_none(path: Path) -> None:
    """Leave out a recording that was closed, in which a test means to move the robot without a reason."""
    _made.remove(path)


def check(path: Path) -> None:
    """Fail if the robot is commanded to move without a live reason in the recording ``path``."""
    try:
        facts = read_drive(open_recording(path))
    except RecordingError:
        return  # of nothing that drives, or cut off by the test
    is_stepped = facts.about.get("clock_offset_s") in (None, "0.0")
    found = [each for each in facts.unexplained if is_stepped or each.end_s - each.begin_s > DELAY_S]
    assert not found, f"{path}: motion without a live reason: {found}"
