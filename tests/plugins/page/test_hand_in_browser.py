"""What the page shows of the hand in a real browser: whether it is engaged, and how it is a joystick."""

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from handsteer.control.explain import Reason
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.status import ControlStatus, RecognitionStatus
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import Site
from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, each_when_there_is_time, visiting

pytestmark = NEEDS_A_BROWSER


def seen(visit: Visit) -> NDArray[np.uint8]:
    """Return what the picture of the camera shows, (height, width, 3), BGR."""
    stage = visit.page.locator(".camera .stage img").screenshot()
    picture = cv2.imdecode(np.frombuffer(stage, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def greens(visit: Visit) -> int:
    blue, green, red = (channel.astype(int) for channel in cv2.split(seen(visit)))
    below_the_sign = slice(60, None)
    return int(((green > blue + 60) & (green > red + 60))[below_the_sign].sum())


def press_choice(visit: Visit, name: str) -> None:
    visit.page.get_by_role("button", name=name, exact=True).click()


def report(site: Site, progress: float | None) -> None:
    """Report as a control does whose hand is engaged so far; None if it is engaged."""
    reason = Reason("not_started") if progress is None else Reason("disengaged", "1")
    control = ControlStatus(reason, "signs", engaged=progress is None, engage_progress=progress or 0.0)
    for status in (control, RecognitionStatus("Stop", seen="Stop", engage_progress=0.0)):
        site.reports.publish(write_status(status, status.node, site.clock.stamp(site.clock.now())))


def test_a_ring_fills_while_an_open_palm_engages_the_hand() -> None:
    site = Site()
    try:
        with a_browser() as browser:
            page = browser.new_page(reduced_motion="reduce")
            page.set_default_timeout(PATIENCE_MS)
            page.goto(site.url)
            ring = page.locator(".engage .ring")

            def wait_until(progress: float | None, condition: Callable[[], bool]) -> None:
                for _ in range(PATIENCE_MS // 100):
                    report(site, progress)  # or it would count as silent
                    if condition():
                        return
                    page.wait_for_timeout(100)
                pytest.fail(f"waited in vain; the page says: {page.locator('body').inner_text()}")

            def is_filled(progress: float) -> bool:
                return ring.is_visible() and ring.get_attribute("aria-valuenow") == f"{100 * progress:.0f}"

            for progress in (0.0, 0.4, 0.8, 0.0):
                wait_until(progress, partial(is_filled, progress))
            wait_until(0.0, lambda: page.locator(".banner .headline").inner_text() == "Disengaged")
            assert page.locator(".banner .reason").inner_text() == "Hold an open palm for 1 s to begin"
            assert page.get_by_role("progressbar", name="Engaged", exact=True).is_visible()
            assert ring.evaluate("ring => getComputedStyle(ring).transitionProperty") == "none"
            assert faults(page) == []
            wait_until(None, lambda: not page.locator(".engage").is_visible())
            wait_until(None, lambda: page.locator(".banner .headline").inner_text() == "Standing")
    finally:
        site.close()


def test_nothing_is_said_of_engaging_with_a_simulated_robot_and_the_mode_is_switched_on_the_page() -> None:
    with visiting("Stop:600") as visit:
        page = visit.page
        visit.wait_until(lambda: visit.text(".camera .sign") == "Stop")
        assert page.locator(".engage").is_hidden()
        assert visit.text(".legend h2") == "The signs"
        press_choice(visit, "Joystick")
        visit.wait_until(lambda: visit.text(".legend h2") == "The hand as a joystick")
        assert page.locator(".legend .name").all_inner_texts() == ["Open the hand", "Close the fist", "Move it"]
        assert visit.graph.config.control.mode == "joystick"
        visit.wait_until(lambda: page.locator(".mux .chip").last.inner_text() == "Joystick")
        assert faults(page) == []

        press_choice(visit, "Signs")
        visit.wait_until(lambda: visit.graph.config.control.mode == "signs")
        page.goto(page.url.rstrip("/") + "/settings")
        page.get_by_label("control.mode", exact=True).click()
        page.get_by_role("option", name="joystick").click()
        visit.wait_until(lambda: visit.graph.config.control.mode == "joystick")
        page.goto(page.url.removesuffix("settings"))
        visit.wait_until(lambda: visit.text(".legend h2") == "The hand as a joystick")
        assert page.get_by_role("button", name="Joystick", exact=True).get_attribute("aria-pressed") == "true"
        assert visit.troubles == []


@pytest.mark.parametrize("handedness", ["Right", *each_when_there_is_time("Left")])
def test_the_hand_drives_as_a_joystick_and_the_picture_shows_the_stick(handedness: str) -> None:
    with visiting(
        # Often, for a busy machine: a pause in the frames ends the hold until the hand is opened again.
        "Stop:2 Go:1 Go@0.03,-0.06:0.5 Go@0.06,-0.06:8",
        control={"mode": "joystick"},
        virtual_hand={"handedness": handedness},
        camera={"width": 640, "height": 480, "fps": 10},
        robot={"world": "empty"},  # on a busy machine it drives far
    ) as visit:
        visit.page.get_by_role("button", name="Keep watching").click()  # which covers the picture
        visit.wait_until(lambda: visit.text(".camera .sign") == "Stop")
        palm = greens(visit)  # its ring
        reason = "Driven by the hand as a joystick"
        visit.wait_until(lambda: visit.text(".banner .reason") == reason and visit.text(".mux .holds") == "Joystick")
        visit.wait_until(lambda: greens(visit) > palm + 60)
        visit.wait_until(lambda: visit.text(".world .fact b") == "the demo hand")
        visit.wait_until(lambda: visit.text(".sign-tile.seen .name") == "Move it")
        state = visit.graph.robot
        visit.wait_until(lambda: state.state.linear_mps > 0.1 and state.state.angular_radps < -0.3)
        assert visit.troubles == []
