"""A machine whose address changes while nodes run: in a network namespace, with real interfaces."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from tests.dds.graph import ROS_VARIABLES
from tests.distributed.network import DEVICE, ROBOT, Machine, NoNamespacesError, two_machines
from tests.processes import Process, eventually

pytestmark = pytest.mark.netns
OTHER = "10.77.0.7"
LOST = f"address flush dev {DEVICE}"
BACK = f"address add {ROBOT}/24 dev {DEVICE}"
ELSEWHERE = f"address add {OTHER}/24 dev {DEVICE}"


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    try:
        with two_machines(tmp_path) as (here, _there, _link):
            yield here
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")


def start(machine: Machine, log: Path, *words: str, **variables: str) -> Process:
    kept = {name: value for name, value in os.environ.items() if name not in ROS_VARIABLES}
    return Process(machine.command(sys.executable, *words), {**kept, "PYTHONUNBUFFERED": "1", **variables}, log)


@pytest.mark.slow
@pytest.mark.parametrize("variables", [{"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_STATIC_PEERS": "10.77.0.2"}])
def test_a_node_ends_when_the_address_of_its_machine_has_changed(
    machine: Machine, tmp_path: Path, variables: dict[str, str]
) -> None:
    words = ("-m", "handsteer", "robot", "--transport", "dds")
    robot = start(machine, tmp_path / "robot.log", *words, ROS_DOMAIN_ID="81", **variables)
    try:
        eventually(lambda: "is ready" in robot.text, what="the robot to start")
        for change in (LOST, ELSEWHERE):
            machine.run("ip", *change.split())
        assert robot.code() == 2, robot.text
        line = f"handsteer: the address of this machine has changed from {ROBOT} to {OTHER}: start handsteer again"
        assert line in robot.text.splitlines()
        assert "Traceback" not in robot.text
    finally:
        robot.kill()


LOCAL = """
import subprocess, sys
from handsteer.transports import join
session = join("dds", "tests", [])
for change in sys.argv[1:]:
    subprocess.run(["ip", *change.split()], check=True)
session.wait(0.0)
session.close()
print("done")
"""


@pytest.mark.parametrize("variables", [{}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}])
def test_who_looks_at_this_machine_only_goes_on(machine: Machine, tmp_path: Path, variables: dict[str, str]) -> None:
    log = tmp_path / "local.log"
    process = start(machine, log, "-c", LOCAL, LOST, ELSEWHERE, ROS_DOMAIN_ID="81", **variables)
    try:
        assert process.code() == 0, process.text
    finally:
        process.kill()


WATCH = """
import os, subprocess, sys
from handsteer.errors import TransportError
from handsteer.plugins.dds.addresses import AddressWatch
from handsteer.plugins.dds.network import network
from handsteer.plugins.dds.participant import Participant
from handsteer.plugins.ros2.names import NodeName
participant = Participant(network(os.environ), NodeName("tests"))
watch = AddressWatch()
for change in sys.argv[1:]:
    subprocess.run(["ip", *change.split()], check=True)
    try:
        watch.look()
    except TransportError as error:
        print(f"{change}: {error}")
participant.close()
print("done")
"""
ON_DEVICE = (
    f'<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="{DEVICE}"/></Interfaces></General>'
    "</Domain></CycloneDDS>"
)


@pytest.mark.parametrize(
    "changes",
    [
        (f"link set {DEVICE} down", f"link set {DEVICE} up"),
        (LOST, BACK),
        (ELSEWHERE,),
    ],
    ids=["the link is down and up again", "the address is away and back", "an address is added"],
)
def test_what_is_no_replacement_ends_nothing(machine: Machine, tmp_path: Path, changes: tuple[str, ...]) -> None:
    assert said_at(machine, tmp_path, changes) == ["done"]


def test_an_address_that_was_there_before_is_no_replacement(machine: Machine, tmp_path: Path) -> None:
    """As that of the network of a laser scanner: the Wi-Fi may come back with the address that it had."""
    for words in ("link add scan0 type veth peer scan1", "link set scan0 up", "address add 10.78.0.1/24 dev scan0"):
        machine.run("ip", *words.split())
    assert said_at(machine, tmp_path, (LOST, ELSEWHERE)) == [
        f"{ELSEWHERE}: the address of this machine has changed from {ROBOT} to {OTHER}: start handsteer again",
        "done",
    ]


def said_at(machine: Machine, home: Path, changes: tuple[str, ...]) -> list[str]:
    """Return what a watch says at each of the changes of the machine's network, one after the other."""
    process = start(machine, home / "watch.log", "-c", WATCH, *changes, ROS_DOMAIN_ID="81", CYCLONEDDS_URI=ON_DEVICE)
    try:
        assert process.code() == 0, process.text
        # Cyclone DDS prints lines of its own about packets that it could not send.
        return [line for line in process.text.splitlines() if "ddsi_" not in line and "[81]" not in line]
    finally:
        process.kill()
