"""A page that tests ask things of."""

import http.client
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any
from unittest import mock
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from handsteer.clock import RealClock
from handsteer.config import DashboardConfig
from handsteer.graph import Graph
from handsteer.images import image_message
from handsteer.messages import DIAGNOSTICS, IMAGE_DRAWN, IMAGE_LANDMARKS, Header
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.page_process import PageProcess
from handsteer.plugins.page.remote_graph import GraphServer, RemoteGraph
from handsteer.plugins.page.server import Dashboard
from handsteer.transports import child
from handsteer.transports.in_process import InProcessTransport
from tests.plugins.page.network import cookies_of
from tests.preloaded import Preloaded
from tests.transports.test_piped import joined

PATIENCE_S = 20.0


@contextmanager
def remote(graph: Graph) -> Iterator[RemoteGraph]:
    """Give ``graph`` as a page in another process has it; here both ends of the pipe are in this one."""
    here, there = joined()
    server, page = GraphServer(here, graph), RemoteGraph(there)
    here.start()
    there.start()
    page.join()
    page.steering.start()
    try:
        yield page
    finally:
        page.steering.stop()
        there.close()
        server.close()


class Site:
    """A page that is served, and a camera picture, its drawing all black, that are published as long as the site is."""

    def __init__(self, **config: Any) -> None:
        self.clock = RealClock()
        self.transport = InProcessTransport()
        self.steering = SteeringNode(self.transport, self.clock)
        self.dashboard = Dashboard(self.transport, self.clock, self.steering, DashboardConfig(**{"port": 0, **config}))
        self.pictures = self.transport.advertise("hand_sign_recognition", IMAGE_LANDMARKS)
        self.drawings = self.transport.advertise("hand_sign_recognition", IMAGE_DRAWN)
        self.reports = self.transport.advertise("robot", DIAGNOSTICS)
        self.image: NDArray[np.uint8] = np.full((480, 640, 3), (40, 160, 220), np.uint8)
        self.url = self.dashboard.start()
        self.port = urlsplit(self.url).port or 0
        self._ended = threading.Event()
        self._camera = threading.Thread(target=self._publish)
        self._camera.start()

    def _publish(self) -> None:
        while not self._ended.wait(0.02):
            header = Header(self.clock.stamp(self.clock.now()), "camera")
            self.pictures.publish(image_message(self.image, header))
            self.drawings.publish(image_message(np.zeros_like(self.image), header))

    def get(self, path: str, **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request("GET", path, headers=headers)
        return connection.getresponse()

    def page(self, path: str = "/") -> tuple[str, str]:
        """Return a page, and the cookies that came with it."""
        answer = self.get(path)
        return answer.read().decode(), cookies_of(answer)

    def close(self) -> None:
        self.dashboard.stop()
        self._ended.set()
        self._camera.join()


def page_process() -> PageProcess:
    """Return a page's process that has loaded its libraries already."""
    with mock.patch.object(child, "Popen", partial(Preloaded, modules=("handsteer.plugins.page.server",))):
        return PageProcess()
