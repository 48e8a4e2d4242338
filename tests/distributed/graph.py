"""The nodes of a graph on two machines: camera and robot on the one, recognition and control on the other."""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.contracts.node_contract import VIRTUAL
from tests.dds.graph import PEER, ROS_VARIABLES
from tests.distributed.network import DEVICE, ROBOT, WORKSTATION, Link, Machine
from tests.processes import Peer, Process, as_tests_drive, eventually

CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
ODOM = "/robot_diff_drive_controller/odom"
SIGN = "/gesture/hand_sign"
DIAGNOSTICS = "/diagnostics"
SPEED_MPS = 0.3
SUBNET = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
STATIC_PEERS = {"ROS_STATIC_PEERS": f"{ROBOT};{WORKSTATION}"}
_PATIENCE_S = 20.0
WITH_CLOCK = Path(__file__).with_name("with_clock.py")
# What the plain program looks at the robot's machine with: the same device as the nodes.
_ONLOOKER = (
    f'<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="{DEVICE}"/></Interfaces>'
    "<AllowMulticast>{multicast}</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer address="{address}"/></Peers></Discovery></Domain></CycloneDDS>'
)


@dataclass
class TwoMachines:
    """The processes of a test on both machines, and a plain DDS program on the robot's that looks on.

    Attributes:
        robot: The robot's machine; the camera is on it, too.
        workstation: Where the sign is told.
        link: What joins them.
        variables: ROS 2's variables on both.
        domain: The DDS domain; the namespaces keep it apart from other tests.
    """

    home: Path
    robot: Machine
    workstation: Machine
    link: Link
    variables: dict[str, str] = field(default_factory=lambda: dict(SUBNET))
    domain: int = 0
    _processes: list[Process] = field(default_factory=list)

    def stop(self) -> None:
        """End all processes."""
        for process in self._processes:
            process.kill()

    def onlooker(self, machine: Machine | None = None) -> Peer:
        """Start the plain program, on the robot's machine or another; it notes odometry and what all nodes report."""
        machine = machine or self.robot
        multicast = str("ROS_STATIC_PEERS" not in self.variables).lower()
        words = (
            sys.executable,
            str(PEER),
            str(self.domain),
            _ONLOOKER.format(multicast=multicast, address=machine.address),
        )
        peer = Peer(machine.command(*words), self._environment(), self._log())
        self._processes.append(peer)
        fields = ["header.stamp", "twist.twist.linear.x", "pose.pose.position.x"]
        peer.ask("record", topic=ODOM, type="Odometry", fields=fields)
        peer.ask("record", topic=DIAGNOSTICS, type="DiagnosticArray", fields=["status.0.name", "status.0.message"])
        return peer

    def node(
        self,
        machine: Machine,
        verb: str,
        *options: str,
        ros: tuple[str, ...] = (),
        ahead_s: float = 0.0,
        **variables: str,
    ) -> Process:
        """Start one of handsteer's nodes; ``ahead_s`` is how far that machine's clock is ahead of the others'."""
        module = (str(WITH_CLOCK), str(ahead_s)) if ahead_s else ("-m", "handsteer")
        words = (
            *module,
            verb,
            "--transport",
            "dds",
            *as_tests_drive(verb, options),
            *(("--ros-args", *ros) if ros else ()),
        )
        process = Process(machine.command(sys.executable, *words), self._environment(**variables), self._log())
        self._processes.append(process)
        return process

    def camera(self, script: str, *options: str, on: Machine | None = None, ahead_s: float = 0.0) -> Process:
        """Start a camera that shows the virtual hand, on the robot's machine by default."""
        ros = ("-p", f"virtual_hand.script:={script}")
        return self.node(on or self.robot, "camera", *VIRTUAL, *options, ros=ros, ahead_s=ahead_s)

    def start(
        self,
        script: str = "Forward:600",
        *,
        ahead_s: float = 0.0,
        camera: tuple[str, ...] = (),
        robot: tuple[str, ...] = (),
        camera_on: Machine | None = None,
        control_on: Machine | None = None,
    ) -> "Drive":
        """Start all nodes, with compressed images.

        Args:
            script: What the virtual hand shows.
            ahead_s: How far the clock of the robot's machine is ahead of the workstation's.
            camera: Further options for the camera.
            robot: Further ROS arguments for the robot.
            camera_on: Where the camera runs; the robot's machine by default.
            control_on: Where the control runs; the workstation by default.
        """
        peer = self.onlooker()
        nodes = {
            "robot": self.node(self.robot, "robot", "--world", "empty", ros=robot, ahead_s=ahead_s),
            "control": self.node(control_on or self.workstation, "control", ros=("-p", f"max_linear:={SPEED_MPS}")),
            "recognition": self.node(self.workstation, "recognition", ros=("-p", "image_transport:=compressed")),
        }
        drive = Drive(self, peer, nodes, lambda script: self.camera(script, *camera, on=camera_on, ahead_s=ahead_s))
        drive.show(script)
        return drive

    def _log(self) -> Path:
        return self.home / f"process_{len(self._processes)}.log"

    def _environment(self, **more: str) -> dict[str, str]:
        kept = {name: value for name, value in os.environ.items() if name not in ROS_VARIABLES}
        return {**kept, "ROS_DOMAIN_ID": str(self.domain), "PYTHONUNBUFFERED": "1", **self.variables, **more}


@dataclass(frozen=True)
class Odometry:
    """What the robot said of itself: when (Unix time, by its own clock), its speed in m/s, and how far ahead it is."""

    at_s: float
    speed_mps: float
    x_m: float


@dataclass
class Drive:
    """A drive over the link.

    Attributes:
        machines: Where it runs.
        peer: Looks on.
        nodes: The processes by verb.
        camera: Starts a camera that shows a script.
        listener: Hears what nodes report; the peer by default.
    """

    machines: TwoMachines
    peer: Peer
    nodes: dict[str, Process]
    camera: Callable[[str], Process]
    listener: Peer | None = None
    _script: str = ""
    _shown_s: float = 0.0

    def odometry(self, since_s: float = 0.0) -> list[Odometry]:
        """Return what the robot has said since a time."""
        noted = [Odometry(*values) for _, values in self.peer.ask("get", topic=ODOM)]
        return [one for one in noted if one.at_s > since_s]

    def reports(self, node: str, since_s: float = 0.0) -> list[str]:
        """Return what a node has said on /diagnostics since ``time.monotonic()`` was ``since_s``."""
        noted = (self.listener or self.peer).ask("get", topic=DIAGNOSTICS)
        return [message for at_s, (name, message) in noted if name.endswith(f": {node}") and at_s > since_s]

    def until_fast(self) -> None:
        """Wait until the robot drives at its limit.

        A machine that is held up for a moment stops it, and rightly so; then neutral is shown again.
        """

        def is_fast() -> bool:
            if time.monotonic() - self._shown_s > _PATIENCE_S:
                self.show(f"Stop:3 {self._script}")
            return self._last().speed_mps > SPEED_MPS - 0.01

        self.until(is_fast, "the robot to drive at its limit")

    def until_moving(self) -> None:
        """Wait until the robot drives at whatever speed."""
        self.until(lambda: self._last().speed_mps > 0.05, "the robot to drive")

    def show_neutral(self) -> None:
        """Show Stop for a while, then Forward; repeated, as it may not be seen yet."""
        self.show("Stop:3 Forward:12")

    def show(self, script: str) -> None:
        """Show what a script says, by a new camera."""
        if "camera" in self.nodes:
            self.nodes.pop("camera").kill()
        self.nodes["camera"] = self.camera(script)
        self._script, self._shown_s = script, time.monotonic()

    def until_standing(self) -> None:
        """Wait until the robot stands."""
        self.until(lambda: abs(self._last().speed_mps) < 0.005, "the robot to stand")

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Wait until ``condition`` holds; fail when a process ends meanwhile."""

        def met() -> Any:
            is_met = condition()
            if not is_met:
                self._check()
            return is_met

        eventually(met, what=what)

    def stop_times(self, since_s: float) -> tuple[float, float]:
        """Return how long after ``since_s`` the robot became slower, and how long until it stood, in seconds."""
        since = self.odometry(since_s)
        slower_s = next(one.at_s for one in since if one.speed_mps < SPEED_MPS - 0.02)
        stood_s = next(one.at_s for one in since if abs(one.speed_mps) < 0.005)
        return slower_s - since_s, stood_s - since_s

    def moved_m(self, since_s: float) -> float:
        """Return how far the robot has been from where it was at ``since_s``."""
        places = [one.x_m for one in self.odometry(since_s)] or [0.0]
        return max(places) - min(places)

    def assert_standing(self, seconds: float) -> None:
        """See that the robot stands for so long, by what it says itself."""
        self.until(self.odometry, "the robot to say something")  # its clock need not be ours
        since_s = self._last().at_s
        time.sleep(seconds)
        assert len(self.odometry(since_s)) > seconds, "the robot has fallen silent"
        assert self.moved_m(since_s) < 0.001

    def _last(self) -> Odometry:
        noted = self.odometry()
        return noted[-1] if noted else Odometry(time.time(), 0.0, 0.0)

    def _check(self) -> None:
        for verb, process in self.nodes.items():
            assert process.running, f"{verb} has ended: {process.text}"
