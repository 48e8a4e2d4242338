"""``handsteer zenoh-router``: where nodes over Zenoh find each other."""

import os
import threading
from typing import Any

from handsteer.cli.running import say
from handsteer.errors import needing


def zenoh_router(*, listen: str | None = None) -> int:
    """Be the router by which nodes over Zenoh find each other, until you press Ctrl-C.

    ROS 2's own, ros2 run rmw_zenoh_cpp rmw_zenohd, does the same; one of them is enough for a machine.

    Example: handsteer zenoh-router

    Parameters
    ----------
    listen
        Where to listen: tcp/localhost:7447, for this machine only, unless given. tcp/[::]:7447 lets others in.
    """
    router = _open(listen)
    try:
        say(f"the Zenoh router listens at {' and '.join(router.endpoints)}")
        threading.Event().wait()
    except KeyboardInterrupt:
        pass  # the ordinary end of a router
    finally:
        router.close()
    return 0


def _open(listen: str | None) -> Any:
    with needing("the Zenoh router", "zenoh", "zenoh", "xxhash"):
        from handsteer.transports.zenoh.configuration import Router  # noqa: PLC0415
    return Router(os.environ, listen)
