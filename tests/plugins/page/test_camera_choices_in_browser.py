"""The choices next to the picture in a real browser: another camera or size while it is in use, and the threshold."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page

from handsteer.cameras import choose
from handsteer.cameras.choice import OWN
from handsteer.messages import CAMERA_CHANGED
from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.visits import NEEDS_A_BROWSER, visiting

pytestmark = NEEDS_A_BROWSER

NAMES = "[...document.querySelectorAll('#browser-camera option')].slice(1).map((each) => each.textContent)"


def test_the_browsers_camera_and_its_size_can_change_while_it_is_in_use(tmp_path: Path) -> None:
    clip, random = tmp_path / "grey.mjpeg", np.random.default_rng(0)
    # Many: a loop of few is taken for a frozen camera.
    pictures = (random.integers(80, 120, (480, 640, 3)).astype(np.uint8) for _ in range(31))
    clip.write_bytes(b"".join(cv2.imencode(".jpg", each)[1].tobytes() for each in pictures))
    with visiting("NONE:600", webcam=clip, camera={"fps": 5}) as visit:
        page, camera = visit.page, visit.graph.camera
        page.get_by_role("button", name="Use my camera").click()
        page.locator(".camera-choices summary").click()
        visit.wait_until(lambda: len(page.evaluate(NAMES)) > 0)
        visit.wait_until(lambda: visit.graph.cameras.browser.is_given)
        changes: list[str] = []
        visit.graph.transport.subscribe("test", CAMERA_CHANGED, lambda got: changes.append(got.message.data))
        for choice, value in (("browser-camera", page.evaluate(NAMES)[0]), ("browser-size", "320x240")):
            page.locator(f"#{choice}").select_option(label=value)
            page.wait_for_function("size => giving.video.videoWidth === size", arg=320 if value == "320x240" else 640)
            # Before the first frame of the other one, so that the robot waits for neutral.
            visit.wait_until(lambda: bool(changes))
            changes.clear()
            frames = camera.frames
            visit.wait_until(lambda frames=frames: camera.frames > frames + 3)  # type: ignore[misc]
            assert visit.graph.cameras.source == "browser"
        assert visit.troubles == []


TOO_SMALL = """() => [...document.querySelectorAll(".camera-choices :is(summary, select, .q-slider, .q-checkbox)")]
    .map((each) => [each.id || each.className, each.getBoundingClientRect()])
    .filter(([_, box]) => box.height > 0 && box.height < 44).map(([name]) => name)"""


def test_the_panel_covers_neither_the_hand_nor_more_than_the_screen_and_fingers_can_use_it() -> None:
    with visiting("Forward:600", camera={"fps": 5}) as visit:
        page = visit.page
        page.locator(".camera-choices summary").click()
        panel, picture = page.locator(".choices-panel"), page.locator(".camera .stage")
        for width, height in ((1440, 900), (1000, 600), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            visit.wait_until(lambda: page.evaluate("document.documentElement.scrollWidth <= innerWidth"))
            visit.wait_until(lambda width=width: page.evaluate("innerWidth") == width)  # type: ignore[misc]
            inner, hand = panel.bounding_box(), picture.bounding_box()
            assert inner is not None
            assert hand is not None
            assert inner["x"] + inner["width"] <= width
            assert inner["x"] >= hand["x"] + hand["width"] or inner["y"] >= hand["y"] + hand["height"]
            assert faults(page) == []
        assert page.evaluate(TOO_SMALL) == []


def option(page: Page, select: str) -> str:
    """Return the shown option of a list."""
    shown: str = page.locator(select).evaluate("each => each.selectedOptions[0].textContent")
    return shown


def test_the_driver_changes_the_cameras_of_the_computer_and_the_robot_waits_for_neutral(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, random = tmp_path / "clip.avi", np.random.default_rng(0)
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 5, (320, 240))
    for _ in range(5):
        video.write(random.integers(80, 120, (240, 320, 3)).astype(np.uint8))
    video.release()
    with visiting("Forward:600", camera={"source": str(path)}) as visit:
        page, graph = visit.page, visit.graph
        visit.wait_until(lambda: visit.text(".lease .role") == "you drive")
        monkeypatch.setattr(choose, "webcams", lambda: ["/dev/video97"])  # found when the panel is opened
        page.locator(".camera-choices summary").click()
        visit.wait_until(lambda: page.locator("#machine-camera option").count() == 3)
        assert option(page, "#machine-camera") == "clip.avi"
        page.locator("#machine-camera").select_option(label="/dev/video97")
        page.get_by_text("There is no webcam /dev/video97").wait_for()
        assert (option(page, "#machine-camera"), graph.cameras.source) == ("clip.avi", OWN)

        page.locator("#machine-camera").select_option(label="Virtual hand")
        visit.wait_until(lambda: visit.text(".source") == "virtual hand")
        visit.wait_until(lambda: visit.text(".camera .sign") == "Forward")
        visit.wait_until(lambda: "the camera was changed" in visit.text(".banner"))
        assert graph.robot.state.linear_mps == pytest.approx(0, abs=0.01)
        assert not page.locator("#machine-size").is_visible(), "only webcams are asked for a resolution"

        other = visit.another_page()
        other.goto(page.url)
        other.locator(".camera-choices summary").click()
        other.locator("#machine-camera").select_option(label="clip.avi")
        other.locator(".choices-panel").get_by_text("Only the driver can change it").wait_for()
        assert option(other, "#machine-camera") == "Virtual hand"
        assert graph.cameras.source == "virtual"

        page.get_by_role("button", name="Back to clip.avi").click()
        visit.wait_until(lambda: visit.text(".source") == "clip.avi")
        visit.wait_until(lambda: option(page, "#machine-camera") == "clip.avi")
        assert visit.troubles == []


def test_the_threshold_changes_at_once_and_only_for_the_driver() -> None:
    with visiting("Forward:600", camera={"fps": 5}) as visit:
        page = visit.page
        page.locator(".camera-choices summary").click()
        visit.wait_until(lambda: visit.text(".lease .role") == "you drive")
        slider = page.locator(".choices-panel .q-slider__track-container")
        slider.press("ArrowRight")
        visit.wait_until(lambda: visit.graph.config.signs.min_confidence == 0.85)
        page.get_by_text("A sign counts from a confidence of 85%").wait_for()

        other = visit.another_page()
        other.goto(page.url)
        other.locator(".camera-choices summary").click()
        other.get_by_text("A sign counts from a confidence of 85%").wait_for()
        other.locator(".choices-panel .q-slider__track-container").press("ArrowLeft")
        other.get_by_text("Only the driver can change it").wait_for()
        assert visit.graph.config.signs.min_confidence == 0.85

        page.get_by_text("The camera looks the way I look").click()
        visit.wait_until(lambda: visit.graph.config.signs.swap_sides)
        visit.wait_until(lambda: other.get_by_role("checkbox", name="The camera looks").is_checked())
        assert visit.troubles == []
