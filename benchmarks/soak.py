"""Growth and drift in long runs of handsteer.

Run ``python benchmarks/soak.py``, optionally with the names of parts: ``page``, ``hours``. ``page`` runs the graph in
this process and its page in another, on a film of the virtual hand at 640x480 and 60 frames per second, with one
permanent viewer of the page and others that come and go, in their own processes. ``hours`` drives for hours of stepped
time, all nodes in turn, with a painted hand instead of the camera and the landmark models, and the simulated robot.
"""

import argparse
import asyncio
import gc
import subprocess
import sys
import tempfile
import time
import urllib.request
import uuid
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import socketio
from _measuring import resident_mb
from page import DRIVE, film, load_now, plain_viewers, served

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the chain and the visitors that the tests use

from tests.faults.chain import Chain
from tests.faults.painted import FPS as CAMERA_FPS
from tests.plugins.page.network import client_of, cookies_of, drawn, join_query

from handsteer.config import RobotConfig
from handsteer.messages import CMD_VEL, IMAGE_RAW, ODOM, Topic
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import Robot

FPS = 60
WARM_S = 60.0
STAY_S = 0.3
SETTLE_S = 20.0
LIMIT_GROWTH = 0.02
_COUNTED = ("fd", "task")
CYCLE = (("NONE", 1.0), ("Forward", 2.0), ("Turn Left", 1.0), ("Go", 2.0), ("Backward", 2.0), ("Stop", 2.0))
CYCLE_S = sum(seconds for _, seconds in CYCLE)


@dataclass(frozen=True)
class Holdings:
    """Resources of processes: resident memory in MB, open files and sockets, threads."""

    memory_mb: tuple[float, ...]
    files: int
    threads: int

    @classmethod
    def now(cls, *others: str) -> "Holdings":
        """Measure this process and ``others``, by process ID."""
        gc.collect()
        each = ("self", *others)
        files, threads = (sum(len(list(Path(f"/proc/{one}/{what}").iterdir())) for one in each) for what in _COUNTED)
        return cls(tuple(map(resident_mb, each)), files, threads)

    def growth_since(self, before: "Holdings") -> str:
        grown = [now / then - 1 for now, then in zip(self.memory_mb, before.memory_mb, strict=True)]
        by_process = f" ({', '.join(f'{one:+.1%}' for one in grown)})" if len(grown) > 1 else ""
        whole = sum(self.memory_mb) / sum(before.memory_mb) - 1
        return f"memory {whole:+.1%}{by_process} (limit {LIMIT_GROWTH:.0%})"

    def __str__(self) -> str:
        memory = " + ".join(f"{one:.1f}" for one in self.memory_mb)
        return f"{memory} MB, {self.files} files and sockets, {self.threads} threads"


def soak_page(duration_s: float, visits: int) -> None:
    """Print the resources after a minute and at the end of ``duration_s``, with ``visits`` visits in total."""
    with tempfile.TemporaryDirectory() as folder:
        camera = Path(folder) / "film.avi"
        film(camera, DRIVE, FPS)
        with served(DRIVE, str(camera)) as page, plain_viewers(page.port, 1):
            began_s = time.monotonic()
            visiting_s = duration_s - SETTLE_S
            command = [sys.executable, __file__, "--visit", str(page.port), str(visits), str(visiting_s)]
            with subprocess.Popen(command) as visitors:
                time.sleep(WARM_S)
                after_a_minute = Holdings.now(page.process)
                print(f"after {WARM_S:.0f} s: {after_a_minute}", flush=True)
                frames = sum(page.graph.recognition.counts.values())
                warm_s = time.monotonic()
                while visitors.poll() is None:
                    time.sleep(min(60.0, visiting_s / 4))
                    print(f"  {time.monotonic() - began_s:4.0f} s: {Holdings.now(page.process)}", flush=True)
                    page.commands.clear()  # the benchmark's own records
                assert visitors.returncode == 0, "the visitors could not connect"
            elapsed_s = time.monotonic() - warm_s
            frames = sum(page.graph.recognition.counts.values()) - frames
            time.sleep(SETTLE_S)  # a closed page is kept for a moment, in case its viewer reconnects
            end = Holdings.now(page.process)
    print(f"after {duration_s:.0f} s and {visits} visits: {end}; {frames / elapsed_s:.1f} frames/s, {load_now()}")
    print(end.growth_since(after_a_minute))


def visit(port: int, count: int, duration_s: float) -> None:
    """Connect and disconnect ``count`` times within ``duration_s``."""

    async def come_and_go() -> None:
        began_s = time.monotonic()
        for number in range(count):
            try:
                await one_visit(port)
            except (OSError, socketio.exceptions.ConnectionError) as why:  # the machine or the page is overloaded
                print(f"  a visitor could not connect: {why}", flush=True)
            await asyncio.sleep(max(0.0, began_s + (number + 1) * duration_s / count - time.monotonic()))

    asyncio.run(come_and_go())


async def one_visit(port: int) -> None:
    """Fetch the page, connect as its script does, receive a picture, stay for a moment, and leave."""
    address = f"http://127.0.0.1:{port}"
    with urllib.request.urlopen(address) as answer:
        html, cookies = answer.read().decode(), {"Cookie": cookies_of(answer)}
    with urllib.request.urlopen(urllib.request.Request(f"{address}/camera.mjpg", headers=cookies)) as pictures:
        pictures.read1(65536)
    page = socketio.AsyncClient()
    await page.connect(
        f"{address}?{join_query(client_of(html), tab=uuid.uuid4().hex)}",
        headers=cookies,
        transports=["websocket"],
        socketio_path="/_nicegui_ws/socket.io",
    )
    for event in drawn(html):
        await page.emit("event", event)
    await page.sleep(STAY_S)
    await page.disconnect()


class Driven(Chain):
    """The chain with the simulated robot, and records of constant size."""

    def __init__(self) -> None:
        super().__init__()
        self.counts = {topic.name: 0 for topic in (IMAGE_RAW, ODOM)}
        self.commands: list[tuple[float, float]] = []
        topics: tuple[Topic[Any], ...] = (IMAGE_RAW, ODOM)
        for topic in topics:
            self.faults.subscribe("soak", topic, partial(self._count, topic.name))
        self.faults.subscribe("soak", CMD_VEL, self._on_command)

    def cycle(self) -> list[tuple[float, float]]:
        """Show each sign once; return the commands."""
        self.commands.clear()
        for sign, seconds in CYCLE:
            self.show(sign)
            self.run(seconds)
            self.moments.clear()
        return list(self.commands)

    def _driven(self) -> Robot:
        self.robot = SimulatedRobot(RobotConfig(world="empty"))
        return self.robot

    def _count(self, name: str, _: object) -> None:
        self.counts[name] += 1

    def _on_command(self, received: Any) -> None:
        twist = received.message
        self.commands.append((twist.linear.x, twist.angular.z))


def soak_hours(hours: float) -> None:
    """Print growth and drift after ``hours`` of stepped time."""
    chain, began_s = Driven(), time.monotonic()
    chain.run(0.5 / CAMERA_FPS)  # signs change between two frames, so that rounding has no effect
    chain.cycle()
    cycles = round(hours * 3600 / CYCLE_S)
    first, begin_s = chain.cycle(), chain.clock.now()
    before = None
    for number in range(cycles):
        last = chain.cycle()
        if number == cycles // 8:
            before = Holdings.now()
            print(f"after {hours / 8:.1f} h: {before}", flush=True)
    end, passed_s = Holdings.now(), chain.clock.now() - begin_s
    state = chain.robot.step(0.0)
    total_s = passed_s + 2 * CYCLE_S
    frames, odometry = (chain.counts[topic.name] for topic in (IMAGE_RAW, ODOM))
    print(f"after {hours:.1f} h in {(time.monotonic() - began_s) / 60:.1f} minutes: {end}")
    if before is not None:
        print(end.growth_since(before))
    print(f"robot's time {state.time_s - total_s:+.3f} s against the graph's {total_s:.0f} s; {frames / total_s:.4f} ")
    print(f"frames/s, {odometry / total_s:.4f} odometries/s; callbacks that failed: {failed(chain)}")
    sums = [tuple(round(sum(column), 3) for column in zip(*each, strict=True)) for each in (first, last)]
    print(f"commands of the first cycle {len(first)}, added up {sums[0]}; of the last {len(last)}, {sums[1]}")


def failed(chain: Chain) -> int:
    return sum(node.callback_errors for node in chain.nodes.values())


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure growth and drift in long runs.")
    parser.add_argument("parts", nargs="*", help="page, hours; both by default")
    parser.add_argument("--duration", type=float, default=600.0, help="seconds of the part page")
    parser.add_argument("--visits", type=int, default=500, help="visits during the part page")
    parser.add_argument("--hours", type=float, default=4.0, help="hours of stepped time of the part hours")
    parser.add_argument("--visit", nargs=3, metavar=("PORT", "COUNT", "SECONDS"), help=argparse.SUPPRESS)
    parser.add_argument("--look", nargs=2, type=int, metavar=("PORT", "COUNT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.visit:
        visit(int(options.visit[0]), int(options.visit[1]), float(options.visit[2]))
        return
    parts = {
        "page": lambda: soak_page(options.duration, options.visits),
        "hours": lambda: soak_hours(options.hours),
    }
    for part in options.parts or parts:
        print(f"-- {part}", flush=True)
        parts[part]()


if __name__ == "__main__":
    main()
