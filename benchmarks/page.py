"""Cost of the page, and the time in which the robot stops after its driver is gone.

Run ``python benchmarks/page.py``, optionally with the names of parts: ``opening``, ``bytes``, ``viewers``, ``deaf``,
``gone``. The whole graph runs in this process, its page in another, at 640x480 and 30 frames per second. A real
Chromium measures bytes and times. The cost of viewers is measured with simple clients in their own process, which
receive pictures, metrics, the 3D view and the plots like a browser but draw nothing, because drawing on the same
processors would dominate. For the same reason the camera is then a film of the virtual hand; ``--camera virtual``
draws it live. Rounds without, with one and with four viewers alternate, so that a busy machine slows all alike.
"""

import argparse
import asyncio
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import socketio
from playwright.sync_api import Browser, Page

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the relay and the browser that the tests use

from _measuring import resident_mb
from scripts import chromium
from tests.plugins.page.network import Relay, client_of, cookies_of, deaf, deaf_page, drawn, join_query

from handsteer.clock import SteppedClock
from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, Twist
from handsteer.nodes.timing import LatencyLog
from handsteer.plugins.page.page_process import PageProcess
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.transports.base import Received

LIMIT_BYTES_PER_S = 2_000_000
LIMIT_SLOWER = 0.10
LIMIT_STOP_MS = 500
PATIENCE_S = 60.0
SETTLED_S = 1.0
# The state of the robot, the camera's picture, the world and the pad are there.
USABLE = """() => {
    const picture = document.querySelector(".camera img");
    const ready = picture?.naturalWidth > 0 && document.querySelector(".world canvas") && document.querySelector(".pad")
        && document.querySelector(".banner .headline")?.textContent !== "Starting";
    if (ready) window.usable ??= performance.now();
    return ready;
}"""
PAINTED = "() => performance.getEntriesByName('first-contentful-paint').length"
DRIVE = "Forward:3 Turn Left:3 Stop:2"
FILM_S, FILM_FPS = 8, 30
ACK_PERIOD_S = 3.0  # as NiceGUI's own script does


class ServedPage:
    """A graph and its page, with a record of its messages.

    Args:
        script: Signs of the virtual hand.
        camera: A film of it, or ``virtual``.
    """

    def __init__(self, script: str, camera: str) -> None:
        settings = {
            "camera": {"source": camera},
            "virtual_hand": {"script": script, "background": "cluttered"},
            "dashboard": {"port": 0},
        }
        self.graph = Graph(load(None, None, settings), steering=False)
        self.commands: list[tuple[float, float]] = []
        self.graph.transport.subscribe("benchmark", CMD_VEL, self._on_command)
        self._page = PageProcess()
        self.url = self._page.serve(self.graph)
        self.port = urlsplit(self.url).port or 0
        self.process = str(self._page.process.pid)
        self.graph.start()

    def close(self) -> None:
        self.graph.stop()
        self._page.stop()

    def _on_command(self, received: Received[Twist]) -> None:
        self.commands.append((time.monotonic(), received.message.linear.x))

    def stands_since_s(self) -> float:
        """Return the time of the last change to zero commands; infinity while the robot is commanded to move."""
        commands = list(self.commands)
        moves = [number for number, (_, speed) in enumerate(commands) if speed]
        return commands[moves[-1] + 1][0] if moves[-1] + 1 < len(commands) else math.inf

    def recognise(self, duration_s: float) -> tuple[float, float]:
        """Return recognised frames per second, and the median time per frame in ms, over ``duration_s``."""
        recognition = self.graph.recognition
        recognition.processing = processing = LatencyLog()
        began_s, before = time.monotonic(), sum(recognition.counts.values())
        time.sleep(duration_s)
        frames = sum(recognition.counts.values()) - before
        return frames / (time.monotonic() - began_s), processing.percentile_ms(50)


@contextmanager
def served(script: str, camera: str = "virtual") -> Iterator[ServedPage]:
    graph = ServedPage(script, camera)
    try:
        yield graph
    finally:
        graph.close()


def film(path: Path, script: str, fps: int = FILM_FPS) -> None:
    """Record a film of the virtual hand with ``script``."""
    clock = SteppedClock()
    config = load(None, None, {"virtual_hand": {"script": script, "background": "cluttered"}}).virtual_hand
    hand = VirtualHandCamera(config, width=640, height=480, fps=fps, clock=clock)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, (640, 480))
    for _ in range(FILM_S * fps):
        writer.write(hand.read().image)
        clock.advance(1 / fps)
    writer.release()


@contextmanager
def browser() -> Iterator[Browser]:
    with chromium.playwright() as playwright:
        chrome = chromium.launch(playwright)
        try:
            yield chrome
        finally:
            chrome.close()


def visit(chrome: Browser, port: int) -> Page:
    page = chrome.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_S * 1000)
    page.goto(f"http://127.0.0.1:{port}/")
    page.locator(".pad").wait_for()
    return page


def load_now() -> str:
    return f"load {os.getloadavg()[0]:.1f}"


def time_opening(trials: int) -> None:
    """Print how long a browser that has never seen the page takes to paint it, and until one can drive with it."""
    times: list[tuple[float, float]] = []
    with served(DRIVE) as page, browser() as chrome:
        time.sleep(3.0)
        for _ in range(trials):
            tab = chrome.new_context(viewport={"width": 1440, "height": 900}).new_page()
            tab.goto(page.url)
            tab.wait_for_function(USABLE, timeout=PATIENCE_S * 1000, polling=20)
            # Noted by the browser when the frame is on the screen, which may be later than the elements are there.
            tab.wait_for_function(PAINTED, timeout=PATIENCE_S * 1000)
            times.append(tab.evaluate("[performance.getEntriesByName('first-contentful-paint')[0].startTime, usable]"))
            tab.context.close()
    (paint, usable), (latest_paint, latest_usable) = np.median(times, axis=0), np.max(times, axis=0)
    print(
        f"opening: first paint after {paint / 1e3:.2f} s (at most {latest_paint / 1e3:.2f}, limit 1), usable after "
        f"{usable / 1e3:.2f} s (at most {latest_usable / 1e3:.2f}, limit 2.5), {trials} visits, {load_now()}"
    )


def count_bytes(duration_s: float) -> None:
    """Print the bytes sent to a real browser, and to a simple client that takes every picture under any load."""
    with served(DRIVE) as page, Relay(page.port) as relay:
        with browser() as chrome:
            visit(chrome, relay.port)
            print_bytes("a browser", page, relay, duration_s)
        with plain_viewers(relay.port, 1):
            print_bytes("a simple client", page, relay, duration_s)


def print_bytes(who: str, page: ServedPage, relay: Relay, duration_s: float) -> None:
    time.sleep(3.0)
    sent, began_s = relay.to_browser, time.monotonic()
    fps, _ = page.recognise(duration_s)
    rate = (relay.to_browser - sent) / (time.monotonic() - began_s)
    print(
        f"bytes: {rate / 1e6:.2f} MB/s to {who} at {fps:.1f} recognised frames/s (limit "
        f"{LIMIT_BYTES_PER_S / 1e6:.0f}), {load_now()}"
    )


@contextmanager
def plain_viewers(port: int, count: int) -> Iterator[None]:
    """Run ``count`` viewers in their own process."""
    if not count:
        yield
        return
    command = [sys.executable, __file__, "--look", str(port), str(count)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin
        assert process.stdout
        assert process.stdout.readline().strip() == b"looking"
        try:
            yield
        finally:
            process.stdin.close()


def count_viewers(rounds: int, duration_s: float, camera: str) -> None:
    """Print how much viewers slow the recognition."""
    figures: dict[int, list[tuple[float, float]]] = {0: [], 1: [], 4: []}
    with served(DRIVE, camera) as page:
        time.sleep(3.0)
        for number in range(rounds):
            for count in list(figures)[:: 1 if number % 2 else -1]:
                with plain_viewers(page.port, count):
                    time.sleep(1.0)
                    figures[count].append(page.recognise(duration_s))
    base_fps, base_ms = np.median(figures[0], axis=0)
    for count, each in figures.items():
        fps, ms = np.median(each, axis=0)
        ratios = [ms_with / ms_without for (_, ms_with), (_, ms_without) in zip(each, figures[0], strict=True)]
        print(
            f"{count} viewers: {fps:5.1f} frames/s ({fps / base_fps - 1:+.1%}), {ms:5.1f} ms a frame "
            f"({ms / base_ms - 1:+.1%}; by round {' '.join(f'{ratio - 1:+.0%}' for ratio in ratios)})"
        )
    print(f"(limit for 4: {LIMIT_SLOWER:.0%} slower; {rounds} rounds of {duration_s:.0f} s each, {load_now()})")


def count_deaf(rounds: int, duration_s: float, camera: str) -> None:
    """Print the cost of viewers that do not read, next to one that does."""
    figures: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    with served(DRIVE, camera) as page, plain_viewers(page.port, 1):
        time.sleep(5.0)
        before_mb = resident_mb()
        for _ in range(rounds):
            for with_deaf, measured in figures.items():
                with ExitStack() as stack:
                    for _ in range(4 if with_deaf else 0):
                        stack.enter_context(deaf(page.port, "/camera.mjpg"))
                        with urllib.request.urlopen(page.url) as answer:
                            stack.enter_context(deaf_page(page.port, answer.read().decode(), cookies_of(answer)))
                    time.sleep(1.0)
                    measured.append(page.recognise(duration_s))
        grown_mb = resident_mb() - before_mb
    (fps, ms), (deaf_fps, deaf_ms) = (np.median(each, axis=0) for each in figures.values())
    print(
        f"4 who read nothing: {deaf_fps:.1f} frames/s ({deaf_fps / fps - 1:+.1%}), {deaf_ms:.1f} ms a frame "
        f"({deaf_ms / ms - 1:+.1%}), {grown_mb:+.1f} MB after {rounds} times; {load_now()}"
    )


def count_gone(trials: int) -> None:
    """Print the time from the loss of the driver to the first zero command."""
    times: dict[str, list[float]] = {"tab closed": [], "network lost": []}
    with served("NONE:3600") as served_page, browser() as chrome:
        for _ in range(trials):
            for how, each in times.items():
                gone_ms = stop_ms(served_page, chrome, how)
                if gone_ms is not None:
                    each.append(gone_ms)
    for how, each in times.items():
        low, median, high = np.percentile(each, (0, 50, 100))
        print(
            f"{how}: zero is commanded after {low:.0f} / {median:.0f} / {high:.0f} ms (least, median, most of "
            f"{len(each)}; limit {LIMIT_STOP_MS}), {load_now()}"
        )


def stop_ms(graph: ServedPage, chrome: Browser, how: str) -> float | None:
    """Return the time from the loss of the driver to the first zero command; None if the robot did not drive."""
    with Relay(graph.port) as relay:
        page = visit(chrome, relay.port)
        page.locator(".pad").focus()
        page.keyboard.down("ArrowUp")
        if not comes_true(lambda: bool(graph.commands) and graph.commands[-1][1] > 0.1):
            page.close()  # the browser was too busy to repeat the key
            return None
        page.wait_for_timeout(float(np.random.default_rng().uniform(300, 800)))
        gone_s, was_moving = time.monotonic(), graph.commands[-1][1] > 0
        if how == "tab closed":
            page.close()
        else:
            relay.freeze()
        if not comes_true(lambda: graph.stands_since_s() < time.monotonic() - SETTLED_S):
            sys.exit("the robot drives on without its driver")
        zero_s = graph.stands_since_s()
        if not page.is_closed():
            page.close()
    graph.commands.clear()
    return (zero_s - gone_s) * 1000 if was_moving and zero_s > gone_s else None


def comes_true(condition: Callable[[], bool], within_s: float = 15.0) -> bool:
    end_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.01)
    return True


def look(port: int, count: int) -> None:
    """View the page ``count`` times until the input ends."""
    joined = threading.Semaphore(0)
    for _ in range(count):
        threading.Thread(target=read_pictures, args=(port,), daemon=True).start()
        threading.Thread(target=lambda: asyncio.run(read_page(port, joined)), daemon=True).start()
    for _ in range(count):
        joined.acquire()
    print("looking", flush=True)
    sys.stdin.read()
    os._exit(0)


def read_pictures(port: int) -> None:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/camera.mjpg") as pictures:
        while pictures.read1(65536):
            pass


async def read_page(port: int, joined: threading.Semaphore) -> None:
    """Connect to the page as its own script does, and receive its messages."""
    address = f"http://127.0.0.1:{port}"
    with urllib.request.urlopen(address) as answer:
        html, cookies = answer.read().decode(), cookies_of(answer)
    client = client_of(html)
    page = socketio.AsyncClient()
    newest = 0

    async def take(_event: str, message: object) -> None:
        nonlocal newest
        if isinstance(message, dict):
            newest = message.get("_id", newest)

    page.on("*", take)
    await page.connect(
        f"{address}?{join_query(client)}",
        headers={"Cookie": cookies},
        transports=["websocket"],
        socketio_path="/_nicegui_ws/socket.io",
    )
    for event in drawn(html):
        await page.emit("event", event)
    joined.release()
    while True:
        await page.sleep(ACK_PERIOD_S)
        await page.emit("ack", {"client_id": client, "next_message_id": newest + 1})


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the cost of the page.")
    parser.add_argument("parts", nargs="*", help="opening, bytes, viewers, deaf, gone; all of them by default")
    parser.add_argument("--rounds", type=int, default=5, help="rounds per number of viewers")
    parser.add_argument("--duration", type=float, default=10.0, help="seconds per measurement")
    parser.add_argument("--trials", type=int, default=20, help="trials per kind of loss")
    parser.add_argument("--look", nargs=2, type=int, metavar=("PORT", "COUNT"), help=argparse.SUPPRESS)
    parser.add_argument(
        "--camera", choices=("film", "virtual"), default="film", help="camera for the parts viewers and deaf"
    )
    options = parser.parse_args()
    if options.look:
        look(*options.look)
    with tempfile.TemporaryDirectory() as folder:
        camera = options.camera
        if camera == "film":
            camera = str(Path(folder) / "film.avi")
            film(Path(camera), DRIVE)
        parts = {
            "opening": lambda: time_opening(options.rounds),
            "bytes": lambda: count_bytes(2 * options.duration),
            "viewers": lambda: count_viewers(options.rounds, options.duration, camera),
            "deaf": lambda: count_deaf(options.rounds, options.duration, camera),
            "gone": lambda: count_gone(options.trials),
        }
        for part in options.parts or parts:
            parts[part]()


if __name__ == "__main__":
    main()
