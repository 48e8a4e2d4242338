"""Steering by hand in a real browser: sliders, keys, limits, another topic, and the plot of what follows."""

import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.making import cmd_vel_topic
from handsteer.plugins.page.server import Dashboard
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

pytestmark = NEEDS_A_BROWSER

FASTER, LINEAR_TO_0 = "faster forward", "Linear to 0"
# The largest value of a line of the plot of the linear velocity.
REACH = "line => Math.max(...(uPlot.sync('velocity').plots[0]?.data[line] ?? []), 0)"
BLUR = "window.dispatchEvent(new Event('blur'))"


@pytest.fixture
def visit() -> Iterator[Visit]:
    with visiting("NONE:600", details=True) as visit:
        yield visit


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def slider(page: Page) -> float:
    return float(page.locator(".slider.linear .value").inner_text())


def take_seat(visit: Visit) -> None:
    """Wait for the lease, which whoever is alone gets."""
    visit.page.locator(".steer.yours").wait_for()


def set_slider(visit: Visit, linear_mps: float = 0.1) -> None:
    """Set the slider; on a machine that is busy the page may be silent for so long that it goes back to zero."""
    while slider(visit.page) < linear_mps - 0.01:
        press(visit.page, FASTER)
        visit.page.wait_for_timeout(20)


def steered(visit: Visit) -> bool:
    """Set the slider, and say that it is."""
    set_slider(visit)
    return True


def speed(visit: Visit) -> float:
    return visit.graph.robot.state.linear_mps


def drives_on(visit: Visit, seconds: float) -> bool:
    """Return whether the robot moved all the time, nobody touching anything."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        if speed(visit) < 0.04:
            return False
        visit.page.wait_for_timeout(20)
    return True


def stands(visit: Visit) -> bool:
    return abs(speed(visit)) < 0.01


def pressed_again(visit: Visit, *keys: str) -> bool:
    """Release the keys and press them again where the page asks for it: a busy machine held up what they said."""
    if "release it first" in visit.text(".banner .reason"):
        for key in keys:
            visit.page.keyboard.up(key)
        for key in keys:
            visit.page.keyboard.down(key)
    return False


def is_kept_driving(visit: Visit) -> bool:
    set_slider(visit)
    visit.page.wait_for_timeout(300)
    return drives_on(visit, 0.6)


def test_a_slider_drives_until_it_is_at_zero_or_the_page_is_left(visit: Visit) -> None:
    page = visit.page
    visit.wait_until(lambda: visit.text(".banner .headline") == "Standing")
    visit.wait_until(lambda: is_kept_driving(visit))
    visit.wait_until(lambda: steered(visit) and visit.text(".mux .holds") == "Pad and keys: you")
    press(page, LINEAR_TO_0)
    visit.wait_until(lambda: stands(visit))

    visit.wait_until(lambda: is_kept_driving(visit))
    page.evaluate(BLUR)
    visit.wait_until(lambda: stands(visit) and slider(page) == 0)

    page.get_by_label("Linear: max").fill("0.05")
    press(page, FASTER)
    press(page, FASTER)
    assert slider(page) <= 0.05
    page.get_by_label("Linear: max").fill("7")  # the control lets 1 m/s through
    for _ in range(12):
        press(page, FASTER)
    visit.wait_until(lambda: page.locator(".slider.linear .q-slider").get_attribute("aria-valuemax") == "1")
    assert slider(page) <= 1.0

    set_slider(visit)
    page.keyboard.press("Space")
    visit.wait_until(lambda: visit.text(".banner .headline") == "Stopped" and slider(page) == 0)
    assert visit.text(".banner .reason") == "By you, until you reset it"
    assert page.get_by_role("button", name=FASTER, exact=True).is_disabled()
    visit.wait_until(lambda: stands(visit))
    assert visit.troubles == []


def test_letters_drive_wherever_the_focus_is_and_the_plot_shows_it(visit: Visit) -> None:
    page = visit.page
    take_seat(visit)
    page.keyboard.down("KeyW")
    visit.wait_until(lambda: speed(visit) > 0.2 or pressed_again(visit, "KeyW"))
    page.keyboard.down("KeyA")
    visit.wait_until(lambda: visit.graph.robot.state.angular_radps > 0.2 or pressed_again(visit, "KeyW", "KeyA"))
    page.evaluate(BLUR)  # the keys are still held
    visit.wait_until(lambda: stands(visit))

    def reach(line: str) -> float:
        return float(page.evaluate(REACH, ["time", "commanded", "measured"].index(line)))

    visit.wait_until(lambda: reach("commanded") > 0.1)
    visit.wait_until(lambda: reach("measured") > 0.1)
    page.reload()
    visit.wait_until(lambda: reach("measured") > 0.1)
    assert visit.troubles == []


def test_a_key_or_pad_is_let_go_where_the_browser_does_not_say_so(visit: Visit) -> None:
    """It shows no menu while something is held, and what it takes with one, or while something is dragged, ends."""
    page = visit.page
    take_seat(visit)
    page.locator(".pad").scroll_into_view_if_needed()
    pad = page.locator(".pad").bounding_box()
    assert pad is not None
    x, y = pad["x"] + pad["width"] / 2, pad["y"] + 6

    def press() -> bool:
        page.mouse.move(x, y)
        page.mouse.up()
        page.mouse.down()
        page.wait_for_timeout(300)
        return speed(visit) > 0.1

    visit.wait_until(press)
    page.evaluate("addEventListener('contextmenu', (event) => (window.menu = !event.defaultPrevented))")
    page.mouse.down(button="right")
    assert page.evaluate("window.menu") is False
    page.mouse.up(button="left")  # the right one is still held
    visit.wait_until(lambda: stands(visit))
    page.mouse.up(button="right")
    page.mouse.click(x, y, button="right")
    assert page.evaluate("window.menu") is True

    def type_w() -> bool:
        page.keyboard.up("KeyW")
        page.keyboard.down("KeyW")
        page.wait_for_timeout(300)
        return speed(visit) > 0.1

    visit.wait_until(type_w)
    page.locator("a").first.dispatch_event("dragstart")
    visit.wait_until(lambda: stands(visit))

    def repeat_w() -> bool:
        type_w()
        for _ in range(10):
            page.keyboard.down("KeyW")  # as the system repeats it, until a menu of the browser opens
            page.wait_for_timeout(30)
        return speed(visit) > 0.1

    visit.wait_until(repeat_w)
    visit.wait_until(lambda: stands(visit))
    visit.wait_until(type_w)
    assert drives_on(visit, 1.0), "a system that does not repeat keys"
    assert visit.troubles == []


def test_a_key_that_is_held_over_a_reload_or_before_the_seat_has_to_be_pressed_again(visit: Visit) -> None:
    def repeat(page: Page) -> None:
        for _ in range(15):
            page.keyboard.down("KeyW")  # as the system repeats it
            page.wait_for_timeout(50)

    page = visit.page
    take_seat(visit)
    page.keyboard.down("KeyW")
    visit.wait_until(lambda: speed(visit) > 0.1 or pressed_again(visit, "KeyW"))
    page.reload()
    take_seat(visit)
    visit.wait_until(lambda: stands(visit))
    repeat(page)
    assert stands(visit)
    page.keyboard.up("KeyW")
    page.keyboard.down("KeyW")
    visit.wait_until(lambda: speed(visit) > 0.1 or pressed_again(visit, "KeyW"))
    page.keyboard.up("KeyW")


def test_the_driver_keeps_the_seat_on_the_way_to_another_page(visit: Visit) -> None:
    page, second = visit.page, visit.another_page()
    take_seat(visit)
    second.goto(page.url)
    second.locator(".steer").wait_for()
    for link, there in (("Settings", ".settings"), ("Drive", ".steer.yours")):
        page.get_by_role("link", name=link, exact=True).click()
        page.locator(there).first.wait_for()
        page.wait_for_timeout(500)
        assert not second.locator(".steer.yours").count()


def test_the_space_key_stops_also_in_a_field_of_a_number(visit: Visit) -> None:
    page = visit.page
    take_seat(visit)
    page.get_by_role("link", name="Settings", exact=True).click()
    field = page.locator("input[inputmode=decimal]").first
    before = field.input_value()
    field.press("Space")
    visit.wait_until(lambda: visit.graph.control._safety.is_stopped)
    assert field.input_value() == before


def test_sliders_of_who_watches_do_nothing(visit: Visit) -> None:
    first, second = visit.page, visit.another_page()
    take_seat(visit)
    second.goto(first.url)
    second.locator(".steer .hint", has_text="You watch").wait_for()
    second.keyboard.down("KeyW")
    second.wait_for_timeout(500)
    assert stands(visit), "who does not drive is not taken at a letter's word"
    second.keyboard.up("KeyW")
    assert second.get_by_role("button", name=FASTER, exact=True).is_disabled()
    assert second.locator(".slider.linear .q-slider").get_attribute("aria-disabled") == "true"
    second.evaluate(
        """() => {
            for (const name of ["sliders_held", "pad_held"]) emitEvent(name, {x: 0, y: 1, at: Date.now()});
        }"""
    )
    second.wait_for_timeout(500)
    assert stands(visit)
    holds = second.locator(".mux .holds", has_text="Pad and keys: another viewer")
    visit.wait_until(lambda: steered(visit) and holds.count() > 0)


def test_another_topic_is_steered_past_the_control_and_stops_as_well() -> None:
    sections = {
        "virtual_hand": {"script": "NONE:600"},
        "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
    }
    config = load(None, {**sections, "dashboard": {"port": 0}})
    with Graph(config) as graph, a_browser() as browser:
        topic = cmd_vel_topic(config)
        wires = (graph.transport, graph.clock, graph.steering)
        dashboard = Dashboard(*wires, config.dashboard, cmd_vel=topic)
        url = dashboard.start()
        visit = Visit(browser.new_page(), graph)
        try:
            visit.page.set_default_timeout(PATIENCE_MS)
            visit.page.goto(url)
            graph.start()
            visit.wait_until(lambda: visit.text(".banner .headline") == "Standing")
            press(visit.page, "Details: velocities, topic, limits and reaction time")
            choose(visit, "/cmd vel")
            visit.wait_until(lambda: "is not a valid topic name" in visit.text(".topic .trouble"))
            choose(visit, topic.name)
            visit.wait_until(lambda: "Past the control" in visit.text(".topic-words"))
            reason = f"Steered straight on {topic.name}"
            visit.wait_until(lambda: steered(visit) and visit.text(".banner .reason") == reason)
            visit.wait_until(lambda: steered(visit) and speed(visit) > 0.02)
            visit.page.keyboard.press("Space")
            visit.wait_until(lambda: visit.text(".banner .headline") == "Stopped" and stands(visit))
        finally:
            visit.page.context.close()
            dashboard.stop()


def choose(visit: Visit, topic: str) -> None:
    visit.page.get_by_label("topic", exact=True).fill(topic)
    press(visit.page, "Steer on this topic")
