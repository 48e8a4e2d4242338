"""What a wire of ROS 2 costs: the way of a Twist and an image between two processes, and the time to the first command.

Run ``python benchmarks/dds.py`` with cyclonedds installed, ``python benchmarks/dds.py --transport zenoh`` with
eclipse-zenoh; its router runs beside. A second process listens and tells how old each message was
when a node's callback got it; both read the same monotonic clock. The same is measured within one process, side by
side, as what the nodes themselves cost. ``--load`` says how busy the machine was.
"""

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the domains that the tests use

from tests.dds.graph import free_domain
from tests.processes import free_port

from handsteer.clock import WallClock
from handsteer.images import image_message
from handsteer.messages import CMD_VEL, HAND_SIGN, IMAGE_RAW, Header, Image, String, Topic, Twist, twist
from handsteer.nodes.node import Node
from handsteer.transports import join
from handsteer.transports.in_process import InProcessTransport
from handsteer.transports.protocol import Publisher, Received, Session, Transport

WIDTH, HEIGHT = 640, 480
SETTLE_S = 0.5
# A Twist's own stamp would change its size; what the robot would do with the time in it does not matter here.
TWISTS = Topic("/benchmark/twist", Twist, depth=10)


def sent_s(message: Any) -> float:
    """Return when a message was sent, in seconds of the monotonic clock."""
    return message.linear.x if isinstance(message, Twist) else float(message.header.frame_id)


class Listener(Node):
    """Notes how old each message is when the callback gets it, in seconds."""

    def __init__(self, transport: Transport, topic: Topic[Any]) -> None:
        super().__init__("listener", transport, WallClock())
        self.ages_s: list[float] = []
        self.subscribe(topic, self._note)
        self.start()

    def _note(self, received: Received[Any]) -> None:
        self.ages_s.append(time.monotonic() - sent_s(received.message))


def cpu_s() -> float:
    """Return the CPU seconds of this process so far."""
    times = os.times()
    return times.user + times.system


def listen(topic: Topic[Any], transport: str) -> None:
    """Be the second process: listen until the input ends, then tell what came."""
    session = join(transport, "listener", [])
    listener = Listener(session.transport, topic)
    print("ready", flush=True)
    sys.stdin.readline()
    began_s = cpu_s()
    sys.stdin.readline()
    print(json.dumps({"ages_s": listener.ages_s, "cpu_s": cpu_s() - began_s}), flush=True)
    session.close()


@contextmanager
def network(transport: str) -> Iterator[None]:
    """Let this process and those that it starts have a network of their own, by their environment."""
    os.environ["ROS_DOMAIN_ID"] = str(free_domain())
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


def send(publisher: Publisher[Any], topic: Topic[Any], count: int, rate: float) -> float:
    """Send ``count`` messages that say when they were sent; return the CPU seconds that it took."""
    picture = np.random.default_rng(0).integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    began_s, due_s = cpu_s(), time.monotonic()
    for _ in range(count):
        if topic.type is Image:
            header = Header(stamp=WallClock().stamp(time.monotonic()), frame_id=repr(time.monotonic()))
            publisher.publish(image_message(picture, header))
        else:
            publisher.publish(twist(time.monotonic(), 0.0))
        due_s += 1 / rate
        time.sleep(max(0.0, due_s - time.monotonic()))
    return cpu_s() - began_s


def across(transport: str, topic: Topic[Any], count: int, rate: float) -> dict[str, Any]:
    """Return what came from this process to another."""
    command = [sys.executable, __file__, "--listen", topic.name, "--transport", transport]
    session = join(transport, "talker", [])
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        assert other.stdout.readline().strip() == "ready"
        publisher = session.transport.advertise("talker", topic)
        wait_for(publisher)
        other.stdin.write("start\n")
        other.stdin.flush()
        cpu = send(publisher, topic, count, rate)
        time.sleep(SETTLE_S)
        other.stdin.write("end\n")
        other.stdin.flush()
        told = dict(json.loads(other.stdout.readline()))
    session.close()
    return {**told, "sender_cpu_s": cpu}


def within(topic: Topic[Any], count: int, rate: float) -> list[float]:
    """Return the ages of messages within one process."""
    transport = InProcessTransport()
    listener = Listener(transport, topic)
    send(transport.advertise("talker", topic), topic, count, rate)
    listener.stop()
    return listener.ages_s


def wait_for(publisher: Publisher[Any]) -> None:
    while not publisher.wanted:
        time.sleep(0.01)
    time.sleep(SETTLE_S)  # the other end has to see this one, too


def first_command_s(transport: str) -> float:
    """Return the seconds from the start of the control's process to its first Twist, signs being shown all the time."""
    session: Session = join(transport, "talker", [])
    came = threading.Event()
    session.transport.subscribe("robot", CMD_VEL, lambda _: came.set())
    signs = session.transport.advertise("talker", HAND_SIGN)
    began_s = time.monotonic()
    with subprocess.Popen([sys.executable, "-m", "handsteer", "control", "--transport", transport]) as control:
        while not came.wait(1 / 30):
            signs.publish(String(data="Forward"))
        took_s = time.monotonic() - began_s
        control.terminate()
    session.close()
    return took_s


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure what a wire of ROS 2 costs.")
    parser.add_argument("--transport", choices=("dds", "zenoh"), default="dds")
    parser.add_argument("--twists", type=int, default=2000, help="Twists to send, 200 a second")
    parser.add_argument("--images", type=int, default=300, help="images to send, 30 a second")
    parser.add_argument("--listen", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.listen:
        listen(TWISTS if options.listen == TWISTS.name else IMAGE_RAW, options.transport)
        return
    print(f"load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with network(options.transport):
        measure(options)


def measure(options: argparse.Namespace) -> None:
    firsts = ", ".join(f"{first_command_s(options.transport):.2f} s" for _ in range(3))
    print(f"first command after the start of the control: {firsts}")
    for topic, count, rate in ((TWISTS, options.twists, 200.0), (IMAGE_RAW, options.images, 30.0)):
        here = np.array(within(topic, count, rate)) * 1000
        there = across(options.transport, topic, count, rate)
        ages = np.array(there["ages_s"]) * 1000
        duration_s = count / rate
        print(f"{topic.type.__name__.rpartition('__')[2]}, {rate:.0f} a second: {len(ages)} of {count} came")
        print("                       median      p99")
        print(f"  within one process {np.median(here):8.2f} {np.percentile(here, 99):8.2f} ms")
        print(f"  over {options.transport:13} {np.median(ages):8.2f} {np.percentile(ages, 99):8.2f} ms")
        sender, listener = 100 * there["sender_cpu_s"] / duration_s, 100 * there["cpu_s"] / duration_s
        print(f"  CPU of the sender {sender:.1f} %, of the listener {listener:.1f} % of a core")


if __name__ == "__main__":
    main()
