import re
import xml.etree.ElementTree as ET

import pytest

from handsteer.errors import TransportError
from handsteer.plugins.dds.network import network


def settings(*addresses: str, **environment: str) -> dict[str, object]:
    """Return what Cyclone DDS is told on a machine with these addresses."""
    config = network(environment, addresses).config
    assert config is not None
    tree = ET.fromstring(config)
    return {
        "interfaces": [one.get("address") for one in tree.iter("NetworkInterface")],
        "multicast": tree.findtext(".//AllowMulticast"),
        "index": tree.findtext(".//ParticipantIndex"),
        "peers": [peer.get("address") for peer in tree.iter("Peer")],
    }


LOOPBACK = {"interfaces": ["127.0.0.1"], "multicast": "false", "index": "auto", "peers": ["127.0.0.1"]}


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"ROS_LOCALHOST_ONLY": "1"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
        {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_STATIC_PEERS": "10.0.0.1"},
    ],
)
def test_this_machine_only(environment: dict[str, str]) -> None:
    assert settings(**environment) == LOOPBACK


def test_who_looks_at_the_subnet_is_met_on_this_machine() -> None:
    """None is the card that Cyclone DDS chooses; as many peers are told of us as it can be."""
    met = settings("10.0.0.7", "10.1.0.7", "10.2.0.7", "10.3.0.7")
    assert met["interfaces"] == [None, "127.0.0.1"]
    assert met["multicast"] == "false"
    assert met["peers"] == ["127.0.0.1", "10.0.0.7", "10.1.0.7", "10.2.0.7"]
    for environment in ({"ROS_LOCALHOST_ONLY": "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}):
        assert settings("10.0.0.7", **environment)["interfaces"] == ["127.0.0.1"]


@pytest.mark.parametrize("environment", [{"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_LOCALHOST_ONLY": "0"}])
def test_the_subnet(environment: dict[str, str]) -> None:
    assert settings(**environment) == {"interfaces": [], "multicast": "true", "index": "auto", "peers": []}


def test_static_peers() -> None:
    assert settings(ROS_STATIC_PEERS="10.0.0.1; robot.local;") == {
        "interfaces": [],
        "multicast": "false",
        "index": "auto",
        "peers": ["127.0.0.1", "10.0.0.1", "robot.local"],
    }
    assert settings(ROS_STATIC_PEERS="10.0.0.1", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")["peers"] == []
    assert settings(ROS_STATIC_PEERS="10.0.0.1", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")["peers"] == ["10.0.0.1"]


@pytest.mark.parametrize(
    ("environment", "interval"),
    [
        ({}, "2 s"),
        ({"ROS_LOCALHOST_ONLY": "1"}, None),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "2 s"),
        ({"ROS_STATIC_PEERS": "10.0.0.1"}, "2 s"),
    ],
)
def test_to_others_we_say_often_that_we_are_there(environment: dict[str, str], interval: str | None) -> None:
    config = network(environment, ["10.0.0.7"]).config
    assert config is not None
    assert ET.fromstring(config).findtext(".//SPDPInterval") == interval


@pytest.mark.parametrize(
    "environment",
    [{}, {"ROS_LOCALHOST_ONLY": "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_STATIC_PEERS": "10.0.0.1"}],
)
def test_no_address_is_dropped_because_it_was_silent(environment: dict[str, str]) -> None:
    config = network(environment, ["10.0.0.7"]).config
    assert config is not None
    assert ET.fromstring(config).findtext(".//Discovery/InitialLocatorPruneDelay") == "inf"


def test_the_users_configuration_wins() -> None:
    assert network({"CYCLONEDDS_URI": "file:///my.xml", "ROS_LOCALHOST_ONLY": "1"}).config is None
    assert network({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}).config is None


@pytest.mark.parametrize(
    ("environment", "local"),
    [
        ({}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, True),
        ({"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.0.0.1"}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False),
        ({"ROS_STATIC_PEERS": "10.0.0.1"}, False),
        ({"CYCLONEDDS_URI": "file:///my.xml"}, False),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, False),
    ],
)
def test_whether_others_may_be_on_other_machines(environment: dict[str, str], local: bool) -> None:
    assert network(environment).is_local is local


def test_domain_and_distribution() -> None:
    assert network({}).domain == 0
    assert network({"ROS_DOMAIN_ID": "42", "CYCLONEDDS_URI": "x"}).domain == 42
    assert network({"ROS_DISTRO": "humble"}).distribution == "humble"
    assert network({"ROS_DISTRO": "kilted"}).distribution == "jazzy"


@pytest.mark.parametrize(
    ("name", "value", "right"),
    [
        ("ROS_DOMAIN_ID", "x", "a whole number from 0 to 232"),
        ("ROS_DOMAIN_ID", "-1", "a whole number from 0 to 232"),
        ("ROS_DOMAIN_ID", "233", "a whole number from 0 to 232"),
        ("ROS_LOCALHOST_ONLY", "yes", "0 or 1"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "WORLD", "LOCALHOST or SUBNET or OFF or SYSTEM_DEFAULT"),
        ("ROS_STATIC_PEERS", '"/><x', "addresses with ; between them"),
    ],
)
def test_wrong_variables(name: str, value: str, right: str) -> None:
    with pytest.raises(TransportError, match=f"^{name} (is|has) {re.escape(repr(value))}: it should be {right}$"):
        network({name: value})
