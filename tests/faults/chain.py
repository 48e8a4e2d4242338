"""All five nodes in stepped time, on a transport with faults; each can be frozen, killed and made anew."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from handsteer.clock import SteppedClock
from handsteer.config import ControlConfig, RobotConfig, SignsConfig
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    STOP,
    Bool,
    DiagnosticArray,
    Header,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Topic,
    Twist,
    TwistWithCovariance,
    twist,
)
from handsteer.nodes.base import Node
from handsteer.nodes.camera import CameraNode
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.recognition import HandSignRecognitionNode
from handsteer.nodes.robot import RobotNode
from handsteer.nodes.steering import SteeringNode
from handsteer.robots import Robot
from handsteer.robots.remote import RemoteRobot
from handsteer.testing.fault_transport import FaultTransport
from handsteer.testing.faulty_camera import SpoiltCamera
from handsteer.transports.base import Received, Session
from handsteer.types import NONE
from tests.faults.base import Base
from tests.faults.domain import Domain
from tests.faults.painted import PaintedCamera, painted_recognizer

# Where a stamp of zero would stand for none.
_BEGIN_S = 100.0
SPEED_MPS = 0.3
SECOND_CONTROL = "second_hand_sign_control"
"""Name of a control that runs beside the first, or in its place."""
REAL_CMD_VEL = Topic("/cmd_vel", Twist, depth=10)
REAL_ODOM = Topic("/odom", Odometry)
NO_COVARIANCE = np.zeros(36)


class Chain:
    """The graph of a robot that may be real: every node a process of its own, signs without the time of their frame.

    Attributes:
        faults: The transport.
        hand: Shows the signs.
        camera: Looks at the hand, unless it fails.
        base: What the robot's motors are asked for.
        said: The last sentence of each node on /diagnostics.
    """

    def __init__(self) -> None:
        self.clock = SteppedClock(_BEGIN_S)
        self.domain = Domain()
        self.faults = FaultTransport(self.domain, self.clock, carries_capture_times=False)
        self.hand = PaintedCamera(self.clock)
        self.camera = SpoiltCamera(self.hand, self.clock)
        self.base = Base(self.clock, RobotConfig())
        self.said: dict[str, str] = {}
        self.moments: list[tuple[float, bool]] = []
        self.faults.subscribe("onlooker", DIAGNOSTICS, self._on_report)
        self._say_stop = self.faults.advertise("onlooker", STOP)
        self._make: dict[str, Callable[[], Node]] = {
            "robot": self._robot,
            "control": self._control,
            "recognition": self._recognition,
            "camera": lambda: CameraNode(self.faults, self.clock, self.camera),
            "steering": lambda: SteeringNode(self.faults, self.clock, self.limits()),
        }
        self.nodes = {name: make() for name, make in self._make.items()}
        self.page = _Page(self)
        self._frozen: set[str] = set()
        self._dead: set[str] = set()

    @property
    def extra(self) -> list[Node]:
        """What runs beside the five nodes, and never fails."""
        return [self.faults.wire, self.page]

    @property
    def steering(self) -> SteeringNode:
        node = self.nodes["steering"]
        assert isinstance(node, SteeringNode)
        return node

    def is_well(self, name: str) -> bool:
        """Return whether a node runs."""
        return name not in self._frozen | self._dead

    @property
    def speakers(self) -> list[str]:
        """Names of the nodes that say why the robot stands, those first that know best."""
        return [*(["hand_sign_control"] if self.is_well("control") else []), SECOND_CONTROL, "robot"]

    def show(self, sign: str = NONE) -> None:
        """Let the hand show ``sign`` from now on."""
        self.hand.sign = sign

    def say_stop(self, *, stop: bool) -> None:
        """Say it once on /stop, as any program may."""
        self._say_stop.publish(Bool(data=stop))

    def freeze(self, name: str) -> None:
        """Let a node stand where it is, as SIGSTOP does; messages wait for it."""
        self._frozen.add(name)

    def thaw(self, name: str) -> None:
        """Let it go on."""
        self._frozen.discard(name)

    def kill(self, name: str) -> None:
        """End a node at once, as SIGKILL does."""
        self.domain.kill(self.nodes[name].name)
        self._dead.add(name)

    def end(self, name: str) -> None:
        """End a node as Ctrl-C does."""
        self.nodes[name].stop()
        self.kill(name)

    def make(self, name: str) -> None:
        """Start a node that has ended."""
        self.nodes[name] = self._make[name]()
        self._dead.discard(name)

    def run(self, seconds: float) -> None:
        """Let ``seconds`` pass, and note in :attr:`moments` after each event whether the robot is asked to move."""
        end_s = self.clock.now() + seconds
        while True:
            alive = self._alive()
            while any([node.spin_once() for node in alive]):
                pass
            self._note()
            due_s = min((node.next_due_s for node in alive if node.next_due_s is not None), default=end_s)
            # As often, at least, as the robot's own watchdog looks.
            self.clock.advance_to(min(due_s, end_s, self.clock.now() + 0.02))
            if self.clock.now() >= end_s:
                break
        self._note()

    def moved(self, since_s: float, until_s: float) -> list[float]:
        """Return when, between these times, the robot was asked to move."""
        return [at_s for at_s, moves in self.moments if moves and since_s <= at_s <= until_s]

    def _note(self) -> None:
        self.moments.append((self.clock.now(), self.base.is_asked_to_move))

    def _alive(self) -> list[Node]:
        out = self._frozen | self._dead
        return [*self.extra, *(node for name, node in self.nodes.items() if name not in out)]

    def _on_report(self, received: Received[DiagnosticArray]) -> None:
        for status in received.message.status:
            self.said[status.name] = status.message

    def limits(self) -> ControlConfig:
        """Return the configuration of every control."""
        return ControlConfig.model_validate({"max_linear": SPEED_MPS, "linear_step": 0.05})

    def _control(self) -> Node:
        return HandSignControlNode(self.faults, self.clock, self.limits(), arming=True)

    def _robot(self) -> Node:
        return RobotNode(self.faults, self.clock, self._driven(), RobotConfig())

    def _driven(self) -> Robot:
        return self.base

    def _recognition(self) -> Node:
        config = SignsConfig()
        return HandSignRecognitionNode(self.faults, self.clock, painted_recognizer(config), config)


class _Page(Node):
    """Whoever holds the stick of the page: asks to go forward ten times a second."""

    def __init__(self, chain: Chain) -> None:
        super().__init__("page", Domain(), chain.clock)
        self.holds_stick = self._held = False
        self._chain = chain
        self.every(0.1, self._steer)

    def _steer(self) -> None:
        takes, self._held = self.holds_stick and not self._held, self.holds_stick
        if self.holds_stick and self._chain.is_well("steering"):
            if takes:
                self._chain.steering.steer(0.0, 0.0)  # as the page does where a pad is touched
            self._chain.steering.steer(SPEED_MPS, 0.0)


class RemoteChain(Chain):
    """The same with a real robot behind a topic, as ``handsteer run --robot`` drives it.

    Attributes:
        real: The real robot's end.
    """

    real: "RealRobot | None" = None

    @property
    def extra(self) -> list[Node]:
        return [*super().extra, *([self.real] if self.real else [])]

    def _driven(self) -> Robot:
        self.real = self.real or RealRobot(self)
        config = RobotConfig(kind="dds", cmd_vel_topic="cmd_vel", odom_topic="odom")
        return RemoteRobot(config, CMD_VEL, "base_link", _Session(self.faults, self.clock))


@dataclass(frozen=True)
class _Session(Session):
    transport: FaultTransport
    clock: SteppedClock
    name: str = "/robot"
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def wait(self, timeout_s: float) -> bool:
        return False

    def close(self) -> None:
        pass


class RealRobot(Node):
    """Listens on ``/cmd_vel`` and says 20 times a second on ``/odom`` where it is.

    Attributes:
        lies: Returns what it says instead of the truth.
    """

    def __init__(self, chain: Chain) -> None:
        super().__init__("real_robot", chain.faults, chain.clock)
        self.lies: Callable[[Odometry], Odometry] = lambda odometry: odometry
        self._base = chain.base
        self._odom = self.publisher(REAL_ODOM)
        self.subscribe(REAL_CMD_VEL, lambda received: self._base.command(*_speeds(received.message)))
        self.every(0.05, self._say)

    def _say(self) -> None:
        pose = Pose(Point(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        at = PoseWithCovariance(pose, NO_COVARIANCE)
        speed_mps = self._base.speed_mps if self._base.is_asked_to_move else 0.0
        moving = TwistWithCovariance(twist(speed_mps, 0.0), NO_COVARIANCE)
        stamp = self.clock.stamp(self.clock.now())
        self._odom.publish(self.lies(Odometry(Header(stamp, "odom"), "base_link", at, moving)))


def _speeds(message: Twist) -> tuple[float, float]:
    return message.linear.x, message.angular.z
