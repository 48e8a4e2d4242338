"""Delay of Stop and of commands while the page's process is blocked.

Run ``python benchmarks/blocked.py``. The whole graph runs as in ``handsteer run``, in real time, with the page in its
own process and no viewers; the virtual hand alternates between Forward and no hand. Each trial waits until the robot is
driven, publishes ``true`` on ``/stop`` at a planned time, and waits for the first zero on ``cmd_vel``. The delay is
measured from the planned time, so that it includes delays of the benchmark itself. The last row blocks the interpreter
of the graph's own process, which nothing in handsteer does, for comparison.
"""

import argparse
import ctypes
import os
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, STOP, Bool, Twist
from handsteer.plugins.page.page_process import PageProcess
from handsteer.transports.base import Received

BLOCKED_S, HELD_S, FREE_S = 5.0, 0.3, 0.05
# Every node publishes its state on /stopped; one that is published after a reset would undo it.
HEARD_S = 0.5
DRIVEN_TIMEOUT_S, STOPPED_TIMEOUT_S = 6.0, 5.0


class Commands:
    """Received commands and their times."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self.came: list[tuple[float, bool]] = []  # time, and whether it moves the robot

    def take(self, received: Received[Twist]) -> None:
        with self._news:
            twist = received.message
            self.came.append((time.perf_counter(), bool(twist.linear.x or twist.angular.z)))
            self._news.notify_all()

    def wait_for(self, moving: bool, since_s: float, timeout_s: float) -> float | None:
        """Return the time of the first command that does, or does not, move the robot; None if none arrives in time."""

        def found() -> float | None:
            return next((at_s for at_s, moves in self.came if at_s >= since_s and moves is moving), None)

        with self._news:
            return self._news.wait_for(found, timeout_s)


@contextmanager
def undisturbed() -> Iterator[None]:
    yield


# Python runs this at the start of the page's process.
HINDERED = f"""
import ctypes, signal, threading, time

def hold():
    usleep = ctypes.PyDLL(None).usleep
    while True:
        usleep({int(1e6 * HELD_S)})
        time.sleep({FREE_S})

def block():
    while True:
        time.sleep({BLOCKED_S})

def block_loop():
    from nicegui import core
    core.loop.call_soon_threadsafe(block)

signal.signal(signal.SIGUSR1, lambda *_: threading.Thread(target=hold, daemon=True).start())
signal.signal(signal.SIGUSR2, lambda *_: block_loop())
"""


def page_that_can_be_held() -> PageProcess:
    """Return a page whose process holds its interpreter at SIGUSR1, and blocks its event loop at SIGUSR2."""
    folder = Path(tempfile.mkdtemp())
    (folder / "sitecustomize.py").write_text(HINDERED)
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return PageProcess()


@contextmanager
def held_interpreter() -> Iterator[None]:
    """Hold the interpreter repeatedly, like a library that does not release the GIL."""
    ended = threading.Event()
    usleep = ctypes.PyDLL(None).usleep

    def hold() -> None:
        while not ended.wait(FREE_S):
            usleep(int(1e6 * HELD_S))

    thread = threading.Thread(target=hold)
    thread.start()
    yield
    ended.set()
    thread.join()


def measure(
    graph: Graph, commands: Commands, disturbance: Callable[[], AbstractContextManager[None]], trials: int
) -> tuple[list[float], list[float], int]:
    """Return milliseconds from each planned Stop to the first zero, those between commands, and undriven trials."""
    stop = graph.transport.advertise("benchmark", STOP)
    random = np.random.default_rng(0)
    late_ms: list[float] = []
    apart_ms: list[float] = []
    undriven = 0
    with disturbance():
        for _ in range(trials):
            time.sleep(HEARD_S)
            began_s = time.perf_counter()
            stop.publish(Bool(data=False))
            driven = commands.wait_for(True, began_s, DRIVEN_TIMEOUT_S)
            if driven is None:  # a robot at rest shows nothing
                undriven += 1
                continue
            planned_s = time.perf_counter() + random.uniform(0.1, 0.6)
            time.sleep(max(0.0, planned_s - time.perf_counter()))
            stop.publish(Bool(data=True))
            zero_s = commands.wait_for(False, planned_s, STOPPED_TIMEOUT_S)
            late_ms.append(1000 * (zero_s - planned_s) if zero_s is not None else np.inf)
            moments = [at_s for at_s, _ in commands.came if driven <= at_s <= planned_s]
            apart_ms += (1000 * np.diff(moments)).tolist()
    return late_ms, apart_ms, undriven


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the delay of Stop while a process is blocked.")
    parser.add_argument("--trials", type=int, default=20, help="of each kind")
    options = parser.parse_args()
    page = page_that_can_be_held()

    @contextmanager
    def after(number: signal.Signals) -> Iterator[None]:
        page.process.send_signal(number)
        yield

    config = load(
        base={
            "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 30},
            "virtual_hand": {"script": "NONE:1 Forward:1.5"},
            "dashboard": {"port": 0},
        }
    )
    commands = Commands()
    with Graph(config, steering=False) as graph:
        page.serve(graph)
        graph.transport.subscribe("benchmark", CMD_VEL, commands.take)
        graph.start()
        kinds = {
            "nothing": undisturbed,
            "the page's event loop is blocked": lambda: after(signal.SIGUSR2),
            f"a thread there also holds the interpreter, {HELD_S:g} s of {HELD_S + FREE_S:g}": lambda: after(
                signal.SIGUSR1
            ),
            "the page's process is stopped": lambda: after(signal.SIGSTOP),
            f"the interpreter of the graph's process is held, {HELD_S:g} s of {HELD_S + FREE_S:g}": held_interpreter,
        }
        print("disturbance                                                  Stop to zero, ms    between commands, ms")
        print("                                                             median      max     median      max")
        for name, disturbance in kinds.items():
            late, apart, undriven = measure(graph, commands, disturbance, options.trials)
            between = f"{np.median(apart):10.1f} {max(apart):8.1f}" if apart else f"{'-':>10} {'-':>8}"
            note = f"   {undriven} of {options.trials} not driven at all" if undriven else ""
            stopped = f"{np.median(late):10.1f} {max(late):8.1f}" if late else f"{'-':>10} {'-':>8}"
            print(f"{name:58} {stopped} {between}{note}")
        page.stop()


if __name__ == "__main__":
    main()
