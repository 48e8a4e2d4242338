"""What becomes of a link between two machines that is cut, slow or bad: real processes in two network namespaces."""

import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.distributed.graph import SPEED_MPS, Drive, TwoMachines
from tests.distributed.network import Link, two_machines
from tests.faults.stepped import Outcome

SCRIPT = "NONE:4 Forward:600"
FAULT_S, AFTER_S = 2.0, 1.5
FLAPS, CUT_S, JOINED_S = 4, 0.6, 0.4
FLAPPING_S = FLAPS * (CUT_S + JOINED_S) + 0.5
BRAKES_S = 0.6
MOVES_MPS = 0.02
LAYOUTS = {
    "camera and robot, the others across the link": ("camera",),
    "robot, the others across the link": (),
    "camera, control and robot, recognition across the link": ("camera", "control"),
}
"""What is on the robot's machine, in words, and which nodes these are beside it."""


@dataclass(frozen=True)
class Row:
    """A fault of the link while the robot drives; attributes as of :class:`tests.faults.row.Row`.

    Attributes:
        where: The layout.
        begin: Returns when it happened, in Unix time.
    """

    where: str
    fault: str
    begin: Callable[[Link], float]
    lasts_s: float = FAULT_S

    @property
    def name(self) -> str:
        return f"{self.where}: {self.fault}"


def rows() -> list[Row]:
    """Return all rows; those of one layout come one after the other."""
    return [
        Row(layout, f"{words} for {lasts_s:g} s", begin, lasts_s)
        for layout in LAYOUTS
        for words, begin, lasts_s in (
            ("the link is cut", Link.cut, FAULT_S),
            ("the link is cut", Link.cut, 0.7),
            ("all messages are delayed by 0.8 s", _slow, FAULT_S),
            ("nothing comes to the robot's machine, which is still heard", _deafen, FAULT_S),
            ("nothing comes from the robot's machine, which still hears", _mute, FAULT_S),
            (f"the link is cut for {CUT_S:g} s and there for {JOINED_S:g} s, again and again", _flap, FLAPPING_S),
        )
    ]


def _slow(link: Link) -> float:
    began_s = time.time()
    link.shape(delay_s=0.8)
    return began_s


def _deafen(link: Link) -> float:
    return link.cut_off(link.robot)


def _mute(link: Link) -> float:
    return link.cut_off(link.workstation)


def _flap(link: Link) -> float:
    began_s = link.cut()

    def flap() -> None:
        for _ in range(FLAPS):
            time.sleep(CUT_S)
            link.restore()
            time.sleep(JOINED_S)
            link.cut()

    threading.Thread(target=flap, daemon=True).start()
    return began_s


@contextmanager
def drive(layout: str) -> Iterator[Drive]:
    """Let the nodes of a layout run, all but the camera, for as long as the block lasts."""
    with tempfile.TemporaryDirectory() as home, two_machines(Path(home)) as (robot, workstation, link):
        machines = TwoMachines(Path(home), robot, workstation, link)
        near = LAYOUTS[layout]
        try:
            peer = machines.onlooker(robot if "control" in near else workstation)
            control = machines.node(
                robot if "control" in near else workstation,
                "control",
                "--control.arming",
                "on",
                ros=("-p", f"max_linear:={SPEED_MPS}", "-p", "linear_step:=0.02"),
            )
            nodes = {
                "robot": machines.node(robot, "robot", "--world", "empty"),
                "control": control,
                "recognition": machines.node(workstation, "recognition", ros=("-p", "image_transport:=compressed")),
            }
            camera_on = robot if "camera" in near else workstation
            show = partial(machines.camera, on=camera_on)
            yield Drive(machines, machines.onlooker(robot), nodes, show, peer)
        finally:
            machines.stop()


def outcome_of(row: Row, drive: Drive) -> Outcome:
    """Drive, let it happen, let it end; whether it drives again, the next row shows."""
    link = drive.machines.link
    drive.show(SCRIPT)
    drive.until_fast()
    began_s, heard_s = row.begin(link), time.monotonic()
    time.sleep(row.lasts_s)
    link.shape()
    ended_s = time.time()
    time.sleep(AFTER_S)
    slower = [one.at_s for one in drive.odometry(began_s) if one.speed_mps < SPEED_MPS - 0.02]
    moves = any(one.speed_mps > MOVES_MPS for one in drive.odometry(ended_s + BRAKES_S))
    said = [text for text in drive.reports("hand_sign_control", heard_s) if not text.startswith("driving")]
    drive.nodes.pop("camera").kill()
    zero_s = slower[0] - began_s if slower else None
    return Outcome(row.where, row.fault, zero_s, moves, True, said[-1] if said else "nothing")


def outcomes() -> list[Outcome]:
    """Return what becomes of all rows; needs root."""
    found = []
    for layout in LAYOUTS:
        with drive(layout) as made:
            for row in rows():
                if row.where == layout:
                    found.append(outcome_of(row, made))
                    print(found[-1], file=sys.stderr, flush=True)  # noqa: T201 - it takes minutes
    return found
