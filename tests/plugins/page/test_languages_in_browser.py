"""The page in another language, in a real browser: every word of every page, and nothing wider than the screen."""

import pytest

from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.test_layout_in_browser import fits, rows_have_room, stop_is_in_view_wherever
from tests.plugins.page.visits import DESKTOP, NEEDS_A_BROWSER, PHONE, Visit, visiting

pytestmark = NEEDS_A_BROWSER

GERMAN = {"Driving": "Fahrt", "Stopped": "Gestoppt", "Stop": "Stopp", "Reset": "Zurücksetzen"}


TO_BE_TYPED = {
    "'Hi' should be written as in: Hi: turbo, Bye: stop": "'Hi' sollte geschrieben werden wie: Hi: turbo, Bye: stop",
    "'stopp' should be 'go' or 'stop': did you mean stop?": "'stopp' sollte 'go' oder 'stop' sein: meintest du stop?",
}
"""Values of parameters, one of which is also the name of a sign, that stay as they are."""

INSERT = """words => {
  const shown = document.createElement("output");
  shown.className = "typed";
  shown.textContent = words;
  document.body.append(shown);
}"""


def english_left(visit: Visit) -> list[str]:
    """Return the texts that were shown without a translation."""
    left: list[str] = visit.page.evaluate("[...window.untranslated]")
    return sorted(left)


def headline(visit: Visit) -> str:
    return visit.text(".banner .headline")


@pytest.mark.parametrize("path", ["/", "/world", "/teach", "/settings", "/study"])
def test_all_words_of_a_page_are_in_the_language_of_the_browser_and_fit(path: str) -> None:
    with visiting("Forward:600", path, locale="de-DE", details=True, camera={"fps": 5}) as visit:
        page = visit.page
        visit.wait_until(lambda: headline(visit) == GERMAN["Driving"])
        assert page.locator("html").get_attribute("lang") == "de"
        assert faults(page) == []
        assert path != "/" or rows_have_room(page)
        page.evaluate("for (const folded of document.querySelectorAll('details')) folded.open = true")
        for size in (DESKTOP, PHONE):
            page.set_viewport_size(size)
            assert fits(page), size
            assert stop_is_in_view_wherever(page), size
        page.set_viewport_size(DESKTOP)
        page.locator(".banner .stop").click()
        visit.wait_until(lambda: headline(visit) == GERMAN["Stopped"])
        assert english_left(visit) == []
        assert visit.troubles == []


def test_words_change_with_the_state_and_numbers_stay_as_they_were() -> None:
    with visiting("Forward:3 Stop:3", locale="de-DE", details=True, camera={"fps": 10}) as visit:
        page = visit.page
        visit.wait_until(lambda: headline(visit) == GERMAN["Driving"])
        visit.wait_until(lambda: visit.text(".camera .sign") == "Stopp")
        visit.wait_until(lambda: visit.text(".camera .sign") == "Vorwärts")
        visit.wait_until(lambda: visit.text(".timing .rate").endswith(" Bilder/s"))
        assert float(visit.text(".timing .rate").split()[0]) > 0
        page.keyboard.press("Space")
        visit.wait_until(lambda: headline(visit) == GERMAN["Stopped"])
        page.locator(".banner").get_by_text(GERMAN["Reset"], exact=True).click()
        visit.wait_until(lambda: headline(visit) != GERMAN["Stopped"])
        assert english_left(visit) == []
        for shown, german in TO_BE_TYPED.items():
            page.evaluate(INSERT, shown)
            page.locator("output.typed", has_text=german).wait_for()


def test_a_browser_in_english_loads_no_catalogue() -> None:
    with visiting("Stop:600", camera={"fps": 5}) as visit:
        assert not visit.page.evaluate("'untranslated' in window")
        assert visit.page.locator("html").get_attribute("lang") == "en-US"
