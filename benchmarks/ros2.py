"""Messages received by a real ROS 2: Twists and pictures from this process to rclpy on Fast DDS, default buffers.

Run ``make ros2`` once, then ``python benchmarks/ros2.py``. Both ends read the same monotonic clock.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the ROS 2 node that the tests use

from _measuring import at_rate
from tests.processes import eventually
from tests.ros2.graph import Ros2Graph

from handsteer.clock import WallClock
from handsteer.config import VirtualHandConfig
from handsteer.images import image_message, jpeg_message
from handsteer.messages import IMAGE_COMPRESSED, IMAGE_RAW, Header, Image, Topic, Twist, twist
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.transports import join
from handsteer.transports.base import Publisher, Session

TWISTS = Topic("/benchmark/twist", Twist, depth=10)
FIELDS = {TWISTS: ["linear.x"], IMAGE_COMPRESSED: ["header.frame_id"], IMAGE_RAW: ["header.frame_id"]}
SETTLE_S = 1.0


def message(topic: Topic[Any], picture: Any) -> Any:
    """Return a message that contains its creation time."""
    if topic is TWISTS:
        return twist(time.monotonic(), 0.0)
    header = Header(stamp=WallClock().stamp(time.monotonic()), frame_id=repr(time.monotonic()))
    return image_message(picture, header) if topic.type is Image else jpeg_message(picture, header)


def send(publisher: Publisher[Any], topic: Topic[Any], count: int, rate: float) -> None:
    picture = VirtualHandCamera(VirtualHandConfig(), width=640, height=480, fps=30, clock=WallClock()).read().image
    for _ in at_rate(rate, count):
        publisher.publish(message(topic, picture))


def measure(session: Session, peer: Any, topic: Topic[Any], count: int, rate: float) -> None:
    kind = topic.type.__name__.rpartition("__")[2]
    reliable = topic is TWISTS
    peer.ask("record", topic=topic.name, type=kind, fields=FIELDS[topic], reliable=reliable, depth=10)
    publisher = session.transport.advertise("talker", topic)
    eventually(lambda: publisher.has_subscribers)
    time.sleep(SETTLE_S)  # the other end must have discovered this one, too
    send(publisher, topic, count, rate)
    time.sleep(SETTLE_S)
    came = peer.ask("get", topic=topic.name)
    ages = np.array([1000 * (at_s - float(sent)) for at_s, (sent,) in came])
    figures = f"median {np.median(ages):6.2f} ms, p99 {np.percentile(ages, 99):6.2f} ms" if len(ages) else ""
    print(f"  {kind:16s} {rate:5.0f} per second: {len(came):4d} of {count:4d} received; {figures}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the messages received by a real ROS 2.")
    parser.add_argument("--images", type=int, default=300, help="pictures of each kind to send, 30 per second")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as home, Ros2Graph(Path(home)) as graph:
        os.environ.update({name: value for name, value in graph.env.items() if name.startswith("ROS_")})
        session = join("dds", "talker", [])
        print(f"from handsteer to rclpy on Fast DDS; load before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        measure(session, graph.peer, TWISTS, 1000, 100.0)
        measure(session, graph.peer, IMAGE_COMPRESSED, options.images, 30.0)
        measure(session, graph.peer, IMAGE_RAW, options.images, 30.0)
        session.close()


if __name__ == "__main__":
    main()
