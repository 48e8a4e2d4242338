"""``ros2 param`` and ``ros2 topic`` on one machine ask our node on another, over a link that loses frames."""

import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.contracts.node_contract import VIRTUAL
from tests.contracts.ros2_node_contract import NODE
from tests.dds.graph import ROS_VARIABLES
from tests.distributed.network import NoNamespacesError, two_machines
from tests.processes import Peer, Process, eventually
from tests.ros2.graph import NEEDS_ROS2, PEER, PYTHON

pytestmark = [pytest.mark.netns, *NEEDS_ROS2]


def test_parameters_are_listed_and_set_from_another_machine(tmp_path: Path) -> None:
    env = {name: value for name, value in os.environ.items() if name not in ROS_VARIABLES}
    env |= {"ROS_DOMAIN_ID": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "PYTHONUNBUFFERED": "1"}
    try:
        with two_machines(tmp_path) as (robot, workstation, link):
            link.shape(delay_s=0.005, loss=0.05)
            words = robot.command(str(PYTHON), "-m", "handsteer", "control", "--transport", "ros2")
            control = Process(words, env, tmp_path / "control.log")
            peer = Peer(workstation.command(str(PYTHON), str(PEER)), env, tmp_path / "peer.log")
            for _ in range(10):
                # ROS 2 loses an answer to a client whom the server has not wholly discovered yet; one asks again.
                asked = {"node": f"/{NODE}", "call": "list_parameters", "arguments": []}
                reply = eventually(partial(peer.ask, "parameters", **asked), what=control.text)
                assert "ramp" in reply["result"]["names"]
            change = {"name": "max_linear", "value": 0.2}
            results = peer.ask("parameters", node=f"/{NODE}", call="set_parameters", arguments=[change])["results"]
            assert results == [{"successful": True, "reason": ""}]
            assert "Traceback" not in control.text
            control.kill()
            peer.kill()
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")


def _many_of(peer: Peer, topic: str) -> list[Any] | None:
    """Return what the peer has recorded on a topic, once that is much."""
    found: list[Any] = peer.ask("get", topic=topic)
    return found if len(found) >= 60 else None


@pytest.mark.parametrize("transport", ["ros2", "dds"])
def test_pictures_reach_reliable_and_best_effort_subscribers_on_another_machine(tmp_path: Path, transport: str) -> None:
    env = {name: value for name, value in os.environ.items() if name not in ROS_VARIABLES}
    env |= {"ROS_DOMAIN_ID": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "PYTHONUNBUFFERED": "1"}
    topic = "/image_raw/compressed"
    python = str(PYTHON) if transport == "ros2" else sys.executable
    try:
        with two_machines(tmp_path) as (robot, workstation, link):
            link.shape(delay_s=0.005, loss=0.05)
            words = robot.command(python, "-m", "handsteer", "camera", "--transport", transport, *VIRTUAL)
            camera = Process(words, env, tmp_path / "camera.log")
            peers = [
                Peer(workstation.command(str(PYTHON), str(PEER)), env, tmp_path / f"peer_{reliable}.log")
                for reliable in (True, False)
            ]
            for peer, reliable in zip(peers, (True, False), strict=True):
                wanted = {"fields": ["header.stamp", "data"], "reliable": reliable, "depth": 10}
                peer.ask("record", topic=topic, type="CompressedImage", **wanted)
            for peer in peers:
                pictures = eventually(partial(_many_of, peer, topic), what=f"pictures; {camera.text}")
                stamps = [stamp for _, (stamp, _) in pictures]
                assert stamps == sorted(set(stamps))
                assert all(size > 1000 for _, (_, size) in pictures)
            for process in (camera, *peers):
                process.kill()
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")
