"""The doors of the page: a process of its own, and next to one node."""

import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from handsteer.config import Config
from handsteer.errors import needing
from handsteer.making import cmd_vel_topic

if TYPE_CHECKING:
    from handsteer.nodes.steering import SteeringNode
    from handsteer.plugins.page.page_process import PageProcess


def start_process() -> "PageProcess":
    """Return the process of the page, started, to serve the page of a graph in this process."""
    from handsteer.plugins.page.page_process import PageProcess

    return PageProcess()


@contextmanager
def serve_next_to(node: "SteeringNode", config: Config, say: Callable[[str], None]) -> Iterator[None]:
    """Serve the page of the graph that ``node`` has joined, from this process, and ``say`` where.

    Raises:
        PackageMissing: The page is not installed.
        DashboardError: It cannot be served.
    """
    # The page's libraries take a second to load, which the other nodes do not need.
    with needing("the page", "page", "nicegui"):
        from handsteer.plugins.page.server import Dashboard

    dashboard = Dashboard(node.transport, node.clock, node, config.dashboard, cmd_vel=cmd_vel_topic(config))
    url = dashboard.start()
    try:
        say(f"the page is at {url}")
        if config.dashboard.opens_browser:
            webbrowser.open(url)
        yield
    finally:
        dashboard.stop()
