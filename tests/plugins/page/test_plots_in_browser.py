"""The plots of the velocities in a real browser: pause, zoom, values at the cursor, and scales that do not jump."""

from typing import Any

from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

SCALES = "uPlot.sync('velocity').plots.map(({ scales }) => [scales.x.min, scales.x.max, scales.y.max])"
SAMPLES = "uPlot.sync('velocity').plots[0].data[0].length"


def scales(visit: Visit) -> list[list[float]]:
    found: list[list[float]] = visit.page.evaluate(SCALES)
    return found


def samples(visit: Visit) -> Any:
    return visit.page.evaluate(SAMPLES)


def test_plots_can_be_paused_zoomed_and_read_by_mouse_and_keys() -> None:
    with visiting("Forward:3 Stop:1", details=True, camera={"fps": 10}) as visit:
        page = visit.page
        pause = page.locator(".velocity .key button")
        visit.wait_until(lambda: page.evaluate("uPlot.sync('velocity').plots.length") == 2 and samples(visit) > 60)

        pause.click()
        page.get_by_role("button", name="Resume").wait_for()
        held = samples(visit)
        page.wait_for_timeout(700)  # what comes meanwhile is not drawn
        assert samples(visit) == held
        pause.click()
        visit.wait_until(lambda: samples(visit) > held)

        page.locator(".plot").first.focus()
        page.keyboard.press("ArrowLeft")
        visit.wait_until(lambda: "s ago: commanded" in visit.text(".plot output"))

        page.locator(".velocity").scroll_into_view_if_needed()
        area = page.locator(".plot .u-over").first.bounding_box()
        assert area is not None
        y = area["y"] + area["height"] / 2
        page.mouse.move(area["x"] + area["width"] * 0.5, y)
        page.mouse.down()
        page.mouse.move(area["x"] + area["width"] * 0.75, y, steps=4)
        page.mouse.up()
        page.get_by_role("button", name="Resume").wait_for()
        (linear, angular) = scales(visit)
        assert linear[:2] == angular[:2]
        assert 6 < linear[1] - linear[0] < 9
        pause.click()
        visit.wait_until(lambda: scales(visit)[0][:2] == [-30, 0])
        assert visit.troubles == []


def test_the_scale_grows_at_once_and_shrinks_only_well_below_the_next_step() -> None:
    with visiting("NONE:600", details=True, camera={"fps": 5}) as visit:
        visit.wait_until(lambda: visit.page.evaluate("uPlot.sync('velocity').plots.length") == 2)
        visit.page.get_by_role("button", name="Pause").click()  # what is sent below is all there is
        visit.page.get_by_role("button", name="Resume").wait_for()

        def most(*velocities: float) -> float:
            rows = [[1000 + n, velocity, None] for n, velocity in enumerate(velocities)]
            return float(
                visit.page.evaluate(
                    "rows => { const plot = getElement(document.querySelector('.plot').id.slice(1));"
                    " plot.add(rows, true); plot.draw(); return plot.most; }",
                    rows,
                )
            )

        assert [most(0.1), most(0.3), most(0.52), most(0.4), most(0.2), most(0.0)] == [0.2, 0.5, 1, 1, 0.2, 0.2]
