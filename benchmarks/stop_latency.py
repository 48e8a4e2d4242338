"""Time from a press of Stop to the robot's Stop, while viewers open pages.

Run ``python benchmarks/stop_latency.py``. The page is in a process of its own, as in ``handsteer run``; other processes
open Settings one after the other. Each trial presses Stop by the page's websocket, or by the request that the page's
script sends too, at a planned time, and waits for ``/stop`` in the graph's process. The browser itself is not measured.
"""

import argparse
import contextlib
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
from _measuring import resident_mb
from websockets.exceptions import ConnectionClosed

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the websocket that the tests use

from tests.plugins.page.sockets import PageSocket, events_of
from tests.plugins.page.test_front import press

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import STOP, Bool
from handsteer.plugins.page.page_process import PageProcess
from handsteer.transports.base import Received

LOST_S = 10.0
PAUSE_S = 0.3
OPENER = """
import sys, time, urllib.request
while True:
    urllib.request.urlopen(sys.argv[1], timeout=60).read()
    time.sleep(float(sys.argv[2]))
"""


class Served:
    """The page of a graph that does not run, and how its Stop arrives; has what the tests' clients need of a site."""

    def __init__(self) -> None:
        config = load(base={"camera": {"source": "virtual", "fps": 15}, "dashboard": {"port": 0}})
        self.graph = Graph(config, steering=False)
        self._page = PageProcess()
        self.url = self._page.serve(self.graph)
        self.process = self._page.process.pid
        self.port = urlsplit(self.url).port or 0
        self.stopped = threading.Event()
        self.graph.transport.subscribe("benchmark", STOP, self._on_stop)

    def open_page(self) -> tuple[str, str]:
        with urllib.request.urlopen(f"{self.url}/", timeout=60) as answer:
            cookies = "; ".join(each.partition(";")[0] for each in answer.headers.get_all("Set-Cookie", []))
            return answer.read().decode(), cookies

    def close(self) -> None:
        self.graph.__exit__()
        self._page.stop()

    def _on_stop(self, received: Received[Bool]) -> None:
        if received.message.data:
            self.stopped.set()


def stay(page: PageSocket) -> None:
    """Read what the page sends and answer its pings, as a browser does."""
    with contextlib.suppress(ConnectionClosed, TimeoutError):
        page.read_on()


def trial(site: Served, ask: threading.Event) -> float:
    site.stopped.clear()
    began_s = time.perf_counter()
    ask.set()
    return time.perf_counter() - began_s if site.stopped.wait(LOST_S) else np.inf


def measure(site: Served, trials: int, openers: int) -> None:
    html, cookies = site.open_page()
    with PageSocket(site, html, cookies) as page:  # type: ignore[arg-type]
        element, listener = events_of(html)["space"][0]
        event = {"id": element, "client_id": page.client, "listener_id": listener, "args": ["{}"]}
        threading.Thread(target=stay, args=[page], daemon=True).start()
        command = [sys.executable, "-c", OPENER, f"{site.url}/settings", "0.2"]
        others = [subprocess.Popen(command) for _ in range(openers)]
        time.sleep(2.0)
        ways: dict[str, Callable[[], object]] = {"websocket": lambda: page.say("event", event)}
        ways["request"] = lambda: press(site, page.client, cookies, "")  # type: ignore[arg-type]
        try:
            for way, say in ways.items():
                delays = []
                for _ in range(trials):
                    ask = threading.Event()
                    threading.Thread(target=lambda ask=ask, say=say: ask.wait() and say(), daemon=True).start()
                    delays.append(trial(site, ask))
                    time.sleep(PAUSE_S)
                p50, p99 = np.percentile(delays, (50, 99))
                lost = np.isinf(delays).sum()
                memory = f"page's process {resident_mb(str(site.process)):.0f} MB"
                print(
                    f"{openers} open pages, {way}: median {1e3 * p50:.0f} ms, 99 % {1e3 * p99:.0f} ms, "
                    f"longest {1e3 * max(delays):.0f} ms, lost {lost} of {trials}, {memory}",
                    flush=True,
                )
        finally:
            for other in others:
                other.kill()


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--trials", type=int, default=50)
    arguments.add_argument("--openers", type=int, nargs="+", default=[0, 1, 4])
    given = arguments.parse_args()
    site = Served()
    try:
        for openers in given.openers:
            measure(site, given.trials, openers)
    finally:
        site.close()


if __name__ == "__main__":
    main()
