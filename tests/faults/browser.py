"""What becomes of a fault of the page from which somebody drives: in a real browser, of a page in its own process."""

import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, CDPSession, Page
from playwright.sync_api import Error as PlaywrightError

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, DIAGNOSTICS, HAND_SIGN, DiagnosticArray, String, Twist
from handsteer.plugins.page.page_process import PageProcess
from handsteer.plugins.study.session import Task
from handsteer.robots.world import Gate, World
from handsteer.timeouts import ROBOT_S
from handsteer.transports.base import Received
from tests.faults.stepped import Outcome
from tests.plugins.page.browsers import TILTS_UNASKED, a_browser
from tests.plugins.study.plans import a_plan, a_task

FAULT_S, AFTER_S = 2.0, 1.5
HELD_S, TRIES_S, PATIENCE_S = 0.3, 4.0, 90.0
SPEED_MPS = 0.2
PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 740}, "has_touch": True, "is_mobile": True}
TILT = "at => window.dispatchEvent(new DeviceOrientationEvent('deviceorientation', at))"
HIDE = """isHidden => {
    Object.defineProperty(document, "hidden", {value: isHidden, configurable: true});
    document.dispatchEvent(new Event("visibilitychange"));
}"""
STEERS = "window.injected = 1; emitEvent('pad_held', {x: 0, y: 1, at: Date.now()})"
INJECTED = (
    f'<img src=x onerror="{STEERS}">',
    f"<script>{STEERS}</script>",
    f'</textarea></style><svg onload="{STEERS}">',
    "{{constructor.constructor('window.injected = 1')()}}",
)
"""Texts that would steer if a page took them for its own markup, script or template."""
TEXTS = frozenset(
    {"camera", "problem", "refused", "seen", "sign", "trouble", "warning", "reason_detail", "reason_robot"}
)


class Rig:
    """A graph, its page in a process of its own, and a browser with a key or a phone with its tilt that is held.

    Attributes:
        page: The driver's.
        debugger: Of that page.
        by: ``key`` or ``tilt``.
        studies: Whether the driver is led through a study, and drives in a lap of it.
    """

    def __init__(self, graph: Graph, process: PageProcess, browser: Browser, url: str, row: "Row") -> None:
        self.graph, self.process, self.browser, self.url = graph, process, browser, url
        self.by, self.studies = row.by, row.studies
        self.said = ""
        self._commands: list[tuple[float, float]] = []
        graph.transport.subscribe("onlooker", CMD_VEL, self._on_command)
        graph.transport.subscribe("onlooker", DIAGNOSTICS, self._on_report)
        self.open()

    def open(self) -> None:
        """Open the driver's page."""
        context = self.browser.new_context(**(PHONE if self.by == "tilt" else {}))
        context.add_init_script(TILTS_UNASKED)
        self.page: Page = context.new_page()
        self.page.set_default_timeout(1000 * PATIENCE_S)
        self.page.goto(self.url)
        self.page.locator(".banner").wait_for()
        if self.studies:
            for name in ("I agree", "Continue", "Begin lap"):
                self.page.get_by_role("button", name=name).click()
            self.page.locator(".study", has_text="Drive through the yellow gate").wait_for()
        self.debugger: CDPSession = context.new_cdp_session(self.page)
        self.debugger.send("Debugger.enable")

    def drive(self) -> None:
        """Let go, then hold, until the robot drives; a machine that is busy may need more than one try."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            reset = self.page.get_by_role("button", name="Reset")
            if reset.is_visible():
                reset.click()
            self.let_go()
            self.page.wait_for_timeout(1000 * HELD_S)
            self._hold()
            try_s = time.monotonic() + TRIES_S
            while time.monotonic() < try_s:
                self.page.wait_for_timeout(50)
                if self.graph.robot.state.linear_mps > SPEED_MPS:
                    return
        raise AssertionError(f"has not set off: {self.said}; {self.page.locator('.banner').inner_text()}")

    def let_go(self) -> None:
        """End the reason to drive."""
        if self.by == "tilt":
            self.page.mouse.up()
        else:
            self.page.keyboard.up("KeyW")

    def moved(self, since_s: float) -> list[float]:
        """Return when, since a time, each command to move ended: by the next one, or by the robot's own timeout."""
        ends_s = [*(at_s for at_s, _ in self._commands[1:]), time.monotonic()]
        moves = [(at_s, end_s) for (at_s, speed), end_s in zip(self._commands, ends_s, strict=False) if speed != 0.0]
        return [end_s for at_s, next_s in moves if (end_s := min(next_s, at_s + ROBOT_S)) > since_s]

    def was_told_to_move(self, since_s: float) -> bool:
        """Return whether the robot was told to move since a time."""
        return any(speed != 0.0 for at_s, speed in self._commands if at_s > since_s)

    def wait(self, seconds: float) -> None:
        """Let time pass; the browser's events are served where its page answers."""
        time.sleep(seconds)

    def _hold(self) -> None:
        if self.by == "key":
            self.page.keyboard.down("KeyW")
            return
        button = self.page.locator(".tilt")
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        assert box is not None
        self.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        self.page.mouse.down()
        for beta in (50, 20):
            self.page.evaluate(TILT, {"beta": beta, "gamma": 5})

    def _on_command(self, received: Received[Twist]) -> None:
        self._commands.append((time.monotonic(), received.message.linear.x))

    def _on_report(self, received: Received[DiagnosticArray]) -> None:
        for status in received.message.status:
            if status.name.endswith("hand_sign_control") and status.hardware_id != "another":
                self.said = status.message


@dataclass(frozen=True)
class Row:
    """A fault while somebody drives; attributes as of :class:`tests.faults.row.Row`.

    Attributes:
        begin: Returns when the reason to drive ended; None for when it was called.
        by: ``key`` or ``tilt``.
        studies: Whether the page leads through a study.
    """

    where: str
    fault: str
    begin: Callable[[Rig], float | None]
    end: Callable[[Rig], Any] = lambda _: None
    by: str = "key"
    leaves_reason: bool = False
    studies: bool = False

    @property
    def name(self) -> str:
        return f"{self.where}: {self.fault}"


def rows() -> list[Row]:
    """Return all rows."""
    return [*_background(), *_lost(), *_others()]


def _background() -> Iterator[Row]:
    def hide(rig: Rig) -> None:
        rig.page.evaluate(HIDE, True)

    def show(rig: Rig) -> None:
        rig.page.evaluate(HIDE, False)
        if rig.by == "tilt":
            rig.page.evaluate(TILT, {"beta": 20, "gamma": 5})

    def freeze(rig: Rig) -> None:
        rig.debugger.send("Debugger.pause")

    def thaw(rig: Rig) -> None:
        rig.debugger.send("Debugger.resume")

    for by, held in (("tilt", "a phone whose tilt drives"), ("key", "a page whose key is held")):
        yield Row("page", f"{held} goes into the background", hide, show, by=by)
        yield Row("page", f"{held} hangs", freeze, thaw, by=by)


def _lost() -> Iterator[Row]:
    def cut(rig: Rig) -> None:
        rig.page.context.set_offline(True)

    def join(rig: Rig) -> None:
        rig.page.context.set_offline(False)

    yield Row("page", "its network is gone for 2 s", cut, join)

    def crash(rig: Rig) -> None:
        with suppress(PlaywrightError):
            rig.page.goto("chrome://crash", timeout=1000)

    def again(rig: Rig) -> None:
        rig.page.close()
        rig.open()

    yield Row("page", "it crashes, and is opened again", crash, again)

    def pause(rig: Rig) -> None:
        os.kill(rig.process._child.process.pid, signal.SIGSTOP)

    def resume(rig: Rig) -> None:
        os.kill(rig.process._child.process.pid, signal.SIGCONT)

    yield Row("page", "its server is stopped by SIGSTOP, then SIGCONT", pause, resume)

    def starve(rig: Rig) -> None:
        pid = rig.process._child.process.pid
        used = int(Path(f"/proc/{pid}/statm").read_text().split()[0]) * resource.getpagesize()
        resource.prlimit(pid, resource.RLIMIT_AS, (used, resource.RLIM_INFINITY))

    def feed(rig: Rig) -> None:
        unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        resource.prlimit(rig.process._child.process.pid, resource.RLIMIT_AS, unlimited)

    fault = "its server cannot allocate memory; then the driver releases the pad"
    yield Row("page", fault, starve, feed, leaves_reason=True)


def _others() -> Iterator[Row]:
    def study(rig: Rig) -> None:
        other = rig.browser.new_page()
        other.goto(f"{rig.url}/study")
        other.wait_for_function("window.socket?.connected")

    fault = "another browser opens the study; then the driver releases the pad"
    yield Row("page", fault, study, leaves_reason=True, studies=True)

    def inject(rig: Rig) -> float:
        rig.let_go()
        let_go_s = time.monotonic()
        signs = rig.graph.transport.advertise("another", HAND_SIGN)
        reports = rig.graph.transport.advertise("another", DIAGNOSTICS)

        def repeat(received: Received[DiagnosticArray]) -> None:
            if any(status.hardware_id == "another" for status in received.message.status):
                return
            for text in INJECTED:
                signs.publish(String(data=text))
                reports.publish(
                    replace(received.message, status=[_with(each, text) for each in received.message.status])
                )

        rig.graph.transport.subscribe("another", DIAGNOSTICS, repeat)
        return let_go_s

    def marks(rig: Rig) -> None:
        assert rig.page.evaluate("window.injected") is None, "a text of another node was run as a script"

    yield Row("page", "another node reports texts with scripts, the key is released", inject, marks)


def _with(status: Any, text: str) -> Any:
    values = [replace(each, value=text) if each.key in TEXTS else each for each in status.values]
    return replace(status, message=text, hardware_id="another", values=values)


def a_long_lap(folder: Path) -> Task:
    """Return the task of a study with one lap, driven by keys, to a finish that is far away."""
    plan = a_plan(
        participants=1, conditions=[{"name": "keys", "input": "keys"}], forms=[], practice_laps=0, laps=1, lap_limit=600
    )
    gates = tuple(Gate(name=f"{x}", left=(x, 1.0), right=(x, -1.0)) for x in (0.1, 40.0))
    return replace(a_task(folder, plan), courses=dict.fromkeys(plan.courses, World(gates=gates)))


@contextmanager
def rig(row: Row) -> Iterator[Rig]:
    """Let a graph and its page run for as long as the block lasts."""
    base = {
        "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
        "virtual_hand": {"script": "NONE:600"},
        "dashboard": {"port": 0},
    }
    with tempfile.TemporaryDirectory() as home, Graph(load(base=base), steering=False) as graph, a_browser() as browser:
        process = PageProcess()
        try:
            url = process.serve(graph, study=a_long_lap(Path(home)) if row.studies else None).removesuffix("/study")
            graph.start()
            yield Rig(graph, process, browser, url, row)
        finally:
            process.stop()


def outcome_of(row: Row) -> Outcome:
    """Drive, let it happen, let it end; then let go, and drive again."""
    with rig(row) as made:
        made.drive()
        since_s = time.monotonic()
        since_s = row.begin(made) or since_s
        if row.leaves_reason:
            made.wait(1.0)
            since_s = time.monotonic()
            made.let_go()
        made.wait(FAULT_S)
        said, moved = made.said, made.moved(since_s)
        row.end(made)
        ended_s = time.monotonic()
        made.wait(AFTER_S)
        again = made.was_told_to_move(ended_s)
        made.drive()
    return Outcome(row.where, row.fault, max(moved, default=since_s) - since_s, again, True, said)


def outcomes() -> list[Outcome]:
    """Return what becomes of all rows; needs Chromium."""
    found = []
    for row in rows():
        found.append(outcome_of(row))
        print(found[-1], file=sys.stderr, flush=True)  # noqa: T201 - it takes minutes
    return found
