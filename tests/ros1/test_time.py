"""Simulated time, as ``/use_sim_time`` and ``/clock`` have it."""

import signal
from collections.abc import Iterator
from typing import Any

import pytest

from tests.processes import Peer, eventually
from tests.ros1.graph import Ros1Graph, ros1_graph

pytestmark = [pytest.mark.ros1, pytest.mark.slow]

ODOM = "/robot_diff_drive_controller/odom"
CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
START_S = 1000.0


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros1Graph]:
    with ros1_graph(tmp_path_factory.mktemp("ros")) as graph:
        graph.set_parameter("/use_sim_time", value=True)
        yield graph


@pytest.fixture
def peer(simulated: Ros1Graph) -> Iterator[Peer]:
    peer = simulated.peer()
    peer.ask("advertise", topic="/clock", package="rosgraph_msgs", type="Clock")
    peer.ask("record", topic=ODOM, package="nav_msgs", type="Odometry", fields=["header.stamp", "twist.twist.linear.x"])
    peer.ask("record", topic=CMD_VEL, package="geometry_msgs", type="Twist", fields=["linear.x"])
    peer.ask("advertise", topic="/gesture/hand_sign", package="std_msgs", type="String")
    yield peer
    peer.kill()


def stamps(peer: Peer) -> list[tuple[float, float]]:
    return [(at_s, stamp_s) for at_s, (stamp_s, _) in peer.ask("get", topic=ODOM)]


def speed(peer: Peer) -> float:
    return float(peer.ask("get", topic=ODOM)[-1][1][1])


def clock_heard(graph: Ros1Graph, name: str) -> None:
    eventually(lambda: name in graph.listeners("/clock"))


def test_nodes_follow_the_clock_and_stop_the_robot_when_it_stands(simulated: Ros1Graph, peer: Peer) -> None:
    robot = simulated.node("robot", name="/robot")
    control = simulated.node("control", "--control.linear-step", "0.3", name="/hand_sign_control")
    eventually(lambda: stamps(peer))
    assert stamps(peer)[-1][1] == 0.0  # nobody has told the time yet
    peer.ask("run_clock", from_s=START_S, rate=2.0)
    eventually(lambda: stamps(peer)[-1][1] > START_S + 4.0)
    moving = [row for row in stamps(peer) if row[1] > START_S]
    first, last = moving[0], moving[-1]
    assert (last[1] - first[1]) / (last[0] - first[0]) == pytest.approx(2.0, rel=0.2)
    # Before the clock was heard, no time passed: the robot was as silent as one that is away.
    peer.ask("publish", topic="/gesture/hand_sign", values={"data": "Stop"}, count=3, period_s=0.02)
    show = {"topic": "/gesture/hand_sign", "values": {"data": "Forward"}, "period_s": 0.02}
    peer.ask("publish", count=100, **show)
    assert max(values[1] for _, values in peer.ask("get", topic=ODOM)) > 0.1
    # The clock stands when signs still come; a moment later there are no signs either.
    peer.ask("stop_clock")
    peer.ask("publish", count=20, **show)
    assert max(values[0] for _, values in peer.ask("get", topic=CMD_VEL)) > 0.0
    eventually(lambda: peer.ask("get", topic=CMD_VEL)[-1][1] == [0.0], 5.0, what="zero velocity")
    eventually(lambda: abs(speed(peer)) < 0.01, 10.0, what="the robot to stand")
    eventually(lambda: "/clock stands still" in control.text, 10.0)
    for process in (robot, control):
        process.signal(signal.SIGTERM)
        assert process.code() == 0


def test_frames_are_old_when_the_clock_stands(simulated: Ros1Graph, peer: Peer) -> None:
    peer.ask("record", topic="/gesture/hand_sign", package="std_msgs", type="String", fields=["data"])
    options = ["--camera", "virtual", "--camera.width", "320", "--camera.height", "240"]
    simulated.node("camera", *options, "_virtual_hand/script:=Forward:60", name="/my_camera")
    simulated.node("recognition", name="/hand_sign_recognition")
    clock_heard(simulated, "/hand_sign_recognition")
    peer.ask("run_clock", from_s=START_S, rate=1.0)

    def signs() -> list[Any]:
        return [values[0] for _, values in peer.ask("get", topic="/gesture/hand_sign")]

    eventually(lambda: "Forward" in signs())
    peer.ask("stop_clock")
    eventually(lambda: set(signs()[-5:]) == {"NONE"}, what="frames to grow old")


def test_what_is_no_time_is_ignored(simulated: Ros1Graph, peer: Peer) -> None:
    robot = simulated.node("robot", name="/robot")
    clock_heard(simulated, "/robot")
    eventually(lambda: stamps(peer) and peer.ask("listeners", topic="/clock") > 0)
    for _ in range(5):
        peer.ask("publish_raw", topic="/clock", raw="ff" * 8)
        peer.ask("publish_raw", topic="/clock", raw="ffffff7fffffffff")
    peer.ask("run_clock", from_s=START_S, rate=1.0)
    eventually(lambda: START_S < stamps(peer)[-1][1] < START_S + 60.0)
    assert robot.text.count("/clock: a message with ") == 1
    assert "Traceback" not in robot.text
    peer.ask("stop_clock")
    robot.signal(signal.SIGTERM)
    assert robot.code() == 0


def test_a_robot_may_tell_the_time_and_does_not_follow_itself(simulated: Ros1Graph, peer: Peer) -> None:
    peer.ask("record", topic="/clock", package="rosgraph_msgs", type="Clock", fields=["clock"])
    robot = simulated.node("robot", "_publish_clock:=true", name="/robot")
    eventually(lambda: len(peer.ask("get", topic="/clock")) > 100)
    told = peer.ask("get", topic="/clock")
    assert (told[-1][1][0] - told[0][1][0]) / (told[-1][0] - told[0][0]) == pytest.approx(1.0, rel=0.1)
    robot.signal(signal.SIGTERM)
    assert robot.code() == 0
    simulated.master.deleteParam("/test", "/robot")


def test_without_being_asked_the_robot_does_not_tell_the_time(ros1: Ros1Graph) -> None:
    ros1.node("robot", name="/robot")
    assert ros1.talkers("/clock") == []
