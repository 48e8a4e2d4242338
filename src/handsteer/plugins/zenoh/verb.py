"""``handsteer zenoh-router``: the router through which nodes over Zenoh find each other."""

import os
import threading
from typing import TYPE_CHECKING

from handsteer.cli.running import say
from handsteer.errors import needing

if TYPE_CHECKING:
    from handsteer.plugins.zenoh.configuration import Router


def zenoh_router(*, listen: str | None = None) -> int:
    """Run the router through which nodes over Zenoh find each other, until you press Ctrl-C.

    ROS 2's own does the same (ros2 run rmw_zenoh_cpp rmw_zenohd); each machine
    needs only one of them.

    For example:
      handsteer zenoh-router                         for this machine
      handsteer zenoh-router --listen tcp/[::]:7447  for other machines too

    Parameters
    ----------
    listen
        Endpoint, by default tcp/localhost:7447, for this machine only; tcp/[::]:7447 accepts other machines.
    """
    router = _open(listen)
    try:
        say(f"the Zenoh router listens at {' and '.join(router.endpoints)}")
        threading.Event().wait()
    except KeyboardInterrupt:
        pass  # the usual end of a router
    finally:
        router.close()
    return 0


def _open(listen: str | None) -> "Router":
    with needing("the Zenoh router", "zenoh", "zenoh", "xxhash"):
        from handsteer.plugins.zenoh.configuration import Router
    return Router(os.environ, listen)
