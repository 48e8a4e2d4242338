"""Our nodes as processes in a DDS domain, seen by a plain DDS program with types of its own."""

import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.contracts.node_contract import (
    CMD_VEL,
    ODOM,
    PATIENT,
    VIRTUAL,
    ChainContract,
    Running,
    twists,
)
from tests.contracts.ros2_node_contract import NODE, SETTLE_S, DdsDriver, Ros2NodeContract, driving_chain, record_twists
from tests.dds.graph import DdsGraph
from tests.processes import eventually

pytest.importorskip("cyclonedds")
pytestmark = pytest.mark.slow


class TestNodes(Ros2NodeContract):
    @pytest.fixture
    def graph(self, dds: DdsGraph) -> DdsGraph:
        return dds


def test_parameters_come_from_files_too(dds: DdsGraph, tmp_path: Path) -> None:
    file = tmp_path / "ros.yaml"
    file.write_text(f"/**/{NODE}: {{ros__parameters: {{linear_step: 0.02, angular_step: 0.2}}}}\n")
    words = ("-r", "__ns:=/filed", "--params-file", str(file), "-p", "linear_step:=0.03")
    dds.node("control", *PATIENT, "--control.angular-step=0.4", name=f"/filed/{NODE}", ros=words)
    cmd_vel, signs = f"/filed{CMD_VEL}", "/filed/gesture/hand_sign"
    record_twists(dds.peer, cmd_vel)
    dds.peer.ask("advertise", topic=signs, type="String")
    eventually(lambda: dds.peer.ask("listeners", topic=signs) > 0)
    time.sleep(SETTLE_S)
    for sign in ("Forward", "Turn Left"):
        dds.peer.ask("publish", topic=signs, values={"data": sign}, count=1, period_s=0.0)
    eventually(lambda: [twist for _, twist in twists(dds.peer, cmd_vel)][:2] == [(0.03, 0.0), (0.03, 0.4)], 10.0)


def test_ros2_sees_the_node_by_its_names_types_and_hashes(dds: DdsGraph) -> None:
    words = ("-r", "__ns:=/far", "-r", "__node:=driver", "-r", f"{CMD_VEL[1:]}:=/base/cmd_vel")
    control = dds.node("control", name="/far/driver", ros=words)
    twist = [
        "geometry_msgs::msg::dds_::Twist_",
        "typehash=RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a;",
    ]
    string = [
        "std_msgs::msg::dds_::String_",
        "typehash=RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18;",
    ]
    eventually(lambda: "rt/base/cmd_vel" in dds.nodes()["/far/driver"]["writers"])
    eventually(lambda: len(topics(dds.nodes()["/far/driver"]["readers"])) == 5)
    eventually(lambda: len(topics(dds.nodes()["/far/driver"]["writers"])) == 6)
    node = dds.nodes()["/far/driver"]
    assert node["participant"] == "enclave=/;"
    assert node["writers"]["rt/base/cmd_vel"] == twist
    assert topics(node["writers"]) == {
        *("rt/base/cmd_vel", "rt/far/audit", "rt/diagnostics", "rt/far/stopped", "rt/parameter_events", "rt/rosout")
    }
    assert topics(node["readers"]) == {
        *("rt/far/gesture/hand_sign", "rt/far/steering/cmd_vel", "rt/far/stop", "rt/far/stopped"),
        "rt/far/robot_diff_drive_controller/odom",
    }
    assert node["readers"]["rt/far/gesture/hand_sign"] == string
    assert node["readers"]["rt/far/steering/cmd_vel"] == twist
    eventually(lambda: "is ready" in control.text)
    control.signal(signal.SIGTERM)
    assert control.code() == 0


def topics(endpoints: dict[str, Any]) -> set[str]:
    return {name for name in endpoints if name.startswith("rt/")}


def test_what_a_node_logs_is_on_rosout_for_who_comes_later_too(dds: DdsGraph, tmp_path: Path) -> None:
    driver = DdsDriver(dds)
    driver.show_raw(b"\x00\x01\x00\x00\x03\x00\x00\x00\xff\xfe\x00\x00")
    text = "/gesture/hand_sign: a message of 12 bytes cannot be read"
    eventually(lambda: text in driver.process.text)
    dds.peer.ask("record", topic="/rosout", type="Log", fields=["level", "name", "msg"], latched=True)
    logged = eventually(lambda: [one for _, one in dds.peer.ask("get", topic="/rosout") if text in one[2]])
    assert logged[0][0] == 30
    assert logged[0][1].endswith(".hand_sign_control")


def test_the_discovery_itself_carries_the_hash_of_ros2(fresh: DdsGraph) -> None:
    fresh.node("control", name=f"/{NODE}")
    digest = "typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"
    assert fresh.peer.ask("user_data", topic="ros_discovery_info") == {"writers": [digest], "readers": [digest]}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-p", "linear_step:=7"], "ROS parameter /hand_sign_control/linear_step: 7 should be less than or eq"),
        (["-p", "use_sim_time:=7"], "parameter use_sim_time is 7: it should be true or false"),
        (["-r", "__ns:=r1"], "__ns:=r1: a namespace starts with a slash"),
        (["-r"], "-r lacks its value"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_is_wrong_is_said_in_one_line(dds: DdsGraph, words: list[str], message: str) -> None:
    process = dds.handsteer("control", "--transport", "dds", "--ros-args", *words)
    assert process.code() == 2, process.text
    assert [line for line in process.text.splitlines() if line.startswith(f"handsteer: {message}")], process.text
    assert "Traceback" not in process.text


def test_a_file_of_parameters_may_be_shared_with_other_nodes(dds: DdsGraph, tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    shared = "robot_description: <robot/>, linear_stepp: 0.5, linear_step: 0.02, landmarks: {modl: full}"
    file.write_text(f'"/**": {{ros__parameters: {{{shared}}}}}\n')
    driver = DdsDriver(dds, "--ros-args", "--params-file", str(file))
    driver.show("Forward")
    driver.expect((0.02, 0.0))
    text = driver.process.text
    for name in ("robot_description", "linear_stepp", "landmarks/modl"):
        assert len(re.findall(rf"ignoring unknown ROS parameter /\S+/{name}\b", text)) == 1
    assert "did you mean linear_step?" in text


def test_what_does_not_fit_is_said_in_words(fresh: DdsGraph) -> None:
    peer = fresh.peer
    peer.ask("record", topic="/image_raw", type="Image", fields=["width"], depth=5, latched=True)
    peer.ask("advertise", topic="/gesture/hand_sign", type="Twist")
    peer.ask("introduce", name="viewer")
    camera = fresh.node("camera", *VIRTUAL, name="/my_camera")
    control = fresh.node("control", name=f"/{NODE}")
    profile = "the publisher is volatile, the subscriber wants transient local"
    line = f"/image_raw: nothing passes between our publisher and the subscriber of /viewer: {profile}"
    eventually(lambda: line in camera.text, 10.0, what=line)
    assert "(ours: reliable, volatile, keep last 3; theirs: reliable, transient local" in camera.text
    types = "ours has the type std_msgs/msg/String, theirs geometry_msgs/msg/Twist"
    eventually(lambda: types in control.text, 10.0, what=types)
    assert peer.ask("get", topic="/image_raw") == []


def test_images_reach_who_wants_them_reliable_and_one_that_hangs_holds_up_nobody(fresh: DdsGraph) -> None:
    """As the subscribers of all tutorials do, which have a depth of 10 and no more."""
    hangs, goes_on = fresh.peer, fresh.start_peer()
    topics = {"/image_raw": "Image", "/image_raw/compressed": "CompressedImage"}
    for topic, kind in topics.items():
        hangs.ask("record", topic=topic, type=kind, fields=["header.stamp"], depth=10)
        goes_on.ask("record", topic=topic, type=kind, fields=["header.stamp"], depth=10)
    camera = fresh.node("camera", "--camera", "virtual", name="/my_camera")
    for peer in (hangs, goes_on):
        eventually(lambda: all(len(peer.ask("get", topic=topic)) > 5 for topic in topics))  # noqa: B023
    hangs.freeze()
    frozen_s = time.monotonic()
    for topic in topics:
        eventually(lambda: len(goes_on.ask("get", topic=topic, since_s=frozen_s)) > 40, what=topic)  # noqa: B023
        stamps = [stamp for _, (stamp,) in goes_on.ask("get", topic=topic, since_s=frozen_s)]
        assert stamps == sorted(set(stamps))
    assert "dropped" not in camera.text


def test_several_robots_share_one_tree_of_transforms(fresh: DdsGraph) -> None:
    for name, words in (("r1", ()), ("r2", ()), ("alone", ("-r", "/tf:=tf"))):
        topic = f"/{name}{ODOM}"
        fresh.peer.ask("record", topic=topic, type="Odometry", fields=["header.frame_id", "child_frame_id"])
        fresh.node("robot", name=f"/{name}/robot", ros=("-r", f"__ns:=/{name}", *words))
        seen = eventually(lambda: fresh.peer.ask("get", topic=topic))  # noqa: B023
        prefix = "" if words else f"{name}/"
        assert seen[0][1] == [f"{prefix}odom", f"{prefix}base_link"]


def test_a_node_says_once_that_it_is_ready_and_names_its_topics_as_others_know_them(fresh: DdsGraph) -> None:
    words = ("-r", "__ns:=/r1", "-r", "image_raw:=/front/image")
    camera = fresh.node("camera", *VIRTUAL, name="/r1/my_camera", ros=words)
    line = (
        "/r1/my_camera is ready: publishes /diagnostics, /front/camera_info, /front/image, "
        "/front/image/compressed, /r1/audit, /r1/stopped; listens to /r1/stop"
    )
    eventually(lambda: line in camera.text, 10.0, what=line)
    assert camera.text.count("is ready") == 1


def test_raw_images_for_another_machine_are_warned_of_once(fresh: DdsGraph) -> None:
    near, far, farther = fresh.peer, fresh.start_peer("far"), fresh.start_peer("farther")
    camera = fresh.node("camera", *VIRTUAL, name="/my_camera")
    images = {"topic": "/image_raw", "type": "Image", "fields": ["width"], "reliable": False}
    near.ask("record", **images)
    near.ask("introduce", name="near")
    eventually(lambda: near.ask("get", topic="/image_raw"))
    assert "takes raw images" not in camera.text
    for peer, name in ((far, "viewer"), (farther, "another")):
        peer.ask("record", **images)
        peer.ask("introduce", name=name)
        eventually(lambda: "/image_raw: /viewer takes raw images" in camera.text)
    eventually(lambda: farther.ask("get", topic="/image_raw"))
    assert "let it take /image_raw/compressed" in camera.text
    assert camera.text.count("takes raw images") == 1


def test_recognition_takes_compressed_images_beyond_this_machine(fresh: DdsGraph) -> None:
    images = {"rt/image_raw", "rt/image_raw/compressed"}
    fresh.node("recognition", name="/near/hand_sign_recognition", ros=("-r", "__ns:=/near"))
    # Wherever the peers of the user's configuration may be, those of this test are here.
    loopback = "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
    fresh.env["CYCLONEDDS_URI"] = (
        f"<CycloneDDS><Domain>{loopback}<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
    )
    fresh.node("recognition", name="/hand_sign_recognition")
    eventually(lambda: images & set(fresh.nodes()["/hand_sign_recognition"]["readers"]))
    assert images & set(fresh.nodes()["/hand_sign_recognition"]["readers"]) == {"rt/image_raw/compressed"}
    assert "rt/near/image_raw" in fresh.nodes()["/near/hand_sign_recognition"]["readers"]


class TestChain(ChainContract):
    @pytest.fixture(scope="class")
    @classmethod
    def chain(cls, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
        with DdsGraph(tmp_path_factory.mktemp("chain")) as graph:
            yield driving_chain(graph)
