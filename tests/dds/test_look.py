"""What the doctor sees of a domain, with our nodes and others in it."""

import json
import subprocess
import sys
from typing import Any

import pytest

pytest.importorskip("cyclonedds")

from handsteer.plugins.dds.look import ObservedTopic, problems_of
from tests.dds.graph import DdsGraph
from tests.processes import eventually

TWIST, STRING = "geometry_msgs/msg/Twist", "std_msgs/msg/String"
DRIVEN = "robot_diff_drive_controller/cmd_vel:=/robot_diff_drive_controller/cmd_vel"


def look(domain: DdsGraph) -> dict[str, Any]:
    command = [sys.executable, "-m", "handsteer.plugins.dds.look"]
    done = subprocess.run(command, env=domain.env, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.mark.slow
def test_nodes_topics_and_what_is_amiss(fresh: DdsGraph) -> None:
    fresh.node("control", name="/hand_sign_control")
    fresh.node("control", name="/r1/other", ros=("-r", "__ns:=/r1", "-r", "__node:=other", "-r", DRIVEN))
    fresh.peer.ask("advertise", topic="/eye", type="Image", reliable=False)
    fresh.peer.ask("introduce", name="talker")
    viewer = fresh.start_peer()
    viewer.ask("record", topic="/eye", type="Image", fields=["height"], reliable=True)
    viewer.ask("introduce", name="viewer")
    seen = eventually(lambda: found if len((found := look(fresh))["nodes"]) == 4 else None, what="all nodes")
    assert seen["place"] == f"domain {fresh.domain}, this machine"
    assert seen["nodes"] == ["/hand_sign_control", "/r1/other", "/talker", "/viewer"]
    topics = {topic["name"]: topic for topic in seen["topics"]}
    assert topics["/gesture/hand_sign"]["types"] == ["std_msgs/msg/String"]
    assert topics["/gesture/hand_sign"]["publishers"] == []
    driven, eye = seen["warnings"]
    assert driven.startswith("/robot_diff_drive_controller/cmd_vel has 2 publishers (/hand_sign_control, /r1/other)")
    assert eye == (
        "/eye: nothing passes from /talker to /viewer: the publisher is best effort, the subscriber wants reliable "
        "(offered: best effort, volatile, keep last 100; requested: reliable, volatile, keep last 100)"
    )


def topic(name: str, *types: str, publishers: tuple[str, ...] = ()) -> ObservedTopic:
    return ObservedTopic(name, types, publishers)


def test_nothing_is_amiss() -> None:
    driven = topic("/cmd_vel", TWIST, publishers=("/a",))
    said = topic("/chatter", STRING, publishers=("/a", "/b"))
    assert problems_of(["/a", "/b"], [driven, said]) == []


def test_two_drivers_two_types_and_two_nodes_of_one_name() -> None:
    (named, driven, typed) = problems_of(
        ["/a", "/a", "/b"], [topic("/cmd_vel", TWIST, publishers=("/a", "/b")), topic("/x", STRING, TWIST)]
    )
    assert named.startswith("2 nodes have the name /a: end one of them")
    assert driven.startswith("/cmd_vel has 2 publishers (/a, /b), and a robot obeys all of them in turn: end all but")
    assert typed == f"/x has the types {STRING} and {TWIST}: only those of one type are connected"
