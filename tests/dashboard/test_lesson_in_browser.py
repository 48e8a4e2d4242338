"""A sign is taught on the page in a real browser, from a real clip that it takes for its webcam."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handsteer.cameras.files import video_frames
from handsteer.recognition.custom_signs import load_custom_model
from handsteer.training.custom.dataset import load_dataset
from tests.dashboard.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

pytestmark = NEEDS_A_BROWSER

TRAINING_MS = 5 * PATIENCE_MS


@pytest.fixture
def two_fingers(data_dir: Path, tmp_path: Path) -> Path:
    """Write the part of a real clip in which two fingers are shown as a file that Chromium takes for a webcam."""
    path = tmp_path / "two.mjpeg"
    with path.open("wb") as out:
        for frame in video_frames(data_dir / "videos" / "CoderEnko007_hand_544x960.mp4"):
            if 2.4 <= frame.captured_s < 4.2:
                out.write(cv2.imencode(".jpg", landscape(frame.image))[1].tobytes())
    return path


def landscape(image: np.ndarray) -> np.ndarray:
    """Return ``image`` in the middle of one of 640x480."""
    small = cv2.resize(image, (272, 480), interpolation=cv2.INTER_AREA)
    return cv2.copyMakeBorder(small, 0, 0, 184, 184, cv2.BORDER_REPLICATE)


@pytest.fixture
def plan(tmp_path: Path) -> dict[str, Any]:
    files = {"dataset": tmp_path / "signs.npz", "model": tmp_path / "mine.npz"}
    return {**files, "takes": 2, "take_time": 3.0, "countdown": 1.0}


@pytest.fixture
def visit(plan: dict[str, Any]) -> Iterator[Visit]:
    with visiting("Peace:600", "/teach", teach=plan) as visit:
        yield visit


def press(visit: Visit, name: str) -> None:
    visit.page.locator(".lesson").get_by_role("button", name=name, exact=True).click()


def begin(visit: Visit, name: str) -> None:
    visit.page.get_by_label("Name of the sign").fill(name)
    press(visit, "Begin")


def test_a_sign_is_taught_from_the_browsers_webcam_and_drives(
    two_fingers: Path, plan: dict[str, Any], tmp_path: Path
) -> None:
    # A machine that draws the world in software, and has little time, is slow to send its camera's frames.
    patient: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
    with visiting("NONE:600", "/teach", webcam=two_fingers, teach=plan, **patient) as visit:
        teach(visit)
        keep(visit)
        assert [take.label for take in load_dataset(tmp_path / "signs.npz").takes] == ["Two"] * 2
        assert load_custom_model(tmp_path / "mine.npz").labels == ("Two",)
        drive(visit)
        assert visit.troubles == []


def teach(visit: Visit) -> None:
    page = visit.page
    page.get_by_role("button", name="Use my camera").click()
    begin(visit, "Two")
    press(visit, "Record")
    page.locator(".countdown").wait_for()
    page.locator(".take").nth(1).wait_for()
    press(visit, "Delete take 1")
    page.locator(".take").nth(1).wait_for(state="detached")
    press(visit, "Record")
    page.locator(".take").nth(1).wait_for()
    assert page.locator(".take img").nth(1).evaluate("image => image.naturalHeight") == 120
    press(visit, "Train")
    page.get_by_role("progressbar", name="Training").wait_for()


def keep(visit: Visit) -> None:
    page, graph = visit.page, visit.graph
    page.get_by_role("region", name="Confusion matrix").wait_for(timeout=TRAINING_MS)
    rows = page.locator(".lesson tbody tr").all_inner_texts()
    assert [row.split()[0] for row in rows] == ["Two"]
    visit.wait_until(lambda: visit.text(".opinion .sign").startswith("Two"))
    page.get_by_label("What it does").click()
    page.get_by_role("option", name="turn left").click()
    visit.wait_until(lambda: "turns faster to the left" in visit.text(".opinion"))
    assert graph.config.signs.model is None, "nothing is in use before it is kept"
    press(visit, "Keep")
    visit.wait_until(lambda: visit.text(".lesson .kept .count").startswith("Two is learnt"))
    assert "Two: turn_left" in visit.text(".lesson .lines")
    assert visit.text(".banner .headline") == "Stopped"


def drive(visit: Visit) -> None:
    page, robot = visit.page, visit.graph.robot
    page.set_viewport_size({"width": 480, "height": 740})
    page.locator(".lesson").get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Reset").click()
    page.locator(".banner .headline", has_text="Standing").wait_for()
    # A webcam that has left shows nothing, not even that no hand is there: the robot's own camera does.
    page.get_by_role("button", name="Use the robot's camera").click()
    visit.wait_until(lambda: "No hand" in visit.text(".banner") and "Ready" not in visit.text(".banner"))
    page.get_by_role("button", name="Use my camera").click()
    visit.wait_until(lambda: visit.text(".camera .sign") == "Two")
    visit.wait_until(lambda: robot.state.angular_radps > 0.2)


def test_one_teaches_at_a_time_while_the_robot_stands(visit: Visit, tmp_path: Path) -> None:
    first, robot = visit.page, visit.graph.robot
    begin(visit, "Forward")
    first.locator(".lesson .trouble", has_text="Forward is known already").wait_for()
    begin(visit, "<b>Peace</b>")
    visit.wait_until(lambda: visit.text(".lesson .title") == "<b>Peace</b>")
    first.get_by_role("button", name="Reset").click()
    first.locator(".lesson .trouble", has_text="stands until the lesson is over").wait_for()
    assert visit.text(".banner .headline") == "Stopped"

    second = visit.another_page()
    second.goto(first.url)
    second.locator(".lesson .trouble", has_text="Somebody teaches <b>Peace</b> now").wait_for()
    second.get_by_label("Name of the sign").fill("Mine")
    second.locator(".lesson").get_by_role("button", name="Begin", exact=True).click()
    second.locator(".lesson .trouble", has_text="ask to drive first").wait_for()

    press(visit, "Record")
    first.locator(".take").first.wait_for()
    first.close()
    second.locator(".lesson .trouble", has_text="Somebody teaches").wait_for(state="detached")
    wait_until_over(visit)
    assert abs(robot.state.linear_mps) < 0.01
    assert list(tmp_path.iterdir()) == []


def wait_until_over(visit: Visit) -> None:
    waiting = threading.Event()
    for _ in range(PATIENCE_MS // 50):
        if not any(thread.name == "dashboard_lesson" for thread in threading.enumerate()):
            return
        waiting.wait(0.05)
    pytest.fail("the lesson goes on")


def test_every_step_fits_a_phone(visit: Visit) -> None:
    visit.page.set_viewport_size({"width": 360, "height": 740})
    begin(visit, "Peace")
    press(visit, "Record")
    visit.page.locator(".take").first.wait_for()
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= 360
    small = visit.page.evaluate(
        """[...document.querySelectorAll(".lesson .text-button")].map(button => button.getBoundingClientRect().height)
            .filter(height => height > 0 && height < 40)"""
    )
    assert small == []
    press(visit, "Discard: end the lesson and keep nothing")
    visit.page.locator(".lesson .trouble", has_text="nothing of it was kept").wait_for()
    assert visit.troubles == []
