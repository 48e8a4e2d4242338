"""One hand and three robots in three namespaces, over DDS."""

import signal
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.dds.graph import DdsGraph
from tests.processes import Peer, eventually

pytest.importorskip("cyclonedds")
pytestmark = pytest.mark.slow

ROBOT = Path(__file__).with_name("robot.py")
NAMES = ("r1", "r2", "r3")
CMD_VEL = "robot_diff_drive_controller/cmd_vel"
SIGNS, SELECT = "/gesture/hand_sign", "/select_robot"


def show(graph: DdsGraph, sign: str, count: int = 20) -> None:
    graph.peer.ask("publish", topic=SIGNS, values={"data": sign}, count=count, period_s=0.03)


def select(graph: DdsGraph, name: str) -> None:
    selected = graph.peer.ask("get", topic="/selected_robot")
    graph.peer.ask("publish", topic=SELECT, values={"data": name})
    eventually(lambda: len(graph.peer.ask("get", topic="/selected_robot")) > len(selected), 10.0, what=name)


def start(graph: DdsGraph, home: Path, *ros: str, stamped: bool = False) -> Peer:
    robots = Peer([sys.executable, str(ROBOT), str(graph.domain)], graph.env, home / "robots.log")
    graph.adopt(robots)
    for name in NAMES:
        robots.ask("add", name=name, cmd_vel=f"/{name}/{CMD_VEL}", odom=f"/{name}/odom", stamped=stamped)
    graph.peer.ask("record", topic="/selected_robot", type="String", fields=["data"], latched=True)
    for topic in (SIGNS, SELECT):
        graph.peer.ask("advertise", topic=topic, type="String")
    graph.node("control", name="/hand_sign_control", ros=("-p", f"robots:=[{', '.join(NAMES)}]", *ros))
    eventually(lambda: all(graph.peer.ask("listeners", topic=topic) for topic in (SIGNS, SELECT)))
    eventually(lambda: graph.peer.ask("get", topic="/selected_robot"), what="the robot that is selected")
    # A command reaches each of them: both ends have found each other.
    for _ in NAMES:
        told = {name: len(robots.ask("commands", name=name)) for name in NAMES}
        eventually(partial(_is_told_more, graph, robots, told), what="a robot that hears the control")
        select(graph, "next")
    return robots


def _is_told_more(graph: DdsGraph, robots: Peer, told: dict[str, int]) -> bool:
    show(graph, "Stop", count=1)
    selected = graph.peer.ask("get", topic="/selected_robot")[-1][1][0]
    return len(robots.ask("commands", name=selected)) > told[selected]


def _is_told_zero(robots: Peer, name: str) -> bool:
    return bool(robots.ask("commands", name=name)[-1][1] == 0.0)


def moved_by(graph: DdsGraph, robots: Peer, sign: str) -> list[str]:
    """Show ``sign`` for a while; return which robots were told to move meanwhile, however busy the machine is."""
    before = {name: len(robots.ask("commands", name=name)) for name in NAMES}
    selected = graph.peer.ask("get", topic="/selected_robot")[-1][1][0]
    show(graph, sign)
    if sign == "Forward":
        eventually(lambda: len(robots.ask("commands", name=selected)) > before[selected] + 5, what=selected)
    told = {name: robots.ask("commands", name=name)[before[name] :] for name in NAMES}
    return [name for name in NAMES if any(linear for _, linear, *_ in told[name])]


def test_only_the_selected_robot_moves_and_only_after_stop(fresh: DdsGraph, tmp_path: Path) -> None:
    robots = start(fresh, tmp_path)
    for name in ("r1", "r2", "r3"):
        show(fresh, "Stop", count=2)
        assert moved_by(fresh, robots, "Forward") == [name]
        select(fresh, "next")
        eventually(partial(_is_told_zero, robots, name), what=f"{name} to be told zero")
        assert moved_by(fresh, robots, "Forward") == []
        assert [linear for _, linear, *_ in robots.ask("commands", name=name)[-3:]] == [0.0, 0.0, 0.0]
    names = [name for _, (name,) in fresh.peer.ask("get", topic="/selected_robot")]
    assert names == ["r1", "r2", "r3", "r1", "r2", "r3", "r1"]


def test_a_sign_selects_the_next_robot(fresh: DdsGraph, tmp_path: Path) -> None:
    robots = start(
        fresh, tmp_path, "-p", "actions.Peace:=next_robot", "-p", "cmd_vel_type:=twist_stamped", stamped=True
    )
    show(fresh, "Stop", count=1)
    assert moved_by(fresh, robots, "Forward") == ["r1"]
    show(fresh, "Peace")
    eventually(lambda: fresh.peer.ask("get", topic="/selected_robot")[-1][1] == ["r2"])
    eventually(lambda: robots.ask("commands", name="r1")[-1][1] == 0.0)
    assert moved_by(fresh, robots, "Forward") == []
    show(fresh, "Stop", count=1)
    assert moved_by(fresh, robots, "Forward") == ["r2"]


def test_robots_that_are_no_names_are_refused(fresh: DdsGraph) -> None:
    process = fresh.handsteer("control", "--transport", "dds", "--ros-args", "-p", "robots:=[r1, r1]")
    assert process.code() == 2
    assert "ROS parameter /hand_sign_control/robots: " in process.text
    assert "should name each robot once" in process.text


def test_several_robots_are_simulated_each_in_its_namespace(fresh: DdsGraph) -> None:
    robots = fresh.handsteer("robots", "3", "--transport", "dds", "--world", "empty")
    eventually(lambda: {"/r1/robot", "/r2/robot", "/r3/robot"} <= set(fresh.nodes()) or not robots.running)
    assert robots.running, robots.text
    fresh.peer.ask("record", topic=f"/r2/{CMD_VEL[:-7]}odom", type="Odometry", fields=["twist.twist.linear.x"])
    fresh.peer.ask("advertise", topic=f"/r2/{CMD_VEL}", type="Twist")
    eventually(lambda: fresh.peer.ask("listeners", topic=f"/r2/{CMD_VEL}"))
    fresh.peer.ask("publish", topic=f"/r2/{CMD_VEL}", values={"linear.x": 0.3}, count=30, period_s=0.05)
    speeds = [speed for _, (speed,) in fresh.peer.ask("get", topic=f"/r2/{CMD_VEL[:-7]}odom")]
    assert max(speeds) == pytest.approx(0.3, abs=0.05)
    robots.signal(signal.SIGTERM)
    assert robots.code() == 0
    assert "Traceback" not in robots.text
