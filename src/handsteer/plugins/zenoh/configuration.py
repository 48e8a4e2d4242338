"""Sessions and routers of Zenoh as configured by rmw_zenoh's environment variables.

Source: ros2/rmw_zenoh, README.md and its default configurations of sessions and routers.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import zenoh

from handsteer.errors import TransportError
from handsteer.plugins.ros2.names import domain_id

ROUTER = "tcp/localhost:7447"
"""Default address of the router."""

_LOOPBACK = re.compile(r"[^/]+/(localhost|127\.\d+\.\d+\.\d+|\[::1\])(:|$)|unixsock|unixpipe")
_ATTEMPTS = "ZENOH_ROUTER_CHECK_ATTEMPTS"
_OVERRIDE = "ZENOH_CONFIG_OVERRIDE"
_COMMON: dict[str, Any] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
    # Peers discover each other by the router; then they connect directly, and each pair only once.
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "scouting/gossip/autoconnect": {"router": [], "peer": ["router", "peer"]},
    "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
    # Messages kept for late subscribers are ordered by time.
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
    "transport/shared_memory/enabled": False,
}
_SESSION: dict[str, Any] = {
    "mode": "peer",
    "connect/endpoints": [ROUTER],
    "connect/timeout_ms": {"router": -1, "peer": -1, "client": 0},
    "connect/exit_on_failure": {"router": False, "peer": False, "client": True},
    "listen/endpoints": ["tcp/localhost:0"],
    "queries_default_timeout": 60000,
    **_COMMON,
}
# A router that restarts is found within a second, however long it was away.
_RETRY = {"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2}


@dataclass(frozen=True)
class Network:
    """How to join.

    Attributes:
        domain: The ROS 2 domain, 0 to 232.
        config: Configuration of the Zenoh session.
        attempts: How often to look for a router, once a second, before continuing without one; 0 waits for one, None
            does not look.
        is_local: Whether this process connects and listens on this machine only; a router may forward further.
    """

    domain: int
    config: zenoh.Config
    attempts: int | None = 1
    is_local: bool = True


def network(environment: Mapping[str, str]) -> Network:
    """Return the network configured by ``environment``; by default, it listens on this machine only.

    ``ROS_DOMAIN_ID``, ``ZENOH_SESSION_CONFIG_URI``, ``ZENOH_CONFIG_OVERRIDE`` and ``ZENOH_ROUTER_CHECK_ATTEMPTS`` have
    their meanings in rmw_zenoh.

    Raises:
        TransportError: A variable has a value that is not allowed.
    """
    settings = {**_SESSION, "connect/retry": _RETRY}
    config = _config(environment, "ZENOH_SESSION_CONFIG_URI", settings)
    ends = [*_endpoints(config, "connect"), *_endpoints(config, "listen")]
    is_local = all(_LOOPBACK.match(end) for end in ends) and config.get_json("scouting/multicast/enabled") == "false"
    return Network(domain_id(environment), config, _attempts(environment), is_local)


def router_config(environment: Mapping[str, str], endpoint: str | None = None) -> zenoh.Config:
    """Return the configuration of a router.

    Args:
        environment: ``ZENOH_ROUTER_CONFIG_URI`` and ``ZENOH_CONFIG_OVERRIDE`` have their meanings in rmw_zenoh.
        endpoint: Address to listen on, such as ``tcp/[::]:7447``; that of a variable if not given.

    Raises:
        TransportError: A variable or ``endpoint`` has a value that is not allowed.
    """
    config = _config(
        environment, "ZENOH_ROUTER_CONFIG_URI", {"mode": "router", "listen/endpoints": [ROUTER], **_COMMON}
    )
    if endpoint is not None:
        _set(config, "--listen", "listen/endpoints", json.dumps([endpoint]))
    return config


def routers(config: zenoh.Config) -> str:
    """Return the addresses at which a session looks for routers, in words."""
    return " or ".join(_endpoints(config, "connect")) or "any address"


def _endpoints(config: zenoh.Config, what: str) -> list[str]:
    """Return the addresses to ``connect`` to or ``listen`` on, which may be configured by mode."""
    endpoints: Any = json.loads(config.get_json(f"{what}/endpoints"))
    if isinstance(endpoints, dict):
        endpoints = endpoints.get(json.loads(config.get_json("mode")) or "peer", [])
    return list(endpoints)


def reason(error: zenoh.ZError) -> str:
    """Return Zenoh's error message without the locations in its source."""
    found = re.search(r'msg: "(.*?)"[,}]', str(error))
    return re.sub(r" at /[^\s\]]+", "", found[1] if found else str(error)).replace(".]", "]").rstrip(". ")


def _config(environment: Mapping[str, str], variable: str, settings: Mapping[str, Any]) -> zenoh.Config:
    file = environment.get(variable, "")
    if file:
        try:
            config = zenoh.Config.from_file(file)
        except zenoh.ZError as error:
            raise TransportError(
                f"{variable} is {file!r}: it is not a valid configuration of Zenoh ({reason(error)})"
            ) from None
    else:
        config = zenoh.Config()
        for name, value in settings.items():
            config.insert_json5(name, json.dumps(value))
    for name, value in _overrides(environment.get(_OVERRIDE, "")):
        _set(config, _OVERRIDE, name, value)
    return config


def _overrides(text: str) -> list[tuple[str, str]]:
    pairs = []
    for pair in filter(None, (part.strip() for part in text.split(";"))):
        name, assigned, value = pair.partition("=")
        if not (assigned and name.strip() and value.strip()):
            raise TransportError(f'{_OVERRIDE} has {pair!r}: it should be as mode="client";scouting/delay=100')
        pairs.append((name.strip(), value.strip()))
    return pairs


def _set(config: zenoh.Config, source: str, name: str, value: str) -> None:
    try:
        config.insert_json5(name, value)
    except zenoh.ZError as error:
        raise TransportError(
            f"{source} has {name}={value}: that is not a valid setting of Zenoh ({reason(error)})"
        ) from None


def _attempts(environment: Mapping[str, str]) -> int | None:
    text = environment.get(_ATTEMPTS, "") or "1"
    try:
        number = int(text)
    except ValueError:
        raise TransportError(
            f"{_ATTEMPTS} is {text!r}: it should be a whole number, 0 to wait, -1 not to look"
        ) from None
    return None if number < 0 else number


class Router:
    """A Zenoh router in this process, by which nodes find each other if there is no ``rmw_zenohd`` of ROS 2.

    The arguments are those of :func:`router_config`.

    Raises:
        TransportError: It cannot listen there, or a variable is wrong.
    """

    def __init__(self, environment: Mapping[str, str], endpoint: str | None = None) -> None:
        zenoh.try_init_log_from_env()
        config = router_config(environment, endpoint)
        self.endpoints = _endpoints(config, "listen")
        """Addresses it listens on."""
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            raise TransportError(
                f"no Zenoh router can be started at {' and '.join(self.endpoints)}: is there one already, or another "
                f"program on that port? ({reason(error)})"
            ) from None

    def close(self) -> None:
        """Stop the router; may be called twice."""
        if not self._session.is_closed():
            self._session.close()
