"""Two machines whose clocks are not in step: the robot's stamps come from another time than the workstation has."""

import re
import time

import pytest

from tests.distributed.graph import Drive, TwoMachines

pytest.importorskip("cyclonedds")
pytestmark = [pytest.mark.netns, pytest.mark.slow]


@pytest.mark.parametrize(
    ("ahead_s", "sentence"),
    [
        (-2.0, r"frames come [23]\.\d s after their stamp: are the clocks of the machines synchronised\?"),
        (2.0, r"frames are stamped [12]\.\d s ahead of our clock: are the clocks of the machines synchronised\?"),
    ],
    ids=["behind", "ahead"],
)
def test_clocks_two_seconds_apart_keep_the_robot_standing_and_it_is_said_why(
    machines: TwoMachines, ahead_s: float, sentence: str
) -> None:
    drive = machines.start(ahead_s=ahead_s)
    drive.until(lambda: any(re.fullmatch(sentence, report) for report in said(drive)), sentence)
    since_s = time.monotonic()
    drive.assert_standing(2.0)
    # None is seen, and now and then none comes: it says either in turn.
    why = re.compile("standing: no sign (is seen|has come for .*)")
    drive.until(lambda: any(map(why.fullmatch, drive.reports("hand_sign_control", since_s))), "the control to say why")
    assert "Forward is shown" not in said(drive)
    assert drive.moved_m(0.0) < 0.001


def test_a_camera_that_is_a_little_ahead_drives_but_its_stale_frames_do_not(machines: TwoMachines) -> None:
    drive = machines.start(ahead_s=0.25)
    drive.until_fast()
    # By their stamps alone these frames would be 0.2 s old; by the clock that stamped them they are 0.45 s old.
    machines.link.shape(0.45)
    late_s = time.monotonic()
    drive.until_standing()
    drive.until(
        lambda: any("ahead of ours: are the clocks" in report for report in said(drive, late_s)), "it to be said"
    )


def said(drive: Drive, since_s: float = 0.0) -> list[str]:
    return drive.reports("hand_sign_recognition", since_s)
