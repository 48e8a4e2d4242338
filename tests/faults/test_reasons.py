"""Recordings of the faults of docs/faults.md answer why the robot drove, and why it stopped."""

from dataclasses import replace
from pathlib import Path

import pytest

from handsteer.audit import read_event
from handsteer.messages import AUDIT, CMD_VEL, RECORDED
from handsteer.nodes.auditing import HOLD_S
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.recorder import Recorder
from handsteer.plugins.record.replay.drive_facts import DriveFacts
from handsteer.plugins.record.replay.drive_reader import read_drive
from tests.faults.chain import Chain
from tests.faults.rows import rows
from tests.faults.stepped import outcome_of
from tests.reasons import expect_none

ROWS = {row.name: row for row in rows()}
PAST_THE_CONTROL = {
    f"{CMD_VEL.name}: delayed by 0 to 0.3 s; then the driver stops",
    f"{CMD_VEL.name}: a second publisher drives, the hand is lowered; then it stops",
    "all nodes: a bag of the drive is played: its commands; the hand is lowered; then it ends",
}
"""Where the robot is commanded to move after the reason for it has ended, by the network or by another program."""

CAUSES = {
    "camera: gives black pictures": "the picture is black: is the lens covered?",
    "camera: repeats one picture": "the same picture for",
    "camera: is unplugged": "has vanished",
    "camera: stamps pictures 5 s ahead": "a clock was set ahead by 5.0 s",
    "/image_raw: no messages": "no frame for",
}
"""What the stop says of the pictures."""


HOLDS_S = HOLD_S + 0.1
"""States that last for less need not be in the audit."""


def recorded(name: str, path: Path) -> DriveFacts:
    """Let the fault happen; return what a recording of it says."""
    recorders = []

    def make() -> Chain:
        chain = ROWS[name].make()
        recorders.append(Recorder(path, chain.faults, chain.clock, (*RECORDED, CMD_VEL), {}, waits=True))
        return chain

    outcome_of(replace(ROWS[name], make=make))
    recorders[0].close()
    if name in PAST_THE_CONTROL:
        expect_none(path)
    return read_drive(open_recording(path))


def told_stops(path: Path) -> list[float]:
    """Return when the audit says that the robot stands, in seconds since the recording began."""
    file = open_recording(path)
    audit = file.messages({AUDIT.name})
    return [each.time_s - file.began_s for each in audit if getattr(read_event(each.message), "code", "") == "stands"]


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", ROWS)
def test_each_motion_has_a_reason_and_each_stop_too(name: str, tmp_path: Path) -> None:
    facts = recorded(name, tmp_path / "drive.mcap")
    assert bool(facts.unexplained) == (name in PAST_THE_CONTROL)
    assert facts.stands
    assert all(stand.code for stand in facts.stands)
    stops, is_ours = told_stops(tmp_path / "drive.mcap"), name not in PAST_THE_CONTROL
    for stand in facts.stands:
        is_long = stand.duration_s is None or stand.duration_s >= HOLDS_S
        if is_long and is_ours and stand.code != "no_command":  # nobody is left to tell of it
            assert any(abs(told_s - stand.time_s) <= HOLDS_S for told_s in stops)


@pytest.mark.parametrize("name", CAUSES)
def test_a_stop_for_want_of_pictures_has_its_cause(name: str, tmp_path: Path) -> None:
    first, *_ = recorded(name, tmp_path / "drive.mcap").stands
    assert first.code in ("disarmed", "no_sign")
    assert CAUSES[name] in first.cause
