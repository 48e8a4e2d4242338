"""What becomes of faults that only real processes can have: signals, clocks that are set, a full disk, no memory."""

import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.contracts.node_contract import CMD_VEL, ODOM, VIRTUAL
from tests.dds.graph import DdsGraph
from tests.faults.stepped import Outcome
from tests.processes import Process, eventually

SIGN = "/gesture/hand_sign"
DIAGNOSTICS = "/diagnostics"
HELD_STICK = Path(__file__).with_name("held_stick.py")
SPEED_MPS = 0.3
FAULT_S, AFTER_S = 1.2, 1.5
NEUTRAL_S = 1.6
"""The control arms no earlier than a second after its start."""
SETS_OFF_S = 15.0
CLOCK_S = 1
"""A clock that is told to jump does so in this time."""
START_S = 90.0
BRAKES_S = 0.6
"""What a simulated robot needs from its speed to rest, and what others need to see it."""
SLOWER_MPS = 0.28

NAMES = {
    "robot": "/robot",
    "control": "/hand_sign_control",
    "recognition": "/hand_sign_recognition",
    "camera": "/my_camera",
    "steering": "/steering",
}
OPTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "robot": (("--world", "empty"), ()),
    "control": (
        ("--control.arming", "on", "--control.engage", "off"),
        ("-p", f"max_linear:={SPEED_MPS}", "-p", "linear_step:=0.02"),
    ),
    "recognition": ((), ()),
    "camera": (VIRTUAL, ()),
}
SIGNS, SIMULATED = "signs", "simulated time"
SIGNALS = ("SIGKILL", "SIGSTOP", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGABRT", "SIGTERM", "SIGINT")


@dataclass
class Rig:
    """Our nodes as processes in a domain, and a plain program that looks on, and shows signs where no camera does.

    Attributes:
        graph: The domain.
        by: What sets the robot in motion: ``signs`` by the plain program, the same in ``simulated time``, a ``camera``
            before a virtual hand, or a ``stick`` that is held.
        more_env: Further variables of the environment, by node.
    """

    graph: DdsGraph
    by: str
    more_env: dict[str, dict[str, str]] = field(default_factory=dict)
    nodes: dict[str, Process] = field(default_factory=dict)

    def open(self) -> None:
        peer = self.graph.peer
        peer.ask("record", topic=CMD_VEL, type="Twist", fields=["linear.x"])
        peer.ask("record", topic=ODOM, type="Odometry", fields=["twist.twist.linear.x"])
        peer.ask("record", topic=DIAGNOSTICS, type="DiagnosticArray", fields=["status.0.name", "status.0.message"])
        if self.by == SIMULATED:
            peer.ask("advertise", topic="/clock", type="Clock")
            peer.ask("set_clock", rate=1.0)
        for verb in ("robot", "control"):
            self.start(verb)
        if self.by in (SIGNS, SIMULATED):
            peer.ask("advertise", topic=SIGN, type="String")
        elif self.by == "camera":
            self.start("recognition")

    def start(self, verb: str, script: str = "Forward:600") -> None:
        """Start a node that does not run, with what :attr:`more_env` has for it."""
        if verb == "steering":
            env = self.graph.env
            command = [sys.executable, str(HELD_STICK), "steering", "--transport", "dds"]
            log = Path(tempfile.mkdtemp(), "steering.log")
            self.nodes[verb] = Process(command, env, log)
            self.graph.adopt(self.nodes[verb])
            return
        options, ros = OPTIONS[verb]
        if self.by == SIMULATED:
            ros = (*ros, "-p", "use_sim_time:=true")
        if verb == "camera":
            ros = ("-p", f"virtual_hand.script:={script}")
        before, self.graph.env = self.graph.env, {**self.graph.env, **self.more_env.get(verb, {})}
        try:
            self.nodes[verb] = self.graph.node(verb, *options, name=NAMES[verb], ros=ros)
        finally:
            self.graph.env = before

    def drive(self) -> None:
        """Let go, then drive, until the robot is at its limit."""
        for verb in ("robot", "control", *(["recognition"] if self.by == "camera" else [])):
            if verb not in self.nodes or not self.nodes[verb].running:
                self.start(verb)
        eventually(self._has_set_off, START_S, what="the robot to drive")

    def _has_set_off(self) -> bool:
        """Let go once, and try to drive; a machine that is busy with other things may need more than one try."""
        if self.by in (SIGNS, SIMULATED):
            self.show("NONE")
            time.sleep(NEUTRAL_S)
            self.show("Forward")
        elif self.by == "camera":
            self.end("camera")
            self.start("camera", "NONE:3 Forward:600")
        else:
            self.end("steering")
            self.start("steering")
        patience_s = time.monotonic() + SETS_OFF_S
        while time.monotonic() < patience_s:
            if any(speed > SPEED_MPS - 0.01 for _, speed in self.speeds(time.monotonic() - 0.2)):
                return True
            time.sleep(0.05)
        ended = [verb for verb, node in self.nodes.items() if not node.running]
        print(f"has not set off: {self.said(patience_s - 1.0)}; ended: {ended}", file=sys.stderr)  # noqa: T201
        return False

    def show(self, sign: str) -> None:
        """Let the plain program say a sign 30 times a second."""
        self.graph.peer.ask("repeat", topic=SIGN, values={"data": sign}, every_s=1 / 30)

    def let_go(self) -> None:
        """End the reason to drive."""
        if self.by in (SIGNS, SIMULATED):
            self.show("NONE")
        else:
            self.end("camera" if self.by == "camera" else "steering")

    def end(self, verb: str) -> None:
        if verb in self.nodes:
            self.nodes.pop(verb).kill()

    def speeds(self, since_s: float = 0.0) -> list[tuple[float, float]]:
        """Return when, and what the robot's odometry said."""
        return [(at_s, speed) for at_s, (speed,) in self.graph.peer.ask("get", topic=ODOM, since_s=since_s)]

    def commands(self, since_s: float = 0.0) -> list[tuple[float, float]]:
        """Return when, and what the robot was told."""
        return [(at_s, speed) for at_s, (speed,) in self.graph.peer.ask("get", topic=CMD_VEL, since_s=since_s)]

    def said(self, since_s: float) -> str:
        """Return what the control has said last; what the robot has, where the control said nothing."""
        reports = self.graph.peer.ask("get", topic=DIAGNOSTICS, since_s=since_s)
        words = {name.partition(": ")[2]: text for _, (name, text) in reports}
        return str(words.get("hand_sign_control", words.get("robot", "nothing")))

    def stood_after_s(self, since_s: float) -> float | None:
        """Return how long it took until the robot was told zero, or braked by itself; None where nobody could see."""
        zeros = [at_s for at_s, speed in self.commands(since_s) if speed == 0.0]
        brakes = [at_s for at_s, speed in self.speeds(since_s) if speed < SLOWER_MPS]
        first = min([*zeros[:1], *brakes[:1]], default=None)
        return None if first is None else first - since_s

    def moves(self, since_s: float) -> bool:
        """Return whether the robot was told to move, or moved, since a time."""
        return any(speed > 0.02 for _, speed in (*self.commands(since_s), *self.speeds(since_s)))


@dataclass(frozen=True)
class Row:
    """A fault of real processes while the robot drives; attributes as of :class:`tests.faults.rows.Row`.

    Attributes:
        prepare: Is called before the robot drives.
    """

    where: str
    fault: str
    by: str
    begin: Callable[[Rig], Any]
    end: Callable[[Rig], Any]
    leaves_reason: bool = False
    prepare: Callable[[Rig], Any] = lambda _: None

    @property
    def name(self) -> str:
        return f"{self.where}: {self.fault}"


def rows() -> list[Row]:
    """Return all rows; those of one way to drive come one after the other."""
    return sorted([*_signals(), *_memory(), *_clocks(), *_disk(), *_simulated_time()], key=lambda row: row.by)


def _signals() -> Iterator[Row]:
    drives = {"camera": "camera", "recognition": "camera", "control": SIGNS, "robot": SIGNS, "steering": "stick"}
    for verb, by in drives.items():
        for name in SIGNALS:

            def send(rig: Rig, verb: str = verb, name: str = name) -> None:
                process = rig.nodes[verb]
                if name == "SIGSTOP":
                    process.freeze()
                else:
                    process.signal(signal.Signals[name])

            def over(rig: Rig, verb: str = verb, name: str = name) -> None:
                if name == "SIGSTOP":
                    rig.nodes[verb].signal(signal.SIGCONT)
                    return
                assert rig.nodes[verb].popen.wait(10.0) is not None
                if verb != "steering":  # whoever steered has to take the wheel again on the new page
                    rig.start(verb)

            after = "SIGCONT" if name == "SIGSTOP" else "started again"
            yield Row(verb, f"{name}, then {after}", by, send, over)


def _memory() -> Iterator[Row]:
    for verb, by in (("control", SIGNS), ("robot", SIGNS), ("recognition", "camera")):

        def starve(rig: Rig, verb: str = verb) -> None:
            pid = rig.nodes[verb].popen.pid
            used = int(Path(f"/proc/{pid}/statm").read_text().split()[0]) * resource.getpagesize()
            resource.prlimit(pid, resource.RLIMIT_AS, (used, resource.RLIM_INFINITY))

        def feed(rig: Rig, verb: str = verb) -> None:
            pid = rig.nodes[verb].popen.pid
            resource.prlimit(pid, resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

        yield Row(verb, "cannot allocate memory; then the driver stops", by, starve, feed, leaves_reason=True)


def _clocks() -> Iterator[Row]:
    library = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
    if library is None:  # Debian's package faketime
        return
    told = Path(tempfile.mkdtemp(), "time")
    env = {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(told),
        # Read at each look at the clock, the file would take half a processor.
        "FAKETIME_CACHE_DURATION": f"{CLOCK_S}",
        "DONT_FAKE_MONOTONIC": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }
    for verb, by in (("camera", "camera"), ("recognition", "camera"), ("control", SIGNS), ("robot", SIGNS)):
        for words, seconds in (("ahead", "+3600"), ("back", "-3600")):

            def prepare(rig: Rig, verb: str = verb) -> None:
                told.write_text("+0\n")
                rig.end(verb)
                rig.more_env[verb] = env
                if verb != "camera":
                    rig.start(verb)

            def jump(_: Rig, seconds: str = seconds) -> None:
                told.write_text(f"{seconds}s\n")
                time.sleep(CLOCK_S)

            def over(rig: Rig, verb: str = verb) -> None:
                rig.more_env.pop(verb)
                rig.end(verb)

            fault = f"its wall clock is set {words} by an hour; then the driver stops"
            yield Row(verb, fault, by, jump, over, leaves_reason=True, prepare=prepare)


def _disk() -> Iterator[Row]:
    def prepare(rig: Rig) -> None:
        rig.end("control")
        options, ros = OPTIONS["control"]
        words = ("control", "--transport", "dds", *options, "--ros-args", *ros)
        with Path("/dev/full").open("wb") as full:
            command = [sys.executable, "-m", "handsteer", *words]
            process = Process(command, rig.graph.env, Path(os.devnull), stdout=full, stderr=full)
        rig.graph.adopt(process)
        rig.nodes["control"] = process

    def shout(rig: Rig) -> None:
        for _ in range(3):  # what cannot be read is logged
            rig.graph.peer.ask("publish_raw", topic=SIGN, hex="0001000003000000fffe0000")

    def over(rig: Rig) -> None:
        rig.end("control")

    fault = "its log is on a full disk; then the driver stops"
    yield Row("control", fault, SIGNS, shout, over, leaves_reason=True, prepare=prepare)


def _simulated_time() -> Iterator[Row]:
    for words, clock, leaves in (
        ("stands still for a while", {"rate": 0.0}, False),
        ("jumps ahead by an hour", {"jump_s": 3600.0}, False),
        ("jumps back by an hour", {"jump_s": -3600.0}, False),
        ("runs three times as fast; then the driver stops", {"rate": 3.0}, True),
        ("runs at a third of its speed; then the driver stops", {"rate": 1 / 3}, True),
    ):

        def begin(rig: Rig, clock: dict[str, float] = clock) -> None:
            rig.graph.peer.ask("set_clock", **clock)

        def end(rig: Rig) -> None:
            rig.graph.peer.ask("set_clock", rate=1.0)

        yield Row("/clock", words, SIMULATED, begin, end, leaves_reason=leaves)


@contextmanager
def rig(by: str) -> Iterator[Rig]:
    """Let our nodes run as processes for as long as the block lasts."""
    with tempfile.TemporaryDirectory() as home, DdsGraph(Path(home)) as graph:
        made = Rig(graph, by)
        made.open()
        yield made


def outcome_of(row: Row, rig: Rig) -> Outcome:
    """Drive, let it happen, let it end; whether it drives again, the next row shows."""
    row.prepare(rig)
    rig.drive()
    since_s = time.monotonic()
    row.begin(rig)
    if row.leaves_reason:
        time.sleep(FAULT_S)
        since_s = time.monotonic()
        rig.let_go()
    time.sleep(FAULT_S)
    said = rig.said(since_s + FAULT_S / 2)
    # What the robot does whose own process was away, nobody sees.
    zero_s = None if row.where == "robot" and not row.leaves_reason else rig.stood_after_s(since_s)
    row.end(rig)
    ended_s = time.monotonic()
    time.sleep(AFTER_S)
    return Outcome(row.where, row.fault, zero_s, rig.moves(ended_s + BRAKES_S), True, said)


_ORDER = ("camera", "recognition", "control", "steering", "robot", "/clock")


def outcomes() -> list[Outcome]:
    """Return what becomes of all rows."""
    found = []
    for by in dict.fromkeys(row.by for row in rows()):
        with rig(by) as made:
            for row in rows():
                if row.by == by:
                    found.append(outcome_of(row, made))
                    print(found[-1], file=sys.stderr, flush=True)  # noqa: T201 - it takes minutes
    order = {verb: number for number, verb in enumerate(_ORDER)}
    return sorted(found, key=lambda outcome: order[outcome.where])
