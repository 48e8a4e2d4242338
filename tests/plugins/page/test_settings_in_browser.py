"""The page of the settings in a real browser, on the whole graph with the virtual hand."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from handsteer.config import load
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, visiting

pytestmark = NEEDS_A_BROWSER

expect.set_options(timeout=PATIENCE_MS)


def of(page: Page, path: str) -> Locator:
    return page.get_by_label(path, exact=True)


def row(page: Page, path: str) -> Locator:
    return page.locator(".setting", has=of(page, path))


def search(page: Page, words: str, count: int) -> None:
    """Search until ``count`` are left; a page that has lost its connection loads itself again, with an empty search."""
    for patience_ms in (PATIENCE_MS // 4, PATIENCE_MS):
        page.get_by_label("Search the parameters").fill(words)
        try:
            expect(page.locator(".setting:visible")).to_have_count(count, timeout=patience_ms)
        except AssertionError:
            if patience_ms == PATIENCE_MS:
                raise
        else:
            return


@pytest.mark.parametrize("name", ["Save", "Load what the file says"])
def test_what_was_just_typed_is_saved_or_dropped_by_a_quick_click(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page sends a click of no duration before it sends that the field was left."""
    monkeypatch.chdir(tmp_path)
    if name != "Save":
        (tmp_path / "handsteer.yaml").write_text("camera: {fps: 5}", encoding="utf-8")
    with visiting("NONE:600", "/settings", camera={"fps": 5}) as visit:
        page, graph = visit.page, visit.graph
        field = of(page, "control.max_linear")
        expect(field).to_have_value("1")
        field.click()
        page.keyboard.press("Control+a")
        page.keyboard.type("0.321")
        page.get_by_role("button", name=name, exact=True).click()
        done = "saved to handsteer.yaml" if name == "Save" else "loaded handsteer.yaml"
        expect(page.locator(".said")).to_have_text(done)
        expect(field).to_have_value("0.321" if name == "Save" else "1")
        expect(page.locator(".state")).to_have_text("as in the file")
        assert load(tmp_path / "handsteer.yaml").control.max_linear == (0.321 if name == "Save" else 1.0)
        assert graph.config.control.max_linear == (0.321 if name == "Save" else 1.0)


def test_the_driver_sets_what_the_robot_does_and_saves_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with visiting("NONE:600", "/settings", camera={"fps": 5}) as visit:
        page, graph = visit.page, visit.graph
        field = of(page, "control.max_linear")
        expect(field).to_have_value("1")
        field.fill("99")
        expect(row(page, "control.max_linear")).to_contain_text("99 should be less than or equal to 10")
        assert graph.config.control.max_linear == 1.0
        field.fill("0.4")
        assert graph.config.control.max_linear == 1.0  # taken when it is complete: by Enter, or on the way out
        field.press("Enter")
        visit.wait_until(lambda: graph.config.control.max_linear == 0.4)
        expect(row(page, "control.max_linear")).to_contain_text("changed")
        expect(row(page, "control.max_linear")).to_contain_text("default 1")
        expect(page.locator(".lease .role")).to_have_text("you drive")

        # What differs from the default is marked, here and in the index; a link unfolds its section and leads to it.
        index = page.get_by_role("navigation", name="Sections")
        expect(index.get_by_role("link", name="Common")).to_contain_text("4")
        page.set_viewport_size({"width": 1440, "height": 900})
        expect(of(page, "landmarks.refine_new_hands")).to_be_hidden()
        index.get_by_role("link", name="Finding hands").click()
        expect(of(page, "landmarks.refine_new_hands")).to_be_in_viewport()
        expect(index.get_by_role("link", name="Finding hands")).to_have_attribute("aria-current", "true")
        expect(index.get_by_role("link", name="Common")).not_to_have_attribute("aria-current", "true")

        of(page, "landmarks.refine_new_hands").click()
        expect(row(page, "landmarks.refine_new_hands")).to_contain_text("waits for the next start")
        assert graph.config.landmarks.refine_new_hands
        of(page, "robot.preset").click()
        page.get_by_role("option", name="turtlebot4").click()
        expect(of(page, "robot.max_linear")).to_have_value("0.306")

        index.get_by_role("link", name="Robot").click()
        of(page, "robot.cmd_vel_type").click()
        page.get_by_role("option", name="twist", exact=True).click()
        expect(row(page, "robot.cmd_vel_type")).to_contain_text("changed")
        of(page, "control.cmd_vel_type").click()
        page.get_by_role("option", name="twist_stamped").click()
        expect(row(page, "control.cmd_vel_type")).to_contain_text("they should be the same")
        expect(of(page, "control.cmd_vel_type")).to_have_value("auto")

        search(page, "keep tracking", 1)
        page.get_by_label("Search the parameters").fill("")
        expect(page.locator(".state")).to_have_text("not saved yet")
        page.get_by_role("button", name="Save").click()
        expect(page.locator(".said")).to_have_text("saved to handsteer.yaml")
        saved = load(tmp_path / "handsteer.yaml")
        assert (saved.control.max_linear, saved.robot.preset, saved.landmarks.refine_new_hands) == (
            0.4,
            "turtlebot4",
            False,
        )
        assert saved.camera.fps == 5

        page.get_by_label("Set control.max_linear to its default").click()
        expect(of(page, "control.max_linear")).to_have_value("0.306")
        expect(row(page, "robot.preset")).to_contain_text("default none")
        page.get_by_role("button", name="Set all parameters to their defaults").click()
        page.get_by_role("button", name="Set all to default").click()
        expect(page.locator(".said")).to_have_text("all is as by default; not saved")
        expect(row(page, "camera.fps")).not_to_have_class(re.compile(r"\bchanged\b"))
        for width, height in ((1440, 900), (390, 844), (360, 740)):
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.get_by_text("Sections", exact=True).click()
        index.get_by_role("link", name="Foxglove").click()
        expect(of(page, "foxglove.port")).to_be_in_viewport()
        expect(index).to_be_hidden()  # the menu closes
        assert visit.troubles == []


def test_who_watches_sees_what_is_set_but_neither_changes_it_nor_sees_passwords(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with visiting("NONE:600", "/settings", signs={"confirm_time": 0.2}) as visit:
        first, second = visit.page, visit.another_page()
        expect(first.locator(".lease .role")).to_have_text("you drive")
        of(first, "camera.source").fill("rtsp://me:pa55@cam/1")
        of(first, "camera.source").press("Enter")
        expect(of(first, "camera.source")).to_have_value("rtsp://me:•••@cam/1")
        second.goto(first.url)
        expect(second.locator(".lease .role")).to_contain_text("another viewer drives")
        expect(of(second, "camera.source")).to_have_value("rtsp://me:•••@cam/1")
        expect(of(second, "signs.confirm_time")).to_have_value("0.2")
        expect(of(second, "signs.confirm_time")).not_to_be_editable()
        expect(second.get_by_role("button", name="Save")).to_be_hidden()
        assert str(tmp_path) not in second.content()
        assert "pa55" not in second.content()

        # Whatever a browser allows, the server asks who drives.
        of(second, "signs.confirm_time").evaluate("element => element.readOnly = false")
        of(second, "signs.confirm_time").fill("0")
        of(second, "signs.confirm_time").press("Enter")
        expect(second.locator(".said")).to_contain_text("only the driver can change settings")
        assert visit.graph.config.signs.confirm_time == 0.2
