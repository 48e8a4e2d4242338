"""Tones and words for what a driver must notice, in a real browser."""

from typing import Any

from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

# Each tone's frequency is noted, and sounds all the same.
NOTE_TONES = """
    window.tones = [];
    const start = OscillatorNode.prototype.start;
    OscillatorNode.prototype.start = function (...when) {
        window.tones.push(this.frequency.value);
        return start.apply(this, when);
    };
"""


def tones(visit: Visit) -> list[float]:
    found: list[float] = visit.page.evaluate("window.tones")
    return found


def test_ready_a_sign_and_stop_sound_and_are_said_once_it_is_switched_on() -> None:
    with visiting("Stop:2 Forward:3", camera={"fps": 10}) as visit:
        page = visit.page
        page.add_init_script(NOTE_TONES)
        page.reload()
        said = page.locator(".cue")
        visit.wait_until(lambda: visit.text(".banner .headline") == "Driving")
        page.keyboard.press("Space")
        visit.wait_until(lambda: visit.text(".banner .headline") == "Stopped")
        assert (tones(visit), said.inner_text()) == ([], ""), "it is off at first"

        page.locator(".sound").click()
        assert said.get_attribute("aria-live") == "assertive"
        page.locator(".banner").get_by_text("Reset", exact=True).click()
        visit.wait_until(lambda: said.inner_text() == "Sign accepted: Forward")
        visit.wait_until(lambda: {523, 784, 659} <= set(tones(visit)))
        page.keyboard.press("Space")
        visit.wait_until(lambda: said.inner_text() == "Stopped")
        assert tones(visit)[-2:] == [392, 196]

        page.reload()
        sound: Any = page.locator(".sound")
        visit.wait_until(lambda: sound.get_attribute("aria-pressed") == "true")
        sound.click()
        assert sound.get_attribute("aria-pressed") == "false"
        page.reload()
        visit.wait_until(lambda: sound.get_attribute("aria-pressed") == "false")
        assert visit.troubles == []
