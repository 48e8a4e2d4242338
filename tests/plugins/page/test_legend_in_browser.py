"""What the legend shows in a real browser: how confidently each sign is recognised, and how to show it."""

from playwright.sync_api import ViewportSize

from tests.plugins.page.visits import NEEDS_A_BROWSER, visiting

pytestmark = NEEDS_A_BROWSER

PHONE: ViewportSize = {"width": 390, "height": 844}
# The share of its track that each bar fills, by sign, and the place of the threshold.
BARS = """() => Object.fromEntries([...document.querySelectorAll(".sign-tile")].map((tile) => {
    const [track, bar, line] = [".live", ".live > div", ".live > i"].map((part) =>
        tile.querySelector(part).getBoundingClientRect());
    return [tile.querySelector(".name").textContent, [bar.width / track.width, (line.x - track.x) / track.width]];
}))"""


def test_the_sign_that_is_shown_passes_its_threshold_and_a_click_shows_how_to_hold_the_hand() -> None:
    with visiting("Forward:600", camera={"fps": 10}) as visit:
        page = visit.page
        visit.wait_until(lambda: page.evaluate(BARS)["Forward"][0] > 0.9)
        bars = page.evaluate(BARS)
        assert all(0.78 < line < 0.82 for _, line in bars.values())
        assert all(share < 0.8 for sign, (share, _) in bars.items() if sign != "Forward")

        tile = page.locator(".sign-tile", has_text="Turn Left")
        for size in (None, PHONE):
            if size:
                page.set_viewport_size(size)
            tile.focus()
            page.keyboard.press("Enter")
            hand = tile.locator("img")
            hand.wait_for()
            visit.wait_until(lambda hand=hand: hand.evaluate("image => image.naturalWidth") == 240)  # type: ignore[misc]
            assert tile.get_attribute("aria-expanded") == "true"
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
            page.emulate_media(reduced_motion="reduce")
            visit.wait_until(lambda hand=hand: "still" in hand.evaluate("image => image.currentSrc"))  # type: ignore[misc]
            page.emulate_media(reduced_motion="no-preference")
            tile.click()
            visit.wait_until(lambda: tile.get_attribute("aria-expanded") == "false")
        assert visit.troubles == []
