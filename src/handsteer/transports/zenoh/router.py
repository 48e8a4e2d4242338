"""A Zenoh router, by which nodes find each other if no ROS 2 with ``rmw_zenohd`` is installed."""

import json
from collections.abc import Mapping

import zenoh

from handsteer.errors import TransportError
from handsteer.transports.zenoh.network import reason, router_config


class Router:
    """A Zenoh router in this process, until it is closed.

    Args:
        environment: ``ZENOH_ROUTER_CONFIG_URI`` and ``ZENOH_CONFIG_OVERRIDE`` have their meanings in ``rmw_zenohd``.
        endpoint: Address to listen on, such as ``tcp/[::]:7447``; by default that of the variables, else this machine
            only.

    Raises:
        TransportError: It cannot listen there, or a variable is wrong.
    """

    def __init__(self, environment: Mapping[str, str], endpoint: str | None = None) -> None:
        zenoh.try_init_log_from_env()
        config = router_config(environment, endpoint)
        endpoints = json.loads(config.get_json("listen/endpoints"))
        if isinstance(endpoints, dict):
            endpoints = endpoints.get("router", [])
        self.endpoints: list[str] = endpoints
        """Addresses it listens on."""
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            raise TransportError(
                f"no Zenoh router can be started at {' and '.join(endpoints)}: is there one already, or another "
                f"program on that port? ({reason(error)})"
            ) from None

    def close(self) -> None:
        """Stop the router; may be called twice."""
        if not self._session.is_closed():
            self._session.close()
