"""The page in a real browser, on the whole graph with the virtual hand."""

import threading
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page

from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

pytestmark = NEEDS_A_BROWSER


@pytest.fixture
def visit(request: pytest.FixtureRequest) -> Iterator[Visit]:
    with visiting(request.param, details=True) as visit:
        yield visit


@pytest.mark.parametrize("visit", ["Forward:4 Stop:3"], indirect=True)
def test_shows_what_is_seen_and_what_the_robot_does(visit: Visit) -> None:
    visit.wait_until(lambda: visit.text(".camera .sign") == "Forward")
    visit.wait_until(lambda: visit.text(".banner .headline") == "Driving")
    visit.wait_until(lambda: visit.number(".velocity .axis .value") > 0.05)
    visit.wait_until(lambda: path_shown(visit) > 0)
    assert visit.text(".world .fact b") == "the demo hand"
    visit.wait_until(lambda: visit.text(".legend .seen .name") == "Forward")
    visit.wait_until(lambda: "Standing" in visit.text(".banner") and "Stop sign" in visit.text(".banner"))
    assert visit.page.evaluate("document.querySelector('.camera img').naturalWidth") == 320
    assert drawn_objects(visit.page) > 10  # robot, obstacles and floor
    visit.wait_until(lambda: not visit.text(".timing .times").startswith("--"))
    assert visit.troubles == []


@pytest.mark.parametrize("visit", ["NONE:600"], indirect=True)
def test_drives_while_the_pad_is_held_and_stops_when_it_is_let_go(visit: Visit) -> None:
    robot = visit.graph.robot
    visit.wait_until(lambda: visit.text(".banner .reason") == "No hand is in view")
    pad = visit.page.locator(".pad")
    pad.focus()
    visit.page.keyboard.down("ArrowUp")
    visit.wait_until(lambda: robot.state.linear_mps > 0.2)
    visit.wait_until(lambda: visit.text(".banner .reason") == "Steered directly")
    visit.page.keyboard.up("ArrowUp")
    visit.wait_until(lambda: robot.state.linear_mps == pytest.approx(0, abs=0.01))

    box = pad.bounding_box()
    assert box is not None
    visit.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    visit.page.mouse.down()
    visit.page.mouse.move(box["x"] + 5, box["y"] + box["height"] / 2)
    visit.wait_until(lambda: robot.state.angular_radps > 0.2)  # the pad's left turns left, which is positive

    visit.page.close()  # the pad is still held
    waiting = threading.Event()
    for _ in range(PATIENCE_MS // 50):
        if abs(robot.state.angular_radps) < 0.01:
            break
        waiting.wait(0.05)
    assert robot.state.angular_radps == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("visit", ["Forward:6 NONE:3 Forward:600"], indirect=True)
def test_stop_holds_until_it_is_reset_and_a_reset_alone_moves_nothing(visit: Visit) -> None:
    robot, page = visit.graph.robot, visit.page
    visit.wait_until(lambda: robot.state.linear_mps > 0.05)
    page.keyboard.press("Space")
    visit.wait_until(lambda: visit.text(".banner .headline") == "Stopped")
    visit.wait_until(lambda: robot.state.linear_mps == pytest.approx(0, abs=0.01))
    visit.wait_until(lambda: visit.text(".camera .sign") == "No sign")  # the hand has let go meanwhile
    visit.wait_until(lambda: visit.text(".camera .sign") == "Forward")
    page.wait_for_timeout(500)
    assert robot.state.linear_mps == pytest.approx(0, abs=0.01)

    page.get_by_role("button", name="Reset").click()
    visit.wait_until(lambda: "how Stop or lower your hand" in visit.text(".banner .reason"))
    page.wait_for_timeout(500)
    assert robot.state.linear_mps == pytest.approx(0, abs=0.01)
    assert visit.troubles == []


@pytest.mark.parametrize("visit", ["Forward:600"], indirect=True)
def test_whoever_watches_may_stop_but_only_the_driver_resets(visit: Visit) -> None:
    first, second = visit.page, visit.another_page()
    first.locator(".lease .role", has_text="you drive").wait_for()
    second.goto(first.url)
    second.locator(".lease .role", has_text="another viewer drives").wait_for()
    second.get_by_role("button", name="Stop the robot").click()
    for page in (first, second):
        page.locator(".banner .headline", has_text="Stopped").wait_for()
    second.get_by_role("button", name="Reset").click()
    second.wait_for_timeout(500)
    assert second.locator(".banner .headline").inner_text() == "Stopped"
    first.get_by_role("button", name="Reset").click()
    first.locator(".banner .headline", has_text="Ready").wait_for()


@pytest.mark.parametrize("visit", ["NONE:600"], indirect=True)
def test_a_second_browser_watches_until_the_first_hands_over(visit: Visit) -> None:
    robot = visit.graph.robot
    first, second = visit.page, visit.another_page()
    first.locator(".lease .role", has_text="you drive").wait_for()
    assert first.get_by_text("Ask to drive").is_hidden(), "whoever is alone drives without asking"
    second.goto(first.url)
    second.locator(".lease .role", has_text="another viewer drives").wait_for()

    second.locator(".pad").focus()
    second.keyboard.down("ArrowUp")
    second.wait_for_timeout(500)
    assert robot.state.linear_mps == pytest.approx(0, abs=0.01)
    second.keyboard.up("ArrowUp")

    second.get_by_text("Ask to drive").click()
    first.locator(".lease .question", has_text="Another viewer asks to drive").wait_for()
    first.get_by_text("Hand over").click()
    second.locator(".lease .role", has_text="you drive").wait_for()
    second.locator(".pad").focus()
    second.keyboard.down("ArrowUp")
    visit.wait_until(lambda: robot.state.linear_mps > 0.2)
    second.close()
    visit.wait_until(lambda: robot.state.linear_mps == pytest.approx(0, abs=0.01))


@pytest.mark.parametrize("visit", ["Stop:60"], indirect=True)
def test_fits_a_phone_and_turns_dark_and_stays_so(visit: Visit) -> None:
    visit.wait_until(lambda: visit.text(".camera .sign") == "Stop")
    visit.page.set_viewport_size({"width": 360, "height": 740})
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= 360
    banner = visit.page.locator(".banner").bounding_box()
    assert banner is not None
    assert banner["y"] < 740
    light = visit.page.evaluate("getComputedStyle(document.body).backgroundColor")
    visit.page.locator(".theme").click()
    dark = visit.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert dark != light
    visit.page.reload()
    visit.wait_until(lambda: visit.page.evaluate("getComputedStyle(document.body).backgroundColor") == dark)
    assert visit.troubles == []


def path_shown(visit: Visit) -> float:
    return float(visit.text(".world .fact:nth-child(2) b").removesuffix(" m").replace("--", "0"))


def drawn_objects(page: Page) -> int:
    """Count the shapes in the 3D view; NiceGUI keeps the scene in a global for tests."""
    count: int = page.evaluate(
        """() => {
            const name = Object.keys(window).find(key => key.startsWith("scene_"));
            let shapes = 0;
            window[name].traverse(object => shapes += object.isMesh ? 1 : 0);
            return document.querySelector(".world canvas") ? shapes : 0;
        }"""
    )
    return count
