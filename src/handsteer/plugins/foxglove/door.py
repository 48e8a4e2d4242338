"""The door of the server for Foxglove."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from handsteer.plugins.foxglove.process import LiveProcess


def start_process() -> "LiveProcess":
    """Return the process of the server, started, to serve the topics of a graph in this process."""
    from handsteer.plugins.foxglove.process import LiveProcess

    return LiveProcess()
