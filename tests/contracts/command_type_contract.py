"""What every transport of ROS 2 must do where a robot takes Twist or TwistStamped; each one's own tests inherit it."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.processes import Peer, Process, eventually

CMD_VEL = "/cmd_vel"
SIGNS = "/gesture/hand_sign"
FIELDS = {"Twist": ["linear.x"], "TwistStamped": ["twist.linear.x"]}
KINDS = tuple(FIELDS)


class Robot:
    """A program that knows nothing of handsteer; it takes commands of one type from :meth:`come` on.

    Args:
        peer: The program.
        kind: ``Twist`` or ``TwistStamped``.
        topic: Where it is commanded.
        introduce: Whether it has to tell others in so many words that it subscribes.
    """

    def __init__(self, peer: Peer, kind: str, topic: str = CMD_VEL, *, introduce: bool = False) -> None:
        self.peer = peer
        self._kind = kind
        self._topic = topic
        self._introduce = introduce

    def come(self) -> "Robot":
        self.peer.ask("record", topic=self._topic, type=self._kind, fields=FIELDS[self._kind])
        if self._introduce:
            self.peer.ask("introduce", name=f"takes_{self._kind}", topic=self._topic, type=self._kind, kind="MS")
        return self

    @property
    def told(self) -> list[float]:
        """What it was told, in m/s."""
        return [speed for _, (speed,) in self.peer.ask("get", topic=self._topic)]

    def leave(self) -> None:
        """End as a program ends that is asked to."""
        assert self.peer.popen.stdin is not None
        self.peer.popen.stdin.close()
        self.peer.code()


MakeRobot = Callable[[str], Robot]
"""Starts a robot of this kind, which does not listen yet."""


def as_which(process: Process) -> list[str]:
    """Return the types that a process has said that it changed to."""
    lines = [line for line in process.text.splitlines() if "commands go out as" in line and "from now on" in line]
    assert all(f"{CMD_VEL}: " in line for line in lines), lines
    return [line.partition("commands go out as ")[2].split()[0].rpartition("/")[2] for line in lines]


class CommandTypeContract:
    """Inherit, and provide ``graph`` (as ``tests.dds.graph``) and ``make_robot``."""

    @pytest.fixture
    def graph(self) -> Any:
        raise NotImplementedError

    @pytest.fixture
    def make_robot(self, graph: Any) -> MakeRobot:
        raise NotImplementedError

    def control(self, graph: Any) -> Process:
        graph.peer.ask("advertise", topic=SIGNS, type="String")
        words = ("-r", f"robot_diff_drive_controller/cmd_vel:={CMD_VEL}")
        process: Process = graph.node("control", "--control.arming", "on", name="/hand_sign_control", ros=words)
        eventually(lambda: graph.peer.ask("listeners", topic=SIGNS) > 0)
        return process

    def show(self, graph: Any, sign: str, count: int) -> None:
        graph.peer.ask("publish", topic=SIGNS, values={"data": sign}, count=count, period_s=0.02)

    def drive(self, graph: Any, robot: Robot) -> None:
        """Show Stop, then Forward, until the robot is told to move."""
        before = len(robot.told)

        def moves() -> bool:
            self.show(graph, "Stop", 3)
            self.show(graph, "Forward", 5)
            return any(speed > 0 for speed in robot.told[before:])

        eventually(moves, what="the robot to be driven")

    @pytest.mark.parametrize("kind", KINDS)
    @pytest.mark.parametrize("comes", ["first", "later"])
    def test_a_robot_is_sent_what_it_takes_whoever_comes_first(
        self, graph: Any, make_robot: MakeRobot, kind: str, comes: str
    ) -> None:
        robot = make_robot(kind)
        if comes == "first":
            robot.come()
        process = self.control(graph)
        if comes == "later":
            robot.come()
        self.drive(graph, robot)
        assert as_which(process) == ([] if kind == "Twist" else ["TwistStamped"])
        assert "nothing passes" not in process.text
        assert "ncompatible" not in process.text

    @pytest.mark.parametrize("kinds", [KINDS, KINDS[::-1]], ids=" then ".join)
    def test_a_robot_that_takes_the_place_of_another_is_driven_after_neutral(
        self, graph: Any, make_robot: MakeRobot, kinds: tuple[str, str]
    ) -> None:
        first, second = map(make_robot, kinds)
        first.come()
        process = self.control(graph)
        self.drive(graph, first)
        first.leave()
        second.come()
        changes = 2 - KINDS.index(kinds[1])

        def changed() -> bool:
            self.show(graph, "Forward", 10)
            return len(as_which(process)) == changes

        eventually(changed, what="the change of the type")
        for _ in range(5):
            self.show(graph, "Forward", 10)
        assert set(second.told) <= {0.0}, "no robot drives off because another was driven"
        self.drive(graph, second)
        assert as_which(process)[-1] == kinds[1]
        assert len(as_which(process)) == changes
        assert "subscribers take both" not in process.text

    def test_a_robot_that_is_left_for_one_that_takes_a_stamp_stands(self, graph: Any, make_robot: MakeRobot) -> None:
        first, second = make_robot("Twist").come(), make_robot("TwistStamped")
        process = self.control(graph)
        self.drive(graph, first)
        second.come()

        def changed() -> bool:
            self.show(graph, "Forward", 10)
            return bool(as_which(process))

        eventually(changed, what="the change of the type")
        assert first.told[-1] == 0.0
        told = len(first.told)
        self.drive(graph, second)
        assert first.told[told:] == []
        assert process.text.count("subscribers take both") == 1
        second.leave()
        self.drive(graph, first)
        assert as_which(process) == ["TwistStamped", "Twist"]
        assert process.text.count("subscribers take both") == 1
