"""A sign is taught on the page in a real browser, from a real clip that it takes for its webcam."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Locator, TimeoutError, ViewportSize

from handsteer.cameras import freshness
from handsteer.cameras.files import video_frames
from handsteer.config import load
from handsteer.plugins.page.lessons import with_signs
from handsteer.plugins.teach.dataset import load_dataset
from handsteer.plugins.teach.exchange import LARGEST_SHARED_BYTES
from handsteer.plugins.teach.onnx_file import as_onnx
from handsteer.recognition.custom_signs import load_custom_model
from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.visits import IN_LANGUAGES_AND_SIZES, NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

pytestmark = NEEDS_A_BROWSER

TRAINING_MS = 5 * PATIENCE_MS
EMPTY_FRAMES = 60
MOST_CLICKS = 8
PRESSES = 5


@pytest.fixture
def two_fingers(data_dir: Path, tmp_path: Path) -> Path:
    """Write the part of a real clip in which two fingers are shown as a file that Chromium takes for a webcam."""
    path = tmp_path / "two.mjpeg"
    with path.open("wb") as out:
        for frame in video_frames(data_dir / "videos" / "CoderEnko007_hand_544x960.mp4"):
            if 2.4 <= frame.captured_s < 4.2:
                out.write(cv2.imencode(".jpg", landscape(frame.image))[1].tobytes())
        # Without a hand for longer than neutral takes: each camera has to see it first.
        empty, random = np.full((480, 640, 3), 110, np.uint8), np.random.default_rng(0)
        for _ in range(EMPTY_FRAMES):
            noisy = empty + random.integers(0, 9, empty.shape).astype(np.uint8)
            out.write(cv2.imencode(".jpg", noisy)[1].tobytes())
    return path


def landscape(image: np.ndarray) -> np.ndarray:
    """Return ``image`` in the middle of one of 640x480."""
    small = cv2.resize(image, (272, 480), interpolation=cv2.INTER_AREA)
    return cv2.copyMakeBorder(small, 0, 0, 184, 184, cv2.BORDER_REPLICATE)


@pytest.fixture
def plan(tmp_path: Path) -> dict[str, Any]:
    files = {"dataset": tmp_path / "signs.npz", "model": tmp_path / "mine.npz"}
    return {**files, "takes": 2, "take_time": 1.5, "countdown": 0.5}


@pytest.fixture
def visit(plan: dict[str, Any]) -> Iterator[Visit]:
    with visiting("Peace:600", "/teach", teach=plan) as visit:
        yield visit


def press(visit: Visit, name: str) -> None:
    visit.page.locator(".lesson").get_by_role("button", name=name, exact=True).click()


def begin(visit: Visit, name: str) -> Locator:
    """Begin a lesson, add a sign, and return its card."""
    press(visit, "Start a lesson")
    own = visit.page.locator(".class.own")
    own.first.wait_for()
    count = own.count()
    visit.page.get_by_label("Name of the sign").fill(name)
    press(visit, "Add the sign")
    own.nth(count).wait_for()
    return own.nth(count - 1)  # the last one is the background


def hold(visit: Visit, card: Locator) -> None:
    """Record a take of a second or so while the button is held; a card that moves at that moment is pressed again."""
    count = card.locator(".take").count()
    for _ in range(PRESSES):
        card.locator(".hold").hover()
        visit.page.mouse.down()
        with suppress(TimeoutError):
            visit.page.locator(".countdown").wait_for(timeout=PATIENCE_MS / PRESSES)
            break
        visit.page.mouse.up()
    wait_for_hands(visit)
    visit.page.mouse.up()
    card.locator(".take").nth(count).wait_for()


def wait_for_hands(visit: Visit) -> None:
    visit.page.locator(".countdown").wait_for()
    visit.wait_until(lambda: (words := visit.text(".countdown .number")).isdecimal() and int(words) >= 8)


def percent(card: Locator) -> int:
    return int(card.locator(".bar .percent").inner_text().split()[0])


def test_a_sign_is_taught_from_the_browsers_webcam_and_drives(
    two_fingers: Path, plan: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # Chromium repeats a clip in place of a webcam, whose pictures never repeat.
    monkeypatch.setattr(freshness, "_PICTURES", 8)
    # A machine that draws the world in software, and has little time, is slow to send its camera's frames.
    patient: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
    with visiting("NONE:600", "/teach", webcam=two_fingers, teach=plan, **patient) as visit:
        visit.page.get_by_role("button", name="Use my camera").click()
        visit.wait_until(lambda: visit.graph.cameras.browser.is_given)  # its first picture moves the cards
        card = begin(visit, "Zwei")
        teach(visit, card)
        keep(visit, card, tmp_path)
        always(visit, tmp_path / "handsteer.yaml")
        drive(visit)
        assert visit.troubles == []
    with visiting("Peace:600", "/teach", teach={**plan, "dataset": tmp_path / "b.npz"}) as visit:
        (tmp_path / "mine.npz").unlink()
        use_file(visit, tmp_path / "shared.npz")


GERMAN = {
    "Use my camera": "Meine Kamera nutzen",
    "Teach": "Lehren",
    "Start a lesson": "Lektion beginnen",
    "Name of the sign": "Name des Zeichens",
    "2 timed takes": "2 Aufnahmen mit Timer",
    "Train": "Trainieren",
    "forward": "vorwärts",
    "Keep and drive": "Behalten und fahren",
    "Reset": "Zurücksetzen",
}
COUNT_CLICKS = (
    "addEventListener('click', (event) => { if (event.isTrusted) "
    "sessionStorage.setItem('clicks', 1 + Number(sessionStorage.getItem('clicks'))); }, true)"
)


WIDER = """[...document.querySelectorAll(".class .buttons")]
    .filter((row) => row.scrollWidth > row.clientWidth + 1).map((row) => row.innerText)"""
"""The rows of a card's buttons that are wider than the card."""
LANGUAGES = {"en-US": {words: words for words in GERMAN}, "de-DE": GERMAN}


@pytest.mark.parametrize(("locale", "size"), IN_LANGUAGES_AND_SIZES)
def test_a_teachers_sign_drives_in_eight_clicks(
    locale: str, size: ViewportSize, two_fingers: Path, plan: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = LANGUAGES[locale]
    monkeypatch.setattr(freshness, "_PICTURES", 8)
    patient: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
    with visiting("NONE:600", webcam=two_fingers, locale=locale, teach=plan, **patient) as visit:
        page, robot = visit.page, visit.graph.robot
        page.set_viewport_size(size)
        page.add_init_script(COUNT_CLICKS)
        page.evaluate(COUNT_CLICKS)

        def click(name: str) -> None:
            page.get_by_role("button", name=words[name], exact=True).first.click()

        click("Use my camera")
        page.get_by_role("link", name=words["Teach"], exact=True).click()
        click("Start a lesson")
        page.get_by_label(words["Name of the sign"]).fill("Zwei")
        page.get_by_label(words["Name of the sign"]).press("Enter")
        page.locator(".class.own").nth(1).wait_for()  # next to that of the background
        click("2 timed takes")
        page.locator(".class.own").first.locator(".take").nth(1).wait_for()
        assert page.evaluate(WIDER) == []
        click("Train")
        page.locator(".recalls li", has_text="Zwei").wait_for(timeout=TRAINING_MS)
        click("forward")
        click("Keep and drive")
        page.locator(".sign-tile", has_text="Zwei").wait_for()
        page.locator(".banner").get_by_role("button", name=words["Reset"]).click()  # its label says more
        visit.wait_until(lambda: robot.state.linear_mps > 0.02 and "Zwei" in visit.text(".banner"))
        assert int(page.evaluate("sessionStorage.getItem('clicks')")) <= MOST_CLICKS
        assert visit.graph.config.control.actions == {"Zwei": "forward"}
        assert visit.troubles == []


def teach(visit: Visit, card: Locator) -> None:
    page = visit.page
    hold(visit, card)
    hold(visit, card)
    card.get_by_role("button", name="1 timed take").click()
    card.locator(".take").nth(2).wait_for()
    card.locator(".take .delete").first.click()
    card.locator(".take").nth(2).wait_for(state="detached")
    press(visit, "Undo: delete a take of Zwei")
    card.locator(".take").nth(2).wait_for()
    name = card.get_by_label("Name")
    name.fill("Two")
    name.press("Enter")
    card.get_by_role("heading", name="Two").wait_for()
    assert card.locator(".take svg.landmarks .finger").count() == 15
    assert percent(card) == 0, "nothing is learnt yet"
    assert not page.get_by_role("link", name="Download the model as ONNX").is_visible(), "there is no model yet"
    press(visit, "Train")
    page.get_by_role("progressbar", name="Training").wait_for()


def keep(visit: Visit, card: Locator, folder: Path) -> None:
    page, graph = visit.page, visit.graph
    page.locator(".recalls li", has_text="Two").wait_for(timeout=TRAINING_MS)
    visit.wait_until(lambda: percent(card) >= 80 and visit.text(".opinion .sign").startswith("Two"))
    press(visit, "Keep")
    page.locator(".tools .message", has_text="Choose first what the robot does at Two").wait_for()
    card.get_by_role("button", name="turn left", exact=True).click()
    visit.wait_until(lambda: "turns faster to the left" in visit.text(".opinion"))
    assert graph.config.signs.model is None, "nothing is in use before it is kept"
    with page.expect_download() as download:
        page.get_by_role("link", name="Download takes and model").click()
    download.value.save_as(folder / "shared.npz")
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the takes as a table").click()
    assert download.value.path().read_text().startswith("label,person,session,take,time_s")
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the model as ONNX").click()
    exported = download.value.path().read_bytes()
    press(visit, "Keep")
    page.locator(".tools .message", has_text="Kept, and in use").wait_for()
    assert [take.label for take in load_dataset(folder / "signs.npz").takes] == ["Two"] * 3
    learnt = load_custom_model(folder / "mine.npz")
    assert learnt.labels == ("Two",)
    assert exported == as_onnx(learnt)
    page.get_by_role("button", name="Reset").click()
    page.locator(".tools .message", has_text="stands until the lesson is over").wait_for()
    assert visit.text(".banner .headline") == "Stopped"
    assert visit.text(".banner .reason") == "For the lesson, until you reset it"
    press(visit, "End the lesson")
    page.locator(".taught .tile", has_text="Two").locator("svg.landmarks").wait_for()


def always(visit: Visit, file: Path) -> None:
    def kept() -> Any:
        config = load(file)
        return config.signs.model, dict(config.control.actions)

    file.write_text("control:\n  max_linear: 0.4\n")
    press(visit, "Use at every start")
    visit.page.locator(".always", has_text="Use them at every start by").wait_for()
    assert kept() == (file.with_name("mine.npz"), {"Two": "turn_left"})
    box, config = visit.page.locator(".always"), visit.graph.config
    visit.graph.reconfigure(with_signs(config, config.signs.model, {"Two": "stop"}))
    box.filter(has_text="has other actions for these signs").wait_for()
    press(visit, "Use at every start")
    box.filter(has_text="Use them at every start by").wait_for()
    assert kept() == (file.with_name("mine.npz"), {"Two": "stop"})
    visit.graph.reconfigure(with_signs(config, None, {}, ["Two"]))
    box.filter(has_text="names taught signs that are not in use").wait_for()
    assert not box.get_by_role("button", name="Use at every start", exact=True).is_visible()
    visit.graph.reconfigure(config)
    box.filter(has_text="has other actions for these signs").wait_for()
    press(visit, "No longer use at every start")
    visit.page.locator(".always", has_text="until handsteer ends").wait_for()
    assert kept() == (None, {})
    assert load(file).control.max_linear == 0.4, "the rest of the file stays"


def drive(visit: Visit) -> None:
    page, robot = visit.page, visit.graph.robot
    page.set_viewport_size({"width": 480, "height": 740})
    page.get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Reset").click()
    page.locator(".banner .headline", has_text="Standing").wait_for()
    page.locator(".sign-tile", has_text="Two").locator("svg.landmarks").wait_for()
    # A webcam that has left shows nothing, not even that no hand is there: the robot's own camera does.
    page.get_by_role("button", name="Back to the virtual hand").click()
    visit.wait_until(lambda: "No hand" in visit.text(".banner") and "Ready" not in visit.text(".banner"))
    page.get_by_role("button", name="Use my camera").click()
    visit.wait_until(lambda: visit.text(".camera .sign") == "Two")
    visit.wait_until(lambda: robot.state.angular_radps > 0.2)


def use_file(visit: Visit, file: Path) -> None:
    """Use the signs that were taught in an earlier run."""
    page = visit.page
    press(visit, "Start a lesson")
    hostile = file.with_name("thesis.npz")
    hostile.write_bytes(b"my thesis")
    upload = page.locator("input[data-upload]")
    upload.set_input_files(hostile)
    page.locator(".tools .message", has_text="The file: not a file of taught signs").wait_for()
    hostile.write_bytes(bytes(LARGEST_SHARED_BYTES + 1))
    upload.set_input_files(hostile)
    page.locator(".tools .message", has_text="The file is too large").wait_for()
    upload.set_input_files(file)
    card = page.locator(".class.own").first
    card.get_by_role("heading", name="Two").wait_for()
    page.locator(".tools .message", has_text="try them, then keep them").wait_for()
    card.get_by_role("button", name="turbo", exact=True).click()
    press(visit, "Keep")
    page.locator(".tools .message", has_text="Kept, and in use").wait_for()
    assert load_custom_model(file.with_name("mine.npz")).labels == ("Two",)
    visit.wait_until(lambda: visit.graph.config.signs.model is not None)


def test_one_teaches_at_a_time_while_the_robot_stands(visit: Visit, tmp_path: Path) -> None:
    first, robot = visit.page, visit.graph.robot
    card = begin(visit, "<b>Peace</b>")
    card.get_by_role("heading", name="<b>Peace</b>").wait_for()
    first.get_by_label("Name of the sign").fill("Forward")
    press(visit, "Add the sign")
    first.locator(".tools .message", has_text="Forward is known already").wait_for()
    assert first.get_by_label("Name of the sign").input_value() == "Forward"
    assert visit.text(".banner .headline") == "Stopped"

    second = visit.another_page()
    second.goto(first.url)
    second.locator(".start .trouble", has_text="Another viewer teaches now").wait_for()
    second.get_by_role("button", name="Start a lesson").click()
    second.locator(".start .trouble", has_text="ask to drive first").wait_for()

    hold(visit, card)
    first.close()
    second.get_by_role("button", name="Continue the last lesson").wait_for()
    wait_until_over(visit)
    assert abs(robot.state.linear_mps) < 0.01
    assert list(tmp_path.iterdir()) == []
    second.get_by_role("button", name="Continue the last lesson").click()
    second.locator(".take").first.wait_for()


def wait_until_over(visit: Visit) -> None:
    waiting = threading.Event()
    for _ in range(PATIENCE_MS // 50):
        if not any(thread.name == "dashboard_lesson" for thread in threading.enumerate()):
            return
        waiting.wait(0.05)
    pytest.fail("the lesson goes on")


def test_a_lesson_is_for_all_and_fits_a_phone(visit: Visit) -> None:
    page = visit.page
    card = begin(visit, "Peace")
    hold(visit, card)
    card.locator(".hold").focus()
    page.keyboard.down("Enter")
    wait_for_hands(visit)
    page.keyboard.up("Enter")
    card.locator(".take").nth(1).wait_for()
    press(visit, "Train")
    page.locator(".recalls li").first.wait_for(timeout=TRAINING_MS)
    assert faults(page) == []
    page.locator(".theme").click()
    visit.wait_until(lambda: "body--dark" in (page.locator("body").get_attribute("class") or ""))
    assert faults(page) == []
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    small = page.evaluate(
        """[...document.querySelectorAll(".lesson .text-button")].map(button => button.getBoundingClientRect().height)
            .filter(height => height > 0 && height < 40)"""
    )
    assert small == []
    card.locator(".hold").scroll_into_view_if_needed()
    assert visit.troubles == []


def test_a_second_lesson_on_one_page_shows_each_sign_with_its_own_takes_and_action(
    visit: Visit, plan: dict[str, Any]
) -> None:
    own, page = visit.page.locator(".class.own"), visit.page
    card = begin(visit, "Peace")
    hold(visit, card)
    card.get_by_role("button", name="forward", exact=True).click()
    press(visit, "Keep")
    page.locator(".tools .message", has_text="The takes are kept").wait_for()
    press(visit, "End the lesson")
    begin(visit, "Call")
    headings = [one.get_by_role("heading").inner_text() for one in own.all()]
    assert headings == ["Peace", "Call", "Background"]
    assert own.first.locator(".take").count() == 1
    assert page.locator(".actions [aria-pressed=true]").count() == 0, "none was chosen in this lesson"
    hold(visit, own.nth(1))
    press(visit, "Keep")
    visit.wait_until(lambda: {take.label for take in load_dataset(plan["dataset"]).takes} == {"Peace", "Call"})
    assert visit.troubles == []
