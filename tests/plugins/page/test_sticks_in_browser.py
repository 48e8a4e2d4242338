"""A gamepad and a tilted phone that steer, in a real browser: both are played by scripts."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Page

from handsteer.config import JoystickConfig
from handsteer.recognition.hand_joystick import deflection
from tests.plugins.page.browsers import TILTS_UNASKED
from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

PLUG_IN = """buttons => {
    window.played = {
        index: 0, id: "Xbox 360 Controller (STANDARD GAMEPAD Vendor: 045e Product: 028e)", mapping: "standard",
        connected: true, axes: [0, -1, 0, 0],
        buttons: Array.from({length: 17}, (_, number) => ({pressed: buttons.includes(number)})),
    };
    navigator.getGamepads = () => [window.played, null, null, null];
    window.dispatchEvent(new Event("gamepadconnected"));
}"""
UNPLUG = "window.played = null"
BLUR = "window.dispatchEvent(new Event('blur'))"
HIDE = """isHidden => {
    Object.defineProperty(document, "hidden", {value: isHidden, configurable: true});
    document.dispatchEvent(new Event("visibilitychange"));
}"""
HOLD_AGAIN_EVERY = 40  # looks at the robot; a machine that was held up ends what was steered


@pytest.fixture
def visit() -> Iterator[Visit]:
    with visiting("NONE:600") as visit:
        yield visit


def push(page: Page, button: int, *, down: bool) -> None:
    page.evaluate("([number, down]) => window.played.buttons[number].pressed = down", [button, down])


def speed(visit: Visit) -> float:
    return visit.graph.robot.state.linear_mps


def stands(visit: Visit) -> bool:
    return abs(speed(visit)) < 0.01


def drive(visit: Visit, button: int = 0) -> None:
    """Hold the gamepad's button until the robot drives, again if need be."""
    looks = 0

    def drives() -> bool:
        nonlocal looks
        if looks % HOLD_AGAIN_EVERY == 0:
            push(visit.page, button, down=False)
            visit.page.wait_for_timeout(200)
            push(visit.page, button, down=True)
        looks += 1
        return speed(visit) > 0.2

    visit.wait_until(drives)


def keeps_standing(visit: Visit) -> None:
    visit.wait_until(lambda: stands(visit))
    visit.page.wait_for_timeout(600)  # several messages of a pad that is held
    assert stands(visit)


def test_a_gamepad_steers_while_its_button_is_held(visit: Visit) -> None:
    page = visit.page
    visit.wait_until(lambda: visit.text(".banner .headline") == "Standing")
    page.evaluate(PLUG_IN, [0])
    said = "gamepad: Xbox 360 Controller, hold A or a shoulder button, B stops"
    visit.wait_until(lambda: visit.text(".sticks") == said)
    keeps_standing(visit)  # the button was held before

    drive(visit)
    assert visit.text(".mux .holds") == "Pad and keys: you"
    page.evaluate("window.played.axes = [0.06, 0.06, 0, 0]")  # within the dead zone
    visit.wait_until(lambda: stands(visit))
    page.evaluate("window.played.axes = [-1, 0, 0, 0]")
    visit.wait_until(lambda: visit.graph.robot.state.angular_radps > 0.3)
    assert "translate(-" in (page.locator(".pad .knob").get_attribute("style") or "")
    push(page, 0, down=False)
    visit.wait_until(lambda: abs(visit.graph.robot.state.angular_radps) < 0.01)

    page.evaluate("window.played.axes = [0, -1, 0, 0]")
    for button in (4, 5):
        drive(visit, button)
        push(page, button, down=False)
        visit.wait_until(lambda: stands(visit))
    assert visit.troubles == []


@pytest.mark.parametrize("way", [BLUR, f"({HIDE})(true)", UNPLUG])
def test_the_robot_stands_when_the_page_or_the_gamepad_is_gone_until_it_is_held_again(visit: Visit, way: str) -> None:
    page = visit.page
    page.evaluate(PLUG_IN, [])
    drive(visit)
    page.evaluate(way)
    visit.wait_until(lambda: stands(visit))
    page.evaluate(HIDE, False)
    page.evaluate(PLUG_IN, [0])  # still held
    keeps_standing(visit)
    drive(visit)


def test_b_stops_and_a_must_be_released_afterwards(visit: Visit) -> None:
    page = visit.page
    page.evaluate(PLUG_IN, [])
    drive(visit)
    push(page, 1, down=True)
    visit.wait_until(lambda: visit.text(".banner .headline") == "Stopped" and stands(visit))
    push(page, 1, down=False)
    page.get_by_role("button", name="Reset").click()
    visit.wait_until(lambda: visit.text(".banner .headline") == "Standing")
    keeps_standing(visit)
    drive(visit)


def test_a_gamepad_whose_buttons_are_not_known_does_nothing(visit: Visit) -> None:
    page = visit.page
    page.evaluate(PLUG_IN, [])
    page.evaluate("Object.assign(window.played, {mapping: '', id: '0079-0006-Generic USB Joystick'})")
    visit.wait_until(
        lambda: visit.text(".sticks") == "gamepad: Generic USB Joystick, this browser does not know its buttons"
    )
    push(page, 0, down=True)
    keeps_standing(visit)
    page.evaluate(UNPLUG)
    visit.wait_until(lambda: page.locator(".sticks").is_hidden())


def test_the_response_is_that_of_the_hand_as_a_joystick(visit: Visit) -> None:
    config = JoystickConfig(dead_zone=0.12, full_deflection=0.95, expo=0.3)
    for moved in (-1.0, -0.5, -0.12, 0.0, 0.05, 0.3, 0.7, 0.96):
        assert visit.page.evaluate("moved => respond(moved, STICK)", moved) == pytest.approx(deflection(moved, config))


@contextmanager
def phone(visit: Visit, script: str = "") -> Iterator[Page]:
    browser = visit.page.context.browser
    assert browser is not None
    page = browser.new_page(viewport={"width": 390, "height": 740}, has_touch=True, is_mobile=True)
    page.on("pageerror", lambda error: visit.troubles.append(str(error)))
    page.add_init_script(f"{TILTS_UNASKED}; {script}")
    visit.page.locator(".steer.yours").wait_for()  # some seconds after a phone that drove has left
    page.goto(visit.page.url)
    page.get_by_role("button", name="Ask to drive").click()
    visit.page.get_by_role("button", name="Hand over").click()
    page.locator(".steer.yours").wait_for()
    try:
        yield page
    finally:
        page.context.close()


def tilt(page: Page, beta: float | None, gamma: float | None) -> None:
    page.evaluate(
        "at => window.dispatchEvent(new DeviceOrientationEvent('deviceorientation', at))",
        {"beta": beta, "gamma": gamma},
    )


def press_tilt(page: Page) -> None:
    button = page.locator(".tilt")
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()


def test_a_phone_steers_by_tilt_while_its_button_is_held(visit: Visit) -> None:
    assert visit.page.locator(".tilt").is_hidden(), "this is not a phone"
    with phone(visit) as page:

        def is_driven() -> bool:
            page.mouse.up()
            press_tilt(page)
            tilt(page, 50, 5)  # as it is held now
            tilt(page, 20, 5)
            page.wait_for_timeout(800)
            return speed(visit) > 0.3

        visit.wait_until(is_driven)
        tilt(page, 50, 5)
        visit.wait_until(lambda: stands(visit))
        tilt(page, 80, 5)
        visit.wait_until(lambda: speed(visit) < -0.1 or is_driven())
        page.mouse.up()
        visit.wait_until(lambda: stands(visit))
        tilt(page, 20, 5)
        page.wait_for_timeout(400)
        assert stands(visit)
        press_tilt(page)
        visit.wait_until(
            lambda: page.locator(".sticks").inner_text() == "tilt: this device does not tell how it is held"
        )
    assert visit.troubles == []


def test_tilt_is_that_of_the_screen_whichever_way_up_the_phone_is(visit: Visit) -> None:
    script = """([angle, beta, gamma]) => {
        Object.defineProperty(screen.orientation, "angle", {value: angle, configurable: true});
        return attitude({beta, gamma});
    }"""
    for (angle, beta, gamma), (pitch, roll) in {
        (0, 30, 0): (30, 0),
        (0, 0, 20): (0, 20),
        (0, 100, 0): (100, 0),
        (90, 20, 0): (0, 20),  # on its left side: its bottom is the picture's right
        (90, 0, 20): (-20, 0),
        (180, 30, 0): (-30, 0),
        (270, 20, 0): (0, -20),
    }.items():
        found = visit.page.evaluate(script, [angle, beta, gamma])
        assert (found["pitch"], found["roll"]) == (pytest.approx(pitch, abs=1e-9), pytest.approx(roll, abs=1e-9))


def test_a_phone_that_cannot_or_may_not_says_so(visit: Visit) -> None:
    insecure = "Object.defineProperty(window, 'isSecureContext', {value: false})"
    with phone(visit, insecure) as page:
        page.locator(".sticks", has_text="only to pages from https").wait_for()
        assert page.locator(".tilt").is_hidden()
    refuses = "DeviceOrientationEvent.requestPermission = async () => window.answer ?? 'denied'"
    with phone(visit, refuses) as page:
        press_tilt(page)
        page.mouse.up()
        page.locator(".sticks", has_text="tilt: not allowed").wait_for()
        page.evaluate("window.answer = 'granted'")
        press_tilt(page)
        page.mouse.up()
        page.locator(".sticks", has_text="tilt: allowed, now hold the button").wait_for()
        assert stands(visit)
    assert visit.troubles == []
