"""Robots as plain DDS programs that know nothing of handsteer: they follow commands, and say where they are.

cyclonedds itself encodes the types of ``ros_types.py``. It reads orders as lines of
JSON and answers each by one. ``add`` (name, cmd_vel, stamped, odom, turtle) makes a robot, which stops by itself when
it has heard nothing for half a second. ``state`` (name) returns ``[x, y, yaw, linear, angular]``, ``commands``
(name) what it was told as ``[time_s, linear, angular, stamp_s, frame]``. ``odometry`` (name, mode) sets what it says of
itself: the truth (``on``), nothing (``off``), no numbers (``nan``), or a place far away (``far``).
"""

import json
import math
import sys
import threading
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros_types import (
    CDR,
    LOOPBACK,
    RELIABLE,
    Header,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    TurtlePose,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    Vector3,
)

PERIOD_S = 0.02
TIMEOUT_S = 0.5


QOS = Qos(RELIABLE, Policy.History.KeepLast(10), CDR)


class Robot:
    def __init__(self, order: dict[str, Any]) -> None:
        kind = TwistStamped if order.get("stamped") else Twist
        self.turtle = bool(order.get("turtle"))
        self.reader = DataReader(participant, Topic(participant, f"rt{order['cmd_vel']}", kind), qos=QOS)
        odometry = Topic(participant, f"rt{order['odom']}", TurtlePose if self.turtle else Odometry)
        self.writer = DataWriter(participant, odometry, qos=QOS)
        self.x = self.y = self.yaw = self.linear = self.angular = 0.0
        self.heard_s = -math.inf
        self.mode = "on"
        self.told: list[Any] = []

    def step(self) -> None:
        now = time.monotonic()
        for message in self.reader.take(100):
            if isinstance(message, InvalidSample):
                continue
            twist: Any = getattr(message, "twist", message)
            header = getattr(message, "header", Header())
            self.linear, self.angular, self.heard_s = twist.linear.x, twist.angular.z, now
            stamp_s = header.stamp.sec + header.stamp.nanosec / 1e9
            self.told.append([now, self.linear, self.angular, stamp_s, header.frame_id])
        if now - self.heard_s > TIMEOUT_S:
            self.linear = self.angular = 0.0
        self.yaw += self.angular * PERIOD_S
        self.x += self.linear * math.cos(self.yaw) * PERIOD_S
        self.y += self.linear * math.sin(self.yaw) * PERIOD_S
        if self.mode != "off":
            self.writer.write(self.pose())

    def pose(self) -> Any:
        x = {"nan": math.nan, "far": self.x + 1000.0}.get(self.mode, self.x)
        if self.turtle:
            return TurtlePose(x, self.y, self.yaw, self.linear, self.angular)
        turned = Quaternion(z=math.sin(self.yaw / 2), w=math.cos(self.yaw / 2))
        return Odometry(
            header=Header(frame_id="odom"),
            child_frame_id="base_link",
            pose=PoseWithCovariance(Pose(Point(x, self.y), turned)),
            twist=TwistWithCovariance(Twist(Vector3(self.linear), Vector3(z=self.angular))),
        )


domain = Domain(int(sys.argv[1]), LOOPBACK)
participant = DomainParticipant(int(sys.argv[1]))
robots: dict[str, Robot] = {}


def add(order: dict[str, Any]) -> bool:
    robots[order["name"]] = Robot(order)
    return True


def state(order: dict[str, Any]) -> list[float]:
    robot = robots[order["name"]]
    return [robot.x, robot.y, robot.yaw, robot.linear, robot.angular]


def commands(order: dict[str, Any]) -> list[Any]:
    return list(robots[order["name"]].told)


def odometry(order: dict[str, Any]) -> bool:
    robots[order["name"]].mode = order["mode"]
    return True


def run() -> None:
    while True:
        for robot in list(robots.values()):
            robot.step()
        time.sleep(PERIOD_S)


threading.Thread(target=run, daemon=True).start()
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    answer = globals()[order["order"]](order)  # the function of that name
    print(json.dumps(answer), flush=True)
