"""Cost of a ROS 2 transport: latency of a Twist and an image between two processes, and time to the first command.

Run ``python benchmarks/dds.py`` with cyclonedds installed; with ``--transport zenoh`` and eclipse-zenoh, whose router
it starts; or, after ``make ros2``, ``.venv/ros2/bin/python benchmarks/dds.py --transport ros2`` for rclpy. A second
process subscribes and reports the age of each message in a node's callback; both read the same monotonic clock. The
same is measured within one process, alternating message by message, as the cost of the nodes themselves.
"""

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the domains that the tests use

from _measuring import at_rate
from tests.dds.graph import free_domain
from tests.processes import free_port

from handsteer.clock import WallClock
from handsteer.images import image_message
from handsteer.messages import CMD_VEL, HAND_SIGN, Header, Image, String, Topic, Twist, twist
from handsteer.nodes.base import Node
from handsteer.transports import join
from handsteer.transports.base import Publisher, Received, Transport
from handsteer.transports.in_process import InProcessTransport

WIDTH, HEIGHT = 640, 480
SETTLE_S = 0.5
MODULES = ("handsteer.cli.app", "handsteer.cli.one_node")
SESSIONS = {
    "dds": "handsteer.plugins.dds.transport",
    "zenoh": "handsteer.plugins.zenoh.transport",
    "ros2": "handsteer.plugins.ros2.session",
}
# A Twist carries its send time in a field, because a stamp would change its size.
TWISTS = Topic("/benchmark/twist", Twist, depth=10)
# Deep enough that only lost messages are missing; in a graph, a newer one replaces them.
IMAGES = Topic("/benchmark/image", Image, depth=10)


def sent_s(message: Any) -> float:
    """Return when a message was sent, in seconds of the monotonic clock."""
    return message.linear.x if isinstance(message, Twist) else float(message.header.frame_id)


@dataclass(frozen=True)
class Figures:
    """Results of one run.

    Attributes:
        here: Age of each message within one process, in milliseconds.
        there: The same over the transport.
        sender: CPU time of publishing, in percent of a core.
        listener: CPU time of the whole other process, in percent of a core.
    """

    here: np.ndarray
    there: np.ndarray
    sender: float
    listener: float


class Listener(Node):
    """Records the age of each message in its callback, in seconds."""

    def __init__(self, transport: Transport, topic: Topic[Any]) -> None:
        super().__init__("listener", transport, WallClock())
        self.ages_s: list[float] = []
        self.subscribe(topic, self._note)
        self.start()

    def _note(self, received: Received[Any]) -> None:
        self.ages_s.append(time.monotonic() - sent_s(received.message))


def listen(topic: Topic[Any], transport: str) -> None:
    """Run the second process: subscribe until the input ends, then report the ages."""
    session = join(transport, "listener", [])
    listener = Listener(session.transport, topic)
    print("ready", flush=True)
    sys.stdin.readline()
    began_s = time.process_time()
    sys.stdin.readline()
    print(json.dumps({"ages_s": listener.ages_s, "cpu_s": time.process_time() - began_s}), flush=True)
    session.close()


@contextmanager
def network(transport: str) -> Iterator[None]:
    """Isolate this process and its children from other networks, by environment variables."""
    os.environ |= {"ROS_DOMAIN_ID": str(free_domain()), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    if transport != "zenoh":
        yield
        return
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    command = [sys.executable, "-m", "handsteer", "zenoh-router", "--listen", endpoint]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as router:
        assert router.stderr is not None
        assert "listens" in router.stderr.readline()
        os.environ["ZENOH_CONFIG_OVERRIDE"] = f'connect/endpoints=["{endpoint}"]'
        yield
        del os.environ["ZENOH_CONFIG_OVERRIDE"]
        router.terminate()


def send(publishers: Sequence[Publisher[Any]], topic: Topic[Any], count: int, rate: float) -> list[float]:
    """Send ``count`` messages with each publisher, alternating, so that other load affects all alike.

    Returns:
        CPU seconds of each publisher.
    """
    picture = np.random.default_rng(0).integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    spent_s = [0.0] * len(publishers)
    for sent in at_rate(rate * len(publishers), count * len(publishers)):
        number = sent % len(publishers)
        began_s = time.thread_time()
        if topic.type is Image:
            header = Header(stamp=WallClock().stamp(time.monotonic()), frame_id=repr(time.monotonic()))
            publishers[number].publish(image_message(picture, header))
        else:
            publishers[number].publish(twist(time.monotonic(), 0.0))
        spent_s[number] += time.thread_time() - began_s
    return spent_s


def measure(wire: str, topic: Topic[Any], count: int, rate: float) -> Figures:
    """Return the results over ``wire`` from this process to another, and within this process."""
    command = [sys.executable, __file__, "--listen", topic.name, "--transport", wire]
    session = join(wire, "talker", [])
    transport = InProcessTransport()
    listener = Listener(transport, topic)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        assert other.stdout.readline().strip() == "ready"
        publisher = session.transport.advertise("talker", topic)
        wait_for(publisher)
        other.stdin.write("start\n")
        other.stdin.flush()
        _, spent_s = send([transport.advertise("talker", topic), publisher], topic, count, rate)
        time.sleep(SETTLE_S)
        other.stdin.write("end\n")
        other.stdin.flush()
        told = json.loads(other.stdout.readline())
    session.close()
    listener.stop()
    here, there = (1000 * np.array(ages_s) for ages_s in (listener.ages_s, told["ages_s"]))
    return Figures(here, there, 100 * spent_s * rate / count, 100 * told["cpu_s"] * rate / count)


def wait_for(publisher: Publisher[Any]) -> None:
    while not publisher.has_subscribers:
        time.sleep(0.01)
    time.sleep(SETTLE_S)  # the other end must have discovered this one, too


def first_command_s(wire: str) -> float:
    """Return the seconds from the start of the control's process to its first Twist, with a sign always shown."""
    session = join(wire, "talker", [])
    came = threading.Event()
    session.transport.subscribe("robot", CMD_VEL, lambda _: came.set())
    signs = session.transport.advertise("talker", HAND_SIGN)
    began_s = time.monotonic()
    with subprocess.Popen([sys.executable, "-m", "handsteer", "control", "--transport", wire]) as control:
        while not came.wait(1 / 30):
            signs.publish(String(data="Forward"))
        took_s = time.monotonic() - began_s
        control.terminate()
    session.close()
    return took_s


def loading_s(wire: str) -> float:
    """Return the seconds in which a new process imports the control's modules and ends."""
    began_s = time.monotonic()
    subprocess.run([sys.executable, "-c", f"import {', '.join((*MODULES, SESSIONS[wire]))}"], check=True)
    return time.monotonic() - began_s


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the cost of a ROS 2 transport.")
    parser.add_argument("--transport", choices=("dds", "zenoh", "ros2"), default="dds")
    parser.add_argument("--twists", type=int, default=2000, help="Twists to send, 200 per second")
    parser.add_argument("--images", type=int, default=300, help="images to send, 30 per second")
    parser.add_argument("--runs", type=int, default=3, help="number of runs")
    parser.add_argument("--listen", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.listen:
        listen(TWISTS if options.listen == TWISTS.name else IMAGES, options.transport)
        return
    with network(options.transport):
        report(options)


def report(options: argparse.Namespace) -> None:
    print(f"load of the machine before: {load()}")
    starts = [(first_command_s(options.transport), loading_s(options.transport)) for _ in range(options.runs)]
    print(
        f"first command after the start of the control {row([first for first, _ in starts])} s, "
        f"of which Python's modules take {row([loading for _, loading in starts])} s"
    )
    for topic, count, rate in ((TWISTS, options.twists, 200.0), (IMAGES, options.images, 30.0)):
        runs = [measure(options.transport, topic, count, rate) for _ in range(options.runs)]
        print(f"{topic.type.__name__.rpartition('__')[2]}, {rate:.0f} a second; load of the machine {load()}")
        print(f"  came over {options.transport:9}" + ", ".join(f"{len(run.there)} of {count}" for run in runs))
        for name, percent in (("median", 50), ("p99", 99)):
            here, there = (
                [float(np.percentile(ages, percent)) for ages in column]
                for column in zip(*((run.here, run.there) for run in runs), strict=True)
            )
            more = [one - other for one, other in zip(there, here, strict=True)]
            print(f"  {name:6s}  within {row(here)}  over {options.transport} {row(there)}  more {row(more)} ms")
        print(
            f"  CPU of the sender {row([run.sender for run in runs])}, of the listener "
            f"{row([run.listener for run in runs])} % of a core"
        )


def row(values: list[float]) -> str:
    """Return the median of the runs, and the runs."""
    return f"{np.median(values):.2f} ({', '.join(f'{value:.2f}' for value in values)})"


def load() -> str:
    return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


if __name__ == "__main__":
    main()
