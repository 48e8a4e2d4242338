"""What ``handsteer doctor`` says of ROS 2 over DDS where something really is amiss."""

import contextlib
import json
import os
import platform
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from handsteer.plugins.doctor.ros2 import examine_ros2
from tests.dds.graph import free_domain
from tests.processes import Process, eventually

CONTROL = [sys.executable, "-m", "handsteer", "control", "--transport", "dds"]
SUBNET = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}


def environment(**ours: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "RMW_", "CYCLONEDDS"))}
    return {**kept, "PYTHONUNBUFFERED": "1", **ours}


class Doctor:
    """Asks the doctor, in a network of its own if ``within`` says so."""

    def __init__(self, within: list[str]) -> None:
        self.within = within

    def findings(self, *arguments: str, **ours: str) -> list[dict[str, Any]]:
        command = [*self.within, sys.executable, "-m", "handsteer", "doctor", "--json", *arguments]
        done = subprocess.run(
            command, env=environment(**ours), capture_output=True, text=True, timeout=120, check=False
        )
        assert done.returncode in {0, 1}, done.stderr
        return list(json.loads(done.stdout))

    def says(self, **ours: str) -> str:
        """Return what it finds of DDS, with verdicts."""
        return "\n".join(
            f"{finding['verdict']}: {finding['detail']}"
            for finding in self.findings(**ours)
            if finding["name"] == "dds"
        )


@pytest.fixture
def here() -> Doctor:
    pytest.importorskip("cyclonedds")
    return Doctor([])


@pytest.fixture
def alone() -> Iterator[Doctor]:
    """A doctor in a network of its own, which has loopback only."""
    pytest.importorskip("cyclonedds")
    if os.geteuid() != 0 or not all(map(shutil.which, ("unshare", "nsenter", "ip"))):
        pytest.skip("needs root, util-linux and iproute2, for a network of its own")
    with subprocess.Popen(
        ["unshare", "--net", "sh", "-c", "ip link set lo up && echo up && exec sleep 600"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        if holder.stdout.readline().strip() != "up":
            pytest.skip("no network namespaces here")
        yield Doctor(["nsenter", f"--net=/proc/{holder.pid}/ns/net"])
        holder.kill()


def add_network_card(doctor: Doctor) -> None:
    cable = ("link add card0 type veth peer name card1", "link set card1 up")
    for words in (*cable, "addr add 10.98.7.1/24 dev card0", "link set card0 multicast on up"):
        subprocess.run([*doctor.within, "ip", *words.split()], check=True, capture_output=True)


@contextlib.contextmanager
def controls(doctor: Doctor, home: Path, *names: str, **ours: str) -> Iterator[None]:
    """Controls of these names, for as long as the block lasts."""
    started = [
        Process(
            [*doctor.within, *CONTROL, "--ros-args", "-r", f"__node:={name}"], environment(**ours), home / f"{name}.log"
        )
        for name in names
    ]
    try:
        yield
    finally:
        for process in started:
            process.kill()


@pytest.mark.slow
def test_wrong_domain(alone: Doctor, tmp_path: Path) -> None:
    with controls(alone, tmp_path, "far", ROS_DOMAIN_ID="42"):
        words = (
            "wrong: domain 5, this machine: no other nodes; but domain 42 has /far. To reach them, set "
            "ROS_DOMAIN_ID=42 here, or 5 there"
        )
        eventually(lambda: alone.says(ROS_DOMAIN_ID="5") == words, what=words)
        eventually(
            lambda: alone.says(ROS_DOMAIN_ID="42") == "ok: domain 42, this machine: /far", what="/far to be seen"
        )


@pytest.mark.slow
def test_somebody_in_the_domain_looks_elsewhere(alone: Doctor, tmp_path: Path) -> None:
    """Who looks at the subnet, as ROS 2 does by itself, is met on this machine, unless only loopback is allowed."""
    add_network_card(alone)
    with controls(alone, tmp_path, "far", **SUBNET):
        eventually(lambda: "ok: domain 0, the subnet: /far" in alone.says(**SUBNET), what="the node to start")
        eventually(lambda: "ok: domain 0, this machine: /far" in alone.says(), what="the node to be seen")
        (line,) = alone.says(ROS_LOCALHOST_ONLY="1").splitlines()
        assert line.startswith("wrong: domain 0, this machine: another node on this machine is in this domain, but was")
        assert "unset ROS_LOCALHOST_ONLY" in line


@pytest.mark.slow
def test_a_node_that_others_do_not_find_is_reported(alone: Doctor, tmp_path: Path) -> None:
    """We find it, as we announce ourselves on loopback; a program of ROS 2 with the default range does not."""
    add_network_card(alone)
    with controls(alone, tmp_path, "seen"):
        eventually(lambda: alone.says() == "ok: domain 0, this machine: /seen", what="the node to be seen")
        with controls(alone, tmp_path, "shy", ROS_LOCALHOST_ONLY="1"):
            eventually(lambda: "/shy" in alone.says().splitlines()[0], what="the node to start")
            line = "wrong: domain 0, this machine: /shy not found by programs that start now with ROS 2's default range"
            assert line in alone.says()
            assert alone.says(ROS_LOCALHOST_ONLY="1").startswith("ok: domain 0, this machine: /s")


@pytest.mark.slow
def test_no_multicast(alone: Doctor) -> None:
    assert "wrong: no multicast, which finds the nodes on the subnet: no network interface supports it" in alone.says(
        **SUBNET
    )
    assert "multicast" not in alone.says()  # which needs none
    add_network_card(alone)
    assert "ok: multicast works on card0" in alone.says(**SUBNET)


@pytest.mark.slow
def test_two_publishers_of_a_velocity(alone: Doctor, tmp_path: Path) -> None:
    words = (
        "wrong: /robot_diff_drive_controller/cmd_vel has 2 publishers (/a, /b), and a robot obeys all of them in turn"
    )
    with controls(alone, tmp_path, "a", "b"):
        eventually(lambda: words in alone.says(), what=words)


@pytest.mark.slow
def test_all_ports_of_a_domain_are_taken(here: Doctor) -> None:
    domain = free_domain()
    first = 7400 + 250 * domain + 10
    with contextlib.ExitStack() as taken:
        for port in range(first, first + 66, 2):
            taken.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)).bind(("127.0.0.1", port))
        assert here.says(ROS_DOMAIN_ID=str(domain)) == (
            f"wrong: all 33 places in domain {domain} on this machine are taken (UDP ports {first} to {first + 65}): "
            "end some nodes, or choose another ROS_DOMAIN_ID"
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("uri", "why"),
    [
        ("<CycloneDDS><Domain", "parser error"),
        ("<CycloneDDS><Domain><General><Bogus>1</Bogus></General></Domain></CycloneDDS>", "Bogus: unknown element"),
        ("file:///nowhere.xml", "can't open configuration file file:///nowhere.xml"),
    ],
)
def test_a_configuration_that_cannot_be_used(here: Doctor, uri: str, why: str) -> None:
    said = here.says(CYCLONEDDS_URI=uri, ROS_DOMAIN_ID=str(free_domain()))
    assert re.fullmatch(rf"wrong: CYCLONEDDS_URI cannot be used: .*{re.escape(why)}.*; fix or unset it", said)


@pytest.mark.slow
def test_the_pages_port_is_taken(here: Doctor) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        findings = here.findings("--port", str(port), ROS_DOMAIN_ID=str(free_domain()))
    (said,) = [finding for finding in findings if finding["name"] == "port"]
    assert said["verdict"] == "missing"
    assert (
        said["detail"]
        == f"port {port}: Address already in use; end the program that uses it, or choose another port with --port"
    )


@pytest.fixture
def no_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds", None)


@pytest.mark.usefixtures("no_engine")
def test_without_cyclonedds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(platform, "python_version_tuple", lambda: ("3", "13", "0"))
    (said,) = examine_ros2({})
    assert said.verdict == "optional"
    assert "pip install 'cyclonedds" in said.detail
    monkeypatch.setattr(platform, "python_version_tuple", lambda: ("3", "14", "0"))
    monkeypatch.setattr(platform, "python_version", lambda: "3.14.0")
    assert "there is none for Python 3.14.0; use Python 3.11 to 3.13" in examine_ros2({})[0].detail


@pytest.mark.usefixtures("no_engine")
@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"ROS_DOMAIN_ID": "x"}, "ROS_DOMAIN_ID is 'x': it should be a whole number from 0 to 232"),
        ({"ROS_LOCALHOST_ONLY": "yes"}, "ROS_LOCALHOST_ONLY is 'yes': it should be 0 or 1"),
        ({"ROS_DOMAIN_ID": "150"}, "ROS_DOMAIN_ID is 150: above 101 other programs may be using"),
        ({"ROS_LOCALHOST_ONLY": "1", **SUBNET}, "so ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET is ignored"),
        ({"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.0.0.1"}, "ROS_STATIC_PEERS is ignored"),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"}, "nodes that use only a discovery server are not found"),
        (
            {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"},
            "RMW_IMPLEMENTATION is rmw_zenoh_cpp: ROS 2 nodes then do not use DDS",
        ),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_odd_variables(variables: dict[str, str], words: str) -> None:
    assert [words in finding.detail for finding in examine_ros2(variables) if finding.verdict == "wrong"] == [True]
    assert not [finding for finding in examine_ros2({}) if finding.verdict == "wrong"]
