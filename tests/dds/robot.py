"""Robots as plain DDS programs that know nothing of handsteer: they follow commands, and say where they are.

Types are written by hand, from ROS 2's definitions, and cyclonedds itself encodes them. It reads orders as lines of
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
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, uint32
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

LOOPBACK = """<CycloneDDS><Domain><General>
<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast>
</General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
PERIOD_S = 0.02
TIMEOUT_S = 0.5


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
class TwistStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TwistStamped_"):
    header: Header = field(default_factory=Header)
    twist: Twist = field(default_factory=Twist)


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose = field(default_factory=Pose)
    covariance: array[float64, 36] = field(default_factory=lambda: [0.0] * 36)


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist = field(default_factory=Twist)
    covariance: array[float64, 36] = field(default_factory=lambda: [0.0] * 36)


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass
class TurtlePose(IdlStruct, typename="turtlesim::msg::dds_::Pose_"):
    x: float32 = 0.0
    y: float32 = 0.0
    theta: float32 = 0.0
    linear_velocity: float32 = 0.0
    angular_velocity: float32 = 0.0


QOS = Qos(
    Policy.Reliability.Reliable(1_000_000_000),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


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


ORDERS = {order.__name__: order for order in (add, state, commands, odometry)}
threading.Thread(target=run, daemon=True).start()
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    print(json.dumps(ORDERS[order["order"]](order)), flush=True)
