import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from handsteer.cameras.choice import BROWSER
from handsteer.plugins.page.camera import FrameSocket, is_far
from handsteer.plugins.page.pictures import CameraPrivacy


@pytest.mark.parametrize(
    ("client", "server", "expected"),
    [
        ("127.0.0.1", "127.0.0.1", False),
        ("::1", "::1", False),
        ("192.0.2.7", "192.0.2.7", False),  # this machine, by its own address
        ("192.0.2.9", "192.0.2.7", True),
    ],
)
def test_a_browser_is_far_unless_it_is_on_this_machine(client: str, server: str, expected: bool) -> None:
    assert is_far({"client": (client, 50000), "server": (server, 8080)}) is expected


class SilentSocket:
    """The websocket of a browser that gives no pictures, as of a phone that sleeps."""

    def __init__(self) -> None:
        self.scope = {"client": ("127.0.0.1", 1), "server": ("127.0.0.1", 2)}
        self.query_params: dict[str, str] = {}
        self.closed: int | None = None

    async def receive(self) -> Any:
        await asyncio.Event().wait()

    async def close(self, code: int, _reason: str = "") -> None:
        self.closed = code


@pytest.mark.parametrize("ends", ["another viewer drives", "another camera is chosen"])
def test_a_browser_that_gives_no_pictures_does_not_keep_the_camera(ends: str) -> None:
    """The guard: ``_LOOK_S``: until then no other browser could give its camera."""
    state = SimpleNamespace(camera_source=BROWSER, cameras=[], world=None)
    is_driver = True

    async def give() -> int | None:
        nonlocal is_driver
        frames = FrameSocket(None, lambda _viewer: is_driver, CameraPrivacy())
        frames._begin = begin  # type: ignore[method-assign,assignment]
        socket: Any = SilentSocket()
        graph: Any = SimpleNamespace(state=state)
        giving = asyncio.ensure_future(frames._receive(socket, graph, "a"))
        await asyncio.sleep(0)
        is_driver = ends != "another viewer drives"
        state.camera_source = "virtual" if is_driver else BROWSER
        await asyncio.wait_for(giving, 30)
        return socket.closed  # type: ignore[no-any-return]

    async def begin(_graph: Any, **_: Any) -> None:
        pass

    assert asyncio.run(give()) == (1000 if ends == "another camera is chosen" else 4403)
