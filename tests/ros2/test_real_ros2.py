"""Our nodes among those of a real ROS 2, rclpy on Fast DDS: as nodes of rclpy themselves, and over Cyclone DDS.

With test_rclpy.py and test_parameters.py these are the rows of the table in docs/ros2.md.
"""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.contracts.command_type_contract import CommandTypeContract, MakeRobot, Robot
from tests.contracts.node_contract import (
    CMD_VEL,
    ODOM,
    VIRTUAL,
    ChainContract,
    Running,
)
from tests.contracts.ros2_node_contract import NODE, SCRIPT, DdsDriver, Ros2NodeContract, driving_chain
from tests.processes import eventually
from tests.ros2.graph import NEEDS_ROS2, TRANSPORTS, Ros2Graph, needs_tf2_msgs

pytest.importorskip("cyclonedds")
pytestmark = NEEDS_ROS2


@pytest.fixture(scope="module", params=TRANSPORTS)
def ros2_domain(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros2Graph]:
    with Ros2Graph(tmp_path_factory.mktemp("ros2"), request.param) as graph:
        yield graph


@pytest.fixture
def dds(tmp_path: Path) -> Iterator[Ros2Graph]:
    with Ros2Graph(tmp_path) as graph:
        yield graph


class TestNodes(Ros2NodeContract):
    images = ("image_raw/compressed", "CompressedImage")  # Fast DDS loses raw ones

    @pytest.fixture
    def graph(self, ros2: Ros2Graph) -> Ros2Graph:
        return ros2


class TestCommandType(CommandTypeContract):
    @pytest.fixture
    def graph(self, fresh: Ros2Graph) -> Ros2Graph:
        return fresh

    @pytest.fixture
    def make_robot(self, graph: Ros2Graph) -> MakeRobot:
        return lambda kind: Robot(graph.start_peer(), kind)


class TestChain(ChainContract):
    @pytest.fixture(scope="class", params=TRANSPORTS)
    @classmethod
    def chain(cls, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
        with Ros2Graph(tmp_path_factory.mktemp("chain"), request.param) as graph:
            yield driving_chain(graph)


def test_ros2_lists_the_node_its_topics_types_hashes_and_profiles(ros2: Ros2Graph) -> None:
    words = ("-r", "__ns:=/far", "-r", "__node:=driver", "-r", f"{CMD_VEL[1:]}:=/base/cmd_vel")
    control = ros2.node("control", name="/far/driver", ros=words)
    eventually(lambda: len(ros2.nodes()["/far/driver"]["subscribes"]) == 5)
    assert ros2.nodes()["/far/driver"]["subscribes"] == {
        "/far/gesture/hand_sign": ["std_msgs/msg/String"],
        "/far/robot_diff_drive_controller/odom": ["nav_msgs/msg/Odometry"],
        "/far/steering/cmd_vel": ["geometry_msgs/msg/Twist"],
        "/far/stop": ["std_msgs/msg/Bool"],
        "/far/stopped": ["std_msgs/msg/Bool"],
    }
    publishes = ros2.nodes()["/far/driver"]["publishes"]
    assert publishes["/base/cmd_vel"] == ["geometry_msgs/msg/Twist"]
    assert publishes["/diagnostics"] == ["diagnostic_msgs/msg/DiagnosticArray"]
    assert ros2.peer.ask("topics")["/base/cmd_vel"] == ["geometry_msgs/msg/Twist"]
    assert ros2.peer.ask("endpoints", topic="/base/cmd_vel") == [
        {
            "kind": "publisher",
            "node": "/far/driver",
            "type": "geometry_msgs/msg/Twist",
            "hash": "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
            "reliability": "RELIABLE",
            "durability": "VOLATILE",
        }
    ]
    eventually(lambda: "is ready" in control.text)
    control.signal(signal.SIGTERM)
    assert control.code() == 0
    eventually(lambda: "/far/driver" not in ros2.nodes(), what="the node to be gone for ROS 2 too")


def test_every_type_of_the_graph_has_ros2s_own_hash(ros2: Ros2Graph) -> None:
    """ROS 2 tells the hashes of its own publishers, too."""
    ours = {"/image_raw": "Image", ODOM: "Odometry", "/robot_description": "String", CMD_VEL: "Twist"}
    ours |= {"/image_raw/compressed": "CompressedImage", "/clock": "Clock"}
    ros2.node("camera", *VIRTUAL, name="/hashed/my_camera", ros=("-r", "__ns:=/hashed"))
    ros2.node("robot", name="/hashed/robot", ros=("-r", "__ns:=/hashed", "-p", "publish_clock:=true"))
    for topic, kind in ours.items():
        here = topic if topic == "/clock" else f"/hashed{topic}"
        ros2.peer.ask("advertise", topic=here, type=kind)
        eventually(lambda: len({end["node"] for end in ros2.peer.ask("endpoints", topic=here)}) >= 2, what=here)  # noqa: B023
        assert len({(end["type"], end["hash"]) for end in ros2.peer.ask("endpoints", topic=here)}) == 1, here


@needs_tf2_msgs
def test_rclpy_gets_the_frames_of_a_robot_that_drives_as_its_odometry_says(fresh: Ros2Graph) -> None:
    peer = fresh.peer
    ends = ["header.stamp", "header.frame_id", "child_frame_id"]
    place = [["translation.x", "position.x"], ["translation.y", "position.y"]]
    place += [[f"rotation.{axis}", f"orientation.{axis}"] for axis in "xyzw"]
    in_frame = [f"transforms.0.{field}" for field in [*ends, *(f"transform.{name}" for name, _ in place)]]
    in_pose = [*ends, *(f"pose.pose.{name}" for _, name in place)]
    peer.ask("record", topic="/tf", type="TFMessage", fields=[*in_frame, "transforms"])
    peer.ask("record", topic=ODOM, type="Odometry", fields=in_pose)
    peer.ask("advertise", topic=CMD_VEL, type="Twist")
    fresh.node("robot", "--world", "empty", name="/robot")
    eventually(lambda: peer.ask("listeners", topic=CMD_VEL) > 0)

    def has_driven() -> bool:
        peer.ask("publish", topic=CMD_VEL, values={"linear.x": 0.3, "angular.z": 0.5}, count=10, period_s=0.05)
        frames = peer.ask("get", topic="/tf")
        return bool(frames and frames[-1][1][3] > 0.2)

    eventually(has_driven, what="the frame of the robot to move")
    frames = {stamp: values for _, (stamp, *values, count) in peer.ask("get", topic="/tf") if count == 1}
    poses = {stamp: values for _, (stamp, *values) in peer.ask("get", topic=ODOM)}
    both = sorted(frames.keys() & poses.keys())
    assert len(both) > 10
    assert [frames[stamp] for stamp in both] == [poses[stamp] for stamp in both]
    assert {tuple(values[:2]) for values in frames.values()} == {("odom", "base_link")}
    described = [end for end in peer.ask("endpoints", topic="/tf") if end["kind"] == "publisher"]
    assert described == [
        {
            "kind": "publisher",
            "node": "/robot",
            "type": "tf2_msgs/msg/TFMessage",
            "hash": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
            "reliability": "RELIABLE",
            "durability": "VOLATILE",
        }
    ]


def test_pictures_of_a_ros2_camera_are_recognised(ros2: Ros2Graph) -> None:
    """The virtual hand's pictures go through rclpy, which makes them those of a ROS 2 camera."""
    peer = ros2.peer
    details = {"type": "CompressedImage", "reliable": False, "depth": 1}
    peer.ask("shift", **{"from": "/eye/image_raw/compressed", "to": "/brain/image_raw/compressed"}, **details)
    peer.ask("record", topic="/brain/gesture/hand_sign", type="String", fields=["data"])
    compressed = ("-p", "image_transport:=compressed")
    ros2.node("recognition", name="/brain/hand_sign_recognition", ros=("-r", "__ns:=/brain", *compressed))
    ros2.node("camera", *VIRTUAL, name="/eye/my_camera", ros=("-r", "__ns:=/eye", *SCRIPT))
    eventually(lambda: ["Forward"] in [values for _, values in peer.ask("get", topic="/brain/gesture/hand_sign")])


@pytest.mark.parametrize("reliable", [False, True])
def test_compressed_pictures_reach_rclpy(ros2: Ros2Graph, reliable: bool) -> None:
    """``benchmarks/ros2.py`` counts how many."""
    peer = ros2.peer
    place = f"film_{reliable}".lower()
    topic = f"/{place}/image_raw/compressed"
    wanted = {"fields": ["header.stamp", "data"], "reliable": reliable, "depth": 10}
    peer.ask("record", topic=topic, type="CompressedImage", **wanted)
    ros2.node("camera", "--camera", "virtual", name=f"/{place}/my_camera", ros=("-r", f"__ns:=/{place}", *SCRIPT))
    pictures = eventually(lambda: len(found := peer.ask("get", topic=topic)) >= 60 and found)
    stamps = [stamp for _, (stamp, _) in pictures]
    assert stamps == sorted(set(stamps))
    assert all(1000 < size < 200_000 for _, (_, size) in pictures)


def test_raw_pictures_reach_an_rclpy_that_wants_them_reliable(ros2: Ros2Graph) -> None:
    ros2.peer.ask("record", topic="/sure/image_raw", type="Image", fields=["data"], depth=10)
    ros2.node("camera", *VIRTUAL, name="/sure/my_camera", ros=("-r", "__ns:=/sure", *SCRIPT))
    pictures = eventually(lambda: len(found := ros2.peer.ask("get", topic="/sure/image_raw")) >= 30 and found)
    assert {size for _, (size,) in pictures} == {320 * 240 * 3}


def test_raw_images_for_fast_dds_are_warned_of(dds: Ros2Graph) -> None:
    dds.peer.ask("record", topic="/raw/image_raw", type="Image", fields=["width"], reliable=False, depth=1)
    camera = dds.node("camera", *VIRTUAL, name="/raw/my_camera", ros=("-r", "__ns:=/raw"))
    line = "/raw/image_raw: /looker takes raw images"
    eventually(lambda: line in camera.text, what=line)


def test_what_a_node_logs_is_on_rosout(dds: Ros2Graph) -> None:
    """The log is latched: what was said before anybody listened is told, too."""
    dds.peer.ask("record", topic="/told/image_raw", type="Image", fields=["width"], depth=1, latched=True)
    camera = dds.node("camera", *VIRTUAL, name="/told/my_camera", ros=("-r", "__ns:=/told"))
    eventually(lambda: "nothing passes" in camera.text)
    dds.peer.ask("record", topic="/rosout", type="Log", fields=["level", "name", "msg"], latched=True)
    said = ("told.my_camera", 30)
    logged = eventually(lambda: [one for _, one in dds.peer.ask("get", topic="/rosout") if (one[1], one[0]) == said])
    assert logged[0][2].startswith("/told/image_raw: nothing passes")


def test_profiles_that_do_not_fit_are_said_in_words(fresh: Ros2Graph) -> None:
    fresh.peer.ask("record", topic="/image_raw", type="Image", fields=["width"], depth=5, latched=True)
    camera = fresh.node("camera", *VIRTUAL, name="/my_camera")
    line = (
        "/image_raw: nothing passes between our publisher and the subscriber of /looker: "
        "the publisher is volatile, the subscriber wants transient local"
    )
    eventually(lambda: line in camera.text, 30.0, what=line)
    time.sleep(0.2)
    assert fresh.peer.ask("get", topic="/image_raw") == []


def test_a_robot_that_cannot_hear_its_commands_is_named(fresh: Ros2Graph) -> None:
    fresh.peer.ask("record", topic="/cmd_vel", type="TwistStamped", fields=["twist.linear.x"], latched=True)
    control = fresh.node("control", name=f"/{NODE}", ros=("-r", f"{CMD_VEL[1:]}:=/cmd_vel"))
    line = (
        "/cmd_vel: nothing passes between our publisher and the subscriber of /looker: "
        "the publisher is volatile, the subscriber wants transient local"
    )
    eventually(lambda: line in control.text, 30.0, what=line)
    assert control.text.count("nothing passes") == 1


def test_a_stop_that_is_published_best_effort_stops_once(fresh: Ros2Graph) -> None:
    driver = DdsDriver(fresh, parameters={"sign_timeout": 5.0})
    stop = driver.signs.replace("gesture/hand_sign", "stop")
    fresh.peer.ask("advertise", topic=stop, type="Bool", reliable=False)
    eventually(lambda: fresh.peer.ask("listeners", topic=stop) > 0, what="the control to listen")
    driver.show("Forward")
    driver.expect((0.01, 0.0))
    fresh.peer.ask("publish", topic=stop, values={"data": True}, count=20, period_s=0.1)
    driver.show("Forward")
    eventually(lambda: driver.twists[-1] == (0.0, 0.0), what="the robot to be stopped")
    assert "nothing passes" not in driver.process.text


def test_a_stop_that_is_published_reliably_comes_once(fresh: Ros2Graph) -> None:
    driver = DdsDriver(fresh, parameters={"sign_timeout": 5.0})
    stop = driver.signs.replace("gesture/hand_sign", "stop")
    fresh.peer.ask("advertise", topic=stop, type="Bool")
    eventually(lambda: fresh.peer.ask("listeners", topic=stop) >= 2, what="the control to listen twice")
    driver.show("Forward")
    driver.expect((0.01, 0.0))
    fresh.peer.ask("publish", topic=stop, values={"data": True})
    eventually(lambda: driver.twists[-1] == (0.0, 0.0), what="the robot to be stopped")
    time.sleep(0.5)
    driver.expect((0.01, 0.0), (0.0, 0.0))


def test_a_node_of_ros2_that_is_killed_is_no_harm(fresh: Ros2Graph) -> None:
    control = fresh.node("control", name=f"/{NODE}")
    fresh.peer.kill()
    time.sleep(0.5)
    assert control.running
    assert "Traceback" not in control.text
