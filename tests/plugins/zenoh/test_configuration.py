import json
from pathlib import Path

import pytest

pytest.importorskip("zenoh")

from handsteer.errors import TransportError
from handsteer.plugins.zenoh.configuration import network, router_config, routers


def setting(name: str, **environment: str) -> object:
    """Return what Zenoh is told."""
    return json.loads(network(environment).config.get_json(name))


def test_without_a_word_only_this_machine_is_listened_to() -> None:
    assert setting("mode") == "peer"
    assert setting("listen/endpoints") == ["tcp/localhost:0"]
    assert setting("connect/endpoints") == ["tcp/localhost:7447"]
    assert setting("scouting/multicast/enabled") is False
    assert json.loads(router_config({}).get_json("listen/endpoints")) == ["tcp/localhost:7447"]
    assert json.loads(router_config({}).get_json("mode")) == "router"


def test_the_users_file_wins_and_what_overrides_it_too(tmp_path: Path) -> None:
    file = tmp_path / "my.json5"
    file.write_text('{mode: "client", connect: {endpoints: ["tcp/10.0.0.1:7447"]}} // mine\n')
    given = {"ZENOH_SESSION_CONFIG_URI": str(file)}
    assert setting("mode", **given) == "client"
    assert setting("connect/endpoints", **given) == ["tcp/10.0.0.1:7447"]
    given["ZENOH_CONFIG_OVERRIDE"] = 'connect/endpoints=["tcp/10.0.0.2:7447"];scouting/delay=100;'
    assert setting("connect/endpoints", **given) == ["tcp/10.0.0.2:7447"]
    assert setting("scouting/delay", **given) == 100
    assert routers(network(given).config) == "tcp/10.0.0.2:7447"


def test_the_option_of_the_router_goes_before_its_variables() -> None:
    given = {"ZENOH_CONFIG_OVERRIDE": 'listen/endpoints=["tcp/10.0.0.2:1"]'}
    assert json.loads(router_config(given).get_json("listen/endpoints")) == ["tcp/10.0.0.2:1"]
    assert json.loads(router_config(given, "tcp/[::]:7447").get_json("listen/endpoints")) == ["tcp/[::]:7447"]


@pytest.mark.parametrize(("text", "attempts"), [("", 1), ("0", 0), ("-1", None), ("5", 5)])
def test_how_often_a_router_is_looked_for(text: str, attempts: int | None) -> None:
    assert network({"ZENOH_ROUTER_CHECK_ATTEMPTS": text}).attempts == attempts


@pytest.mark.parametrize(
    ("override", "is_local"),
    [
        ("", True),
        ('connect/endpoints=["tcp/127.0.0.1:7000"]', True),
        ('listen/endpoints=["tcp/[::]:0"]', False),
        ('connect/endpoints=["tcp/10.0.0.2:7447"]', False),
        ('connect/endpoints=["tcp/localhost.example.com:7447"]', False),
        ("scouting/multicast/enabled=true", False),
    ],
)
def test_whether_others_may_be_on_other_machines(override: str, is_local: bool) -> None:
    assert network({"ZENOH_CONFIG_OVERRIDE": override}).is_local == is_local


def test_the_domain() -> None:
    assert network({}).domain == 0
    assert network({"ROS_DOMAIN_ID": "42"}).domain == 42


@pytest.mark.parametrize(
    ("name", "value", "right"),
    [
        ("ROS_DOMAIN_ID", "x", "a whole number from 0 to 232"),
        ("ZENOH_ROUTER_CHECK_ATTEMPTS", "often", "a whole number, 0 to wait, -1 not to look"),
        ("ZENOH_CONFIG_OVERRIDE", "mode", "it should be as mode="),
        ("ZENOH_CONFIG_OVERRIDE", "no/such=1", "that is not a valid setting of Zenoh"),
        ("ZENOH_SESSION_CONFIG_URI", "/none.json5", "it is not a valid configuration of Zenoh"),
    ],
)
def test_wrong_variables(name: str, value: str, right: str) -> None:
    with pytest.raises(TransportError, match=f"^{name} .*{right}"):
        network({name: value})
