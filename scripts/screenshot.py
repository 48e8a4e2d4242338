"""Makes the README's pictures of the page in headless Chromium, while a rendered hand drives the robot."""

import base64
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import chromium
import cv2
import numpy as np
from playwright.sync_api import Page
from slalom_lap import COURSE, HandsCamera, SlalomLap

from handsteer.cameras import Camera
from handsteer.config import load
from handsteer.errors import HandsteerError
from handsteer.graph import Graph
from handsteer.plugins.page.page_process import PageProcess

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
PICTURE, ANIMATION = IMAGES / "page.png", IMAGES / "drive.webp"
WIDTH, HEIGHT = 1440, 900
LARGEST_BYTES = {PICTURE: 400_000, ANIMATION: 1_000_000}
DRIVEN_M = 1.0
PATIENCE_MS = 120_000

LONGEST_S, END_MS, FRAMES_PER_S = 60.0, 1500, 6.0
SHOWN_WIDTH = 800
QUALITY = 60

SIGNS = "Forward:6 Turn Left:1 Forward:3"


def main() -> None:
    with opened({"camera": {"source": "virtual"}, "virtual_hand": {"script": SIGNS}}) as (page, graph):
        graph.start()
        take(page, PICTURE)
    camera = HandsCamera()
    with opened({"control": {"rule": "point"}, "robot": {"world": COURSE}}, camera) as (page, graph):
        graph.start()
        record_lap(page, graph, camera, ANIMATION)
    for path, largest in LARGEST_BYTES.items():
        size = path.stat().st_size
        if size > largest:
            sys.exit(f"{path} has {size} bytes, more than {largest}")
        print(f"{path}: {size} bytes")


@contextmanager
def opened(sections: dict[str, Any], camera: Camera | None = None) -> Iterator[tuple[Page, Graph]]:
    """Show the page of a graph with these parameters and that camera, which is not started."""
    config = load(base={**sections, "dashboard": {"port": 0}})
    with Graph(config, steering=False, camera=camera) as graph, chromium.playwright() as playwright:
        dashboard = PageProcess()
        url = dashboard.serve(graph)
        try:
            browser = chromium.launch(playwright)
            page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
            # The hand in full, and no first steps.
            page.add_init_script(
                "for (const name of ['demo', 'coach']) localStorage.setItem(`handsteer-${name}`, 'seen')"
            )
            page.goto(url)
            page.wait_for_selector(".world canvas")
            yield page, graph
            browser.close()
        finally:
            dashboard.stop()


def take(page: Page, path: Path) -> None:
    """Save a picture of ``page`` while the robot drives, some metres from its start, with a hand in view."""
    path.parent.mkdir(parents=True, exist_ok=True)
    page.wait_for_function(
        """metres => {
            const text = selector => document.querySelector(selector).textContent;
            return parseFloat(text(".world .foot .fact:nth-child(2) b")) >= metres
                && text(".banner .headline") === "Driving"
                && text(".camera .sign") === "Forward"
                && parseInt(text(".camera .percent")) > 90;
        }""",
        arg=DRIVEN_M,
        timeout=PATIENCE_MS,
    )
    page.screenshot(path=path)


def record_lap(page: Page, graph: Graph, camera: HandsCamera, path: Path) -> None:
    """Save ``page`` while a simulated operator drives the slalom, as an animation in real time."""
    page.locator(".world").get_by_role("button", name="Follow").click()
    lap, end_s = SlalomLap(graph, camera), time.monotonic() + LONGEST_S
    lap.start()
    try:
        animate(shots(page, lambda: time.monotonic() > end_s or is_finished(graph)), path)
    finally:
        lap.stop()
    course = graph.robot.surroundings.course
    if course is None or course.phase != "finished" or course.missed:
        sys.exit(f"the lap was not driven well: {course}; is the machine busy? Try again")


def is_finished(graph: Graph) -> bool:
    """Return whether the robot has reached the end of its course."""
    return graph.robot.surroundings.course is not None and graph.robot.surroundings.course.phase == "finished"


def shots(page: Page, is_over: Callable[[], bool]) -> list[tuple[float, bytes]]:
    """Return the pictures of ``page`` until a second after ``is_over``, each with its time in seconds."""
    frames: list[tuple[float, bytes]] = []
    has_ended = False
    devtools = page.context.new_cdp_session(page)

    def keep(frame: dict[str, Any]) -> None:
        frames.append((frame["metadata"]["timestamp"], base64.b64decode(frame["data"])))
        if not has_ended:
            devtools.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})

    devtools.on("Page.screencastFrame", keep)
    devtools.send("Page.startScreencast", {"format": "jpeg", "quality": 95, "maxWidth": WIDTH, "maxHeight": HEIGHT})
    while not is_over():
        page.wait_for_timeout(50)
    page.wait_for_timeout(END_MS)
    has_ended = True
    devtools.send("Page.stopScreencast")
    devtools.detach()
    return thinned(frames)


def thinned(frames: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
    """Return ``frames``, each with its time in seconds, without those that follow another too soon."""
    kept = frames[:1]
    for frame in frames:
        if frame[0] - kept[-1][0] >= 1 / FRAMES_PER_S:
            kept.append(frame)
    return kept


def animate(frames: list[tuple[float, bytes]], path: Path) -> None:
    """Save JPEG files, each with its time in seconds, as an animated WebP."""
    animation = cv2.Animation()
    animation.frames = [small(jpeg) for _, jpeg in frames]
    durations_ms = [round(1000 * (after - before)) for (before, _), (after, _) in pairwise(frames)]
    animation.durations = [*durations_ms, 1000]
    cv2.imwriteanimation(str(path), animation, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])


def small(jpeg: bytes) -> np.ndarray:
    """Return a JPEG file's picture at the animation's size, with the alpha channel that the format requires."""
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    height = round(picture.shape[0] * SHOWN_WIDTH / picture.shape[1])
    return cv2.cvtColor(cv2.resize(picture, (SHOWN_WIDTH, height), interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2BGRA)


if __name__ == "__main__":
    try:
        main()
    except (HandsteerError, FileNotFoundError) as error:
        sys.exit(str(error))
