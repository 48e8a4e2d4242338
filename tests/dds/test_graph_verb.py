"""What ``handsteer graph`` tells of a domain with our nodes and others in it."""

import json
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

pytest.importorskip("cyclonedds")

from tests.dds.graph import DdsGraph, dds_graph
from tests.processes import eventually

CLOCK_HZ = 100.0


@pytest.fixture(scope="module")
def domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DdsGraph]:
    with dds_graph(tmp_path_factory.mktemp("graph")) as graph:
        graph.node("control", name="/hand_sign_control")
        graph.node("control", name="/r1/other", ros=("-r", "__ns:=/r1", "-r", "__node:=other", "-r", DRIVEN))
        for topic, kind, reliable in (
            ("/clock", "Clock", True),
            ("/battery", "Battery", True),
            ("/eye", "Image", False),
        ):
            graph.peer.ask("advertise", topic=topic, type=kind, reliable=reliable)
        graph.peer.ask("introduce", name="talker")
        viewer = graph.start_peer()
        viewer.ask("record", topic="/eye", type="Image", fields=["height"], reliable=True)
        viewer.ask("introduce", name="viewer")
        yield graph


DRIVEN = "robot_diff_drive_controller/cmd_vel:=/robot_diff_drive_controller/cmd_vel"


def look(domain: DdsGraph, *arguments: str) -> str:
    command = [sys.executable, "-m", "handsteer", "graph", "--transport", "dds", *arguments]
    done = subprocess.run(command, env=domain.env, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def seen(domain: DdsGraph) -> dict[str, Any]:
    """What is seen while /clock and /battery are published; tried again where a busy machine was late for it."""

    def look_at_all() -> dict[str, Any] | None:
        domain.peer.ask("run_clock", from_s=100, seconds=15)
        with ThreadPoolExecutor() as pool:
            looking = pool.submit(look, domain, "--json")
            while not looking.done():
                domain.peer.ask("publish", topic="/battery", values={"charge": 3}, count=10, period_s=0.02)
        found = dict(json.loads(looking.result()))
        return found if len(found["nodes"]) == 4 and topics(found)["/battery"]["rate_hz"] else None

    return dict(eventually(look_at_all, what="all nodes to be seen"))


def topics(seen: dict[str, Any]) -> dict[str, Any]:
    return {topic["name"]: topic for topic in seen["topics"]}


def test_nodes_and_their_topics(domain: DdsGraph, seen: dict[str, Any]) -> None:
    assert seen["place"] == f"domain {domain.domain}, this machine"
    assert seen["nodes"] == ["/hand_sign_control", "/r1/other", "/talker", "/viewer"]
    signs = topics(seen)["/gesture/hand_sign"]
    assert (signs["types"], signs["publishers"]) == (["std_msgs/msg/String"], [])
    assert signs["subscribers"] == ["/hand_sign_control"]
    assert topics(seen)["/r1/gesture/hand_sign"]["subscribers"] == ["/r1/other"]


def test_rates_also_of_types_that_no_library_knows(domain: DdsGraph, seen: dict[str, Any]) -> None:
    """A busy machine may slow the talker, but not speed it up."""
    assert 0 < topics(seen)["/clock"]["rate_hz"] < 1.3 * CLOCK_HZ
    assert topics(seen)["/gesture/hand_sign"]["rate_hz"] is None
    assert topics(seen)["/battery"]["types"] == ["my_robot/msg/Battery"]
    assert 0 < topics(seen)["/battery"]["rate_hz"] < 1.3 * 50


def test_what_is_amiss(seen: dict[str, Any]) -> None:
    driven, eye = seen["warnings"]
    assert driven.startswith("/robot_diff_drive_controller/cmd_vel has 2 publishers (/hand_sign_control, /r1/other)")
    assert eye == (
        "/eye: nothing passes from /talker to /viewer: the publisher is best effort, the subscriber wants reliable "
        "(offered: best effort, volatile, keep last 100; requested: reliable, volatile, keep last 100)"
    )


def test_in_words(domain: DdsGraph) -> None:
    lines: list[str] = []

    def look_at_all() -> bool:
        lines[:] = look(domain, "--seconds", "0").splitlines()
        return "4 nodes" in lines[0]

    eventually(look_at_all, what="all nodes to be seen")
    assert lines[0] == f"domain {domain.domain}, this machine: 4 nodes, {topic_rows(lines)} topics"
    assert "  subscribes  /r1/gesture/hand_sign" in lines
    assert next(line for line in lines if line.startswith("/clock ")).split() == [
        "/clock",
        "rosgraph_msgs/msg/Clock",
        "1",
        "0",
        "-",
    ]
    assert sum(line.startswith("!!  ") for line in lines) == 2


def topic_rows(lines: list[str]) -> int:
    return sum(line.startswith("/") and len(line.split()) == 5 for line in lines)
