"""Our nodes as processes in a Zenoh network, seen by a plain Zenoh program that speaks rmw_zenoh's format by hand."""

import signal
import struct
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from tests.contracts.command_type_contract import CommandTypeContract, MakeRobot, Robot
from tests.contracts.node_contract import (
    CMD_VEL,
    LIMIT_S,
    ODOM,
    RUN,
    ChainContract,
    MakeDriver,
    Running,
    expect_a_run_to_drive,
)
from tests.contracts.ros2_node_contract import NODE, DdsDriver, PeerGraph, Ros2NodeContract, driving_chain
from tests.processes import eventually
from tests.rmw_zenoh.graph import DOMAIN, ZenohGraph

pytest.importorskip("zenoh")
pytestmark = pytest.mark.slow

TWIST = [
    "geometry_msgs::msg::dds_::Twist_",
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
]
STRING = [
    "std_msgs::msg::dds_::String_",
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
]
RELIABLE_10, LATCHED_1 = "::,10:,:,:,,", ":1:,1:,:,:,,"


@pytest.fixture(scope="module")
def zenoh_network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ZenohGraph]:
    with ZenohGraph(tmp_path_factory.mktemp("zenoh")) as graph:
        yield graph


@pytest.fixture
def network(zenoh_network: ZenohGraph) -> Iterator[ZenohGraph]:
    with zenoh_network.test():
        yield zenoh_network


class ZenohDriver(DdsDriver):
    def interfere(self) -> None:
        self._peer.ask("introduce", name="intruder", topic=self.cmd_vel, type="Twist", kind="MP")


class TestNodes(Ros2NodeContract):
    @pytest.fixture
    def graph(self, network: ZenohGraph) -> ZenohGraph:
        return network

    @pytest.fixture
    def drive(self, graph: PeerGraph) -> MakeDriver:
        return partial(ZenohDriver, graph)


class TestCommandType(CommandTypeContract):
    @pytest.fixture
    def graph(self, tmp_path: Path) -> Iterator[ZenohGraph]:
        with ZenohGraph(tmp_path) as graph:
            yield graph

    @pytest.fixture
    def make_robot(self, graph: ZenohGraph) -> MakeRobot:
        return lambda kind: Robot(graph.start_peer(), kind, introduce=True)


class TestChain(ChainContract):
    @pytest.fixture(scope="class")
    @classmethod
    def chain(cls, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
        with ZenohGraph(tmp_path_factory.mktemp("chain")) as graph:
            yield driving_chain(graph)


def test_a_run_drives_a_robot_of_the_network(network: ZenohGraph) -> None:
    odom = f"/real{ODOM}"
    network.peer.ask("record", topic=odom, type="Odometry", fields=["twist.twist.linear.x", "pose.pose.position.x"])
    network.node("robot", name="/real/robot", ros=("-r", "__ns:=/real"))
    words = ("--ros-args", "-r", f"cmd_vel:=/real{CMD_VEL}", "-r", f"odom:={odom}")
    expect_a_run_to_drive(network.handsteer("run", *RUN, "--robot", "zenoh", *words), network.peer, odom)


def test_signs_that_were_held_up_on_their_way_are_not_obeyed(network: ZenohGraph) -> None:
    driver = DdsDriver(network, "--control.sign-timeout", "5")
    driver.show("Forward", count=2)
    driver.expect((0.01, 0.0), (0.02, 0.0))
    old = {"topic": driver.signs, "values": {"data": "Forward"}, "age_s": 0.6}
    network.peer.ask("publish", count=5, **old)
    driver.show("Turn Left")
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.02, 0.1))
    assert f"{driver.signs}: messages come over 0.35 s late and are not obeyed" in driver.process.text


def test_a_stop_that_was_held_up_on_its_way_is_obeyed(network: ZenohGraph) -> None:
    driver = DdsDriver(network, "--control.sign-timeout", "5")
    driver.show("Forward", count=2)
    network.peer.ask("publish", topic=driver.signs, values={"data": "Stop"}, age_s=0.6)
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))


def test_ros2_sees_the_node_by_its_names_types_hashes_and_profiles(network: ZenohGraph) -> None:
    words = ("-r", "__ns:=/far", "-r", "__node:=driver", "-r", f"{CMD_VEL[1:]}:=/base/cmd_vel")
    control = network.node("control", name="/far/driver", ros=words)
    eventually(lambda: len(network.nodes()["/far/driver"]["MS"]) == 5)
    eventually(lambda: len(network.nodes()["/far/driver"]["MP"]) >= 2)
    node = network.nodes()["/far/driver"]
    assert node["alive"]
    assert node["MP"]["/base/cmd_vel"][:3] == [*TWIST, RELIABLE_10]
    assert {"/base/cmd_vel", "/diagnostics"} <= set(node["MP"])
    assert node["MS"]["/far/gesture/hand_sign"][:3] == [*STRING, RELIABLE_10]
    assert node["MS"]["/far/steering/cmd_vel"][:3] == [*TWIST, RELIABLE_10]
    token = node["MP"]["/base/cmd_vel"][3].split("/")
    assert token[:2] == ["@ros2_lv", str(DOMAIN)]
    assert token[3] == "0"  # the node's own number
    assert token[5:10] == ["MP", "%", "%far", "driver", "%base%cmd_vel"]
    eventually(lambda: "is ready" in control.text)
    control.signal(signal.SIGTERM)
    assert control.code() == 0
    eventually(lambda: "/far/driver" not in network.nodes(), what="the node to be gone")


def test_every_message_comes_with_rmw_zenohs_attachment(network: ZenohGraph) -> None:
    driver = DdsDriver(network)
    driver.show("Forward", count=3)
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0))
    raw = [bytes.fromhex(one) for one in network.peer.ask("attachments", topic=driver.cmd_vel)]
    assert {len(one) for one in raw} == {33}
    assert [struct.unpack_from("<q", one)[0] for one in raw[:3]] == [1, 2, 3]
    assert abs(struct.unpack_from("<q", raw[0], 8)[0] / 1e9 - time.time()) < 60
    assert {one[16] for one in raw} == {16}
    assert len({one[17:] for one in raw}) == 1


def test_ros2_param_gets_and_sets_the_parameters_of_a_running_node(network: ZenohGraph) -> None:
    driver = DdsDriver(network)
    node = driver.cmd_vel.removesuffix(CMD_VEL) + f"/{NODE}"
    header = bytes.fromhex("00010000")
    name = struct.pack("<I", 12) + b"linear_step\0"
    eventually(lambda: len(network.nodes()[node]["SS"]) == 6)
    assert network.nodes()[node]["SS"][f"{node}/get_parameters"][2] == "::,1000:,:,:,,"

    def linear_step() -> float:
        request = (header + struct.pack("<I", 1) + name).hex()
        [[reply, attachment]] = network.peer.ask("call", node=node, service="get_parameters", hex=request, number=5)
        assert bytes.fromhex(attachment)[:8] == struct.pack("<q", 5)  # the request's own number and sender
        assert bytes.fromhex(attachment)[16:] == bytes([16, *range(16)])
        count, kind, value = struct.unpack_from("<IB11xd", bytes.fromhex(reply), 4)
        assert (count, kind) == (1, 3)
        return float(value)

    assert linear_step() == 0.01
    double = struct.pack("<BB2xqd", 3, 0, 0, 0.03)
    no_text, no_arrays = struct.pack("<I4x", 1), bytes(5 * 4)
    request = (header + struct.pack("<I", 1) + name + double + no_text + no_arrays).hex()
    [[reply, _]] = network.peer.ask("call", node=node, service="set_parameters", hex=request)
    assert struct.unpack_from("<IB", bytes.fromhex(reply), 4) == (1, 1), bytes.fromhex(reply)
    assert linear_step() == 0.03
    driver.show("Forward")
    driver.expect((0.03, 0.0))
    for nonsense in ("", "00010000ffffffff"):
        assert network.peer.ask("call", node=node, service="set_parameters", hex=nonsense) == []
    assert "cannot be answered" in driver.process.text
    assert linear_step() == 0.03


def test_the_description_of_the_robot_is_kept_for_late_subscribers(network: ZenohGraph) -> None:
    network.node("robot", name="/kept/robot", ros=("-r", "__ns:=/kept"))
    topic = "/kept/robot_description"
    eventually(lambda: network.publishes("/kept/robot", topic))
    assert network.nodes()["/kept/robot"]["MP"][topic][:3] == [*STRING, LATCHED_1]


def test_types_that_differ_are_said_in_words(tmp_path: Path) -> None:
    with ZenohGraph(tmp_path) as graph:
        graph.peer.ask("introduce", name="talker", topic="/gesture/hand_sign", type="Twist", kind="MP")
        control = graph.node("control", name=f"/{NODE}")
        line = (
            "/gesture/hand_sign: nothing passes between our subscriber and the publisher of /talker: "
            "ours has the type std_msgs/msg/String, theirs geometry_msgs/msg/Twist"
        )
        eventually(lambda: line in control.text, 10.0, what=line)
        graph.peer.ask("introduce", name="base", topic=CMD_VEL, type="String", kind="MS")
        line = f"{CMD_VEL}: nothing passes between our publisher and the subscriber of /base: "
        eventually(lambda: line in control.text, 10.0, what=line)


def test_of_many_types_that_differ_some_are_named(tmp_path: Path) -> None:
    with ZenohGraph(tmp_path) as graph:
        for number in range(40):
            graph.peer.ask("introduce", name=f"talker{number}", topic="/gesture/hand_sign", type="Twist", kind="MP")
        control = graph.node("control", name=f"/{NODE}")
        eventually(lambda: "there are more of these" in control.text, 10.0, what="the end of the list")
        graph.peer.ask("introduce", name="base", topic=CMD_VEL, type="String", kind="MS")
        eventually(lambda: "the subscriber of /base" in control.text, 10.0, what="a line for the other topic")
        assert control.text.count("the publisher of /talker") == 5


def test_nodes_of_other_domains_are_not_seen(network: ZenohGraph) -> None:
    other = network.handsteer("control", "--transport", "zenoh", "--ros-args", "-r", "__ns:=/other", ROS_DOMAIN_ID="8")
    network.node("control", name="/same/hand_sign_control", ros=("-r", "__ns:=/same"))
    time.sleep(1.0)
    assert other.running
    assert "/other/hand_sign_control" not in network.nodes()


@pytest.mark.exhaustive
class TestRouter:
    def test_without_one_it_says_so_and_joins_when_it_comes(self, tmp_path: Path) -> None:
        with ZenohGraph(tmp_path) as graph:
            graph.router.kill()
            control = graph.handsteer("control", "--transport", "zenoh")
            eventually(lambda: "no Zenoh router answers: until there is one, no other node is found" in control.text)
            assert f"(looked at {graph.endpoint}); start one with handsteer zenoh-router" in control.text
            time.sleep(0.5)
            assert graph.nodes() == {}
            graph.start_router()
            eventually(lambda: f"/{NODE}" in graph.nodes())
            eventually(lambda: "the Zenoh router is there" in control.text)

    def test_it_can_be_waited_for(self, tmp_path: Path) -> None:
        with ZenohGraph(tmp_path) as graph:
            graph.router.kill()
            control = graph.handsteer("control", "--transport", "zenoh", ZENOH_ROUTER_CHECK_ATTEMPTS="0")
            eventually(lambda: "no Zenoh router answers: it waits for one" in control.text)
            graph.start_router()
            eventually(lambda: "/gesture/hand_sign" in graph.nodes().get(f"/{NODE}", {}).get("MS", {}))
            eventually(lambda: "is ready" in control.text)
            control.signal(signal.SIGTERM)
            assert control.code() == 0

    def test_a_second_one_at_the_same_place_is_refused(self, network: ZenohGraph) -> None:
        second = network.handsteer("zenoh-router", "--listen", network.endpoint)
        assert second.code() == 2
        assert f"no Zenoh router can be started at {network.endpoint}: is there one already" in second.text

    def test_where_processes_connect_directly_the_drive_goes_on_without_it(self, tmp_path: Path) -> None:
        with ZenohGraph(tmp_path) as graph:
            running = driving_chain(graph).revive().expect_full_speed()
            graph.router.popen.kill()
            eventually(lambda: "the Zenoh router has gone" in running.nodes["control"].text, 10.0)
            began_m = running.x_m
            # A busy machine may make it stop meanwhile, but without the messages it would never go on.
            eventually(lambda: running.x_m - began_m > 0.3, 20.0, what="the robot to drive on")
            graph.start_router()
            eventually(lambda: "the Zenoh router is there" in running.nodes["control"].text)

    def test_what_waited_in_a_router_that_stood_still_is_not_obeyed(self, tmp_path: Path) -> None:
        with ZenohGraph(tmp_path, mode="client") as graph:
            driver = DdsDriver(graph)
            driver.show("Forward", count=3)
            driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.0, 0.0))
            graph.router.freeze()
            driver.show("Forward", count=30, period_s=0.033)
            time.sleep(0.5)  # longer than signs live
            graph.router.signal(signal.SIGCONT)
            eventually(lambda: "late and are not obeyed" in driver.process.text, 10.0)
            driver.show("Turn Left")
            driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.0, 0.0), (0.0, 0.1))

    def test_where_all_goes_by_it_the_robot_stops_and_goes_on_with_fresh_signs(self, tmp_path: Path) -> None:
        with ZenohGraph(tmp_path, mode="client") as graph:
            running = driving_chain(graph).revive().expect_full_speed()
            graph.router.popen.kill()
            killed_s = time.monotonic()
            time.sleep(LIMIT_S + 1.0)
            before = len(running.speeds)
            back_s = time.monotonic()
            graph.start_router()
            eventually(lambda: len(running.speeds) > before, what="the odometry to come again")
            # What the robot did meanwhile cannot be seen but by where it is: at 0.3 m/s it has not gone on.
            seen = [(at_s, speed, x) for at_s, (speed, x) in graph.peer.ask("get", topic=ODOM)]
            last = max(x for at_s, _, x in seen if at_s <= killed_s)
            first_speed, first_x = next((speed, x) for at_s, speed, x in seen if at_s > back_s)
            assert abs(first_speed) < 0.3
            assert first_x - last < 0.3 * (LIMIT_S + 0.4)
            running.expect_full_speed()


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({"ZENOH_ROUTER_CHECK_ATTEMPTS": "x"}, "ZENOH_ROUTER_CHECK_ATTEMPTS is 'x': it should be a whole number"),
        (
            {"ZENOH_SESSION_CONFIG_URI": "/none"},
            "ZENOH_SESSION_CONFIG_URI is '/none': it is not a valid configuration of Zenoh",
        ),
        ({"ZENOH_CONFIG_OVERRIDE": "mode"}, "ZENOH_CONFIG_OVERRIDE has 'mode': it should be as mode="),
        (
            {"ZENOH_CONFIG_OVERRIDE": 'mode="x"'},
            'ZENOH_CONFIG_OVERRIDE has mode="x": that is not a valid setting of Zenoh',
        ),
        ({"ROS_DOMAIN_ID": "233"}, "ROS_DOMAIN_ID is '233': it should be a whole number from 0 to 232"),
        (
            {"ZENOH_CONFIG_OVERRIDE": 'mode="client";connect/endpoints=["tcp/127.0.0.1:1"]'},
            "cannot join Zenoh as /hand_sign_control: looked for a router at tcp/127.0.0.1:1",
        ),
    ],
    ids=lambda value: " ".join(value.values()) if isinstance(value, dict) else None,
)
def test_what_is_wrong_is_said_in_one_line(network: ZenohGraph, env: dict[str, str], message: str) -> None:
    process = network.handsteer("control", "--transport", "zenoh", **env)
    assert process.code() == 2, process.text
    assert [line for line in process.text.splitlines() if line.startswith(f"handsteer: {message}")], process.text
    assert "Traceback" not in process.text
