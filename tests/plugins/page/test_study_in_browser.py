"""A person is led through a small study in a real browser, in which the program is killed and started again."""

import csv
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from playwright.sync_api import Page

from handsteer.plugins.study.order import order_of
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.test_accessibility import SMALLEST_PHONE, faults
from tests.plugins.page.test_sticks_in_browser import PLUG_IN, push
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, WINDOW, visiting
from tests.plugins.study.plans import PAD, a_plan, a_task
from tests.processes import Process, eventually, free_port

pytestmark = NEEDS_A_BROWSER

HOLD_MS = 10_000
CAMERA = {"source": "virtual", "width": 320, "height": 240, "fps": 10}
GATES = [{"name": str(x), "left": [x, 1], "right": [x, -1]} for x in (0.3, 0.7)]
PLAN: dict[str, Any] = {
    "title": "A <b>small</b> study",
    "participants": 2,
    "conditions": [
        {"name": "signs", "config": {"control": {"linear_step": 0.05}}},
        {"name": "pad", "input": "pad", "instructions": "Hold the pad."},
    ],
    "courses": ["straight.yaml"],
    "laps": 1,
    "lap_limit": 120,
    "config": {"camera": CAMERA, "virtual_hand": {"script": "NONE:1 Forward:2"}},
}


def rows(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Study:
    """The program, which is killed and started again, and the page of the one who drives."""

    def __init__(self, folder: Path, page: Page) -> None:
        (folder / "straight.yaml").write_text(yaml.safe_dump({"gates": GATES}))
        (folder / "plan.yaml").write_text(
            yaml.safe_dump({**PLAN, "conditions": [{**each} for each in PLAN["conditions"]]})
        )
        self.folder, self.page, self.port = folder, page, free_port()
        self.troubles: list[str] = []
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: self.troubles.append(str(error)))
        self.start()

    def start(self) -> None:
        command = [sys.executable, "-m", "handsteer", "study", str(self.folder / "plan.yaml"), "--participant", "P01"]
        config = self.folder / "config.yaml"
        config.write_text(yaml.safe_dump({"dashboard": {"open_browser": False}}))
        command += ["--results", str(self.folder / "out"), "--port", str(self.port), "--config", str(config)]
        self.process = Process(command, None, self.folder / "log")  # type: ignore[arg-type]
        url = f"the page is at http://127.0.0.1:{self.port}/study"
        eventually(lambda: url in self.process.text or not self.process.running, what="the page")
        assert url in self.process.text, self.process.text
        self.page.goto(f"http://127.0.0.1:{self.port}/study")

    def restart(self) -> None:
        """Kill the program, and start it again."""
        self.process.signal(signal.SIGKILL)
        self.process.code()
        self.start()

    def laps(self) -> list[str]:
        return [row["outcome"] for row in rows(self.folder / "out" / "laps.csv")]

    def press(self, name: str) -> None:
        self.page.locator(".study").get_by_role("button", name=name).click()

    def says(self, words: str) -> None:
        self.page.locator(".study", has_text=words).wait_for()

    def has_laps(self, outcomes: list[str], patience_ms: int) -> bool:
        """Return whether these laps have been driven within ``patience_ms``."""
        for _ in range(patience_ms // 50):
            if self.laps() == outcomes:
                return True
            self.page.wait_for_timeout(50)
        return False

    def wait_for_laps(self, outcomes: list[str]) -> None:
        if not self.has_laps(outcomes, PATIENCE_MS):
            self.fail(outcomes)

    def fail(self, outcomes: list[str]) -> None:
        pytest.fail(f"{self.laps()} instead of {outcomes}: {self.page.locator('body').inner_text()}")

    def drive_by_pad(self) -> None:
        """Begin a lap, and hold the pad forward until it is over."""
        laps = self.laps()
        self.press("Begin lap")
        self.says("Drive through the yellow gate")
        # Signs, which do nothing here, are in the picture.
        self.page.locator(".banner", has_text="nothing steers the robot").wait_for()
        self.page.locator(".pad").scroll_into_view_if_needed()
        box = self.page.locator(".pad").bounding_box()
        assert box is not None
        self.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 4)
        for _ in range(PATIENCE_MS // HOLD_MS):  # a machine that was held up drives on only once the pad was let go
            self.page.mouse.down()
            is_finished = self.has_laps([*laps, "finished"], HOLD_MS)
            self.page.mouse.up()
            if is_finished:
                return
        self.fail([*laps, "finished"])

    def answer(self, form: str, mark: int) -> None:
        questions = self.page.locator(f".questions.{form} fieldset")
        for index in range(questions.count()):
            questions.nth(index).locator("input").nth(mark).check()


@pytest.fixture
def study(tmp_path: Path) -> Iterator[Study]:
    with a_browser() as browser:
        study = Study(tmp_path, browser.new_page(viewport=WINDOW))
        try:
            yield study
        finally:
            study.process.kill()


def test_a_person_is_led_through_by_hand_and_pad_and_a_killed_study_continues(study: Study) -> None:
    page = study.page
    study.says("A <b>small</b> study")
    assert faults(page) == []
    page.locator(".banner", has_text="the robot stands until a lap begins").wait_for()
    assert not page.get_by_role("button", name="Reset").is_visible()
    study.press("I agree")
    study.says("Part 1 of 2")
    study.press("Continue")
    study.says("Practice lap 1 of 1")
    assert not page.locator(".steer").is_visible()
    assert not page.get_by_role("link", name="Edit world").is_visible()
    study.press("Begin lap")
    study.says("Drive through the yellow gate")
    study.press("Drive again")
    study.says("not counted")
    assert study.laps() == ["repeated"]

    for kind in ("Practice lap", "Lap"):
        study.says(f"{kind} 1 of 1")
        study.press("Begin lap")  # the virtual hand drives
        study.wait_for_laps(["repeated", "finished", "finished"][: 2 + (kind == "Lap")])
    study.says("How was driving this way?")
    assert faults(page) == []
    study.press("Send")
    study.says("question 1 has no answer yet")
    study.answer("tlx", 4)
    study.press("Send")
    study.says("How far do you agree?")

    study.restart()
    study.says("How far do you agree?")
    study.answer("sus", 2)
    study.press("Send")
    study.says("Part 2 of 2")
    study.press("Continue")
    assert not page.locator(".camera").is_visible()
    study.press("Begin lap")
    study.says("Drive through the yellow gate")
    study.restart()  # the lap that was driven is lost
    study.press("Continue")
    study.says("Practice lap 1 of 1")
    for _ in range(2):
        study.drive_by_pad()
    study.says("How was driving this way?")
    laps, forms = rows(study.folder / "out" / "laps.csv"), rows(study.folder / "out" / "forms.csv")
    counted = [row for row in laps if row["outcome"] == "finished"]
    assert [(row["condition"], row["practice"], row["lap"]) for row in counted] == [
        ("signs", "1", "1"),
        ("signs", "0", "1"),
        ("pad", "1", "1"),
        ("pad", "0", "1"),
    ]
    assert {row["outcome"] for row in laps} == {"finished", "repeated"}
    assert all(0.2 < float(row["path_m"]) < 1.0 and float(row["time_s"]) > 0.2 for row in counted)
    assert len({row["config"] for row in laps}) == 2
    assert [(row["form"], row["score"]) for row in forms] == [("consent", ""), ("tlx", "20.0"), ("sus", "50.0")]
    assert study.troubles == []


def test_only_the_driver_leads_by_the_input_of_the_condition_and_who_leaves_drives_again(tmp_path: Path) -> None:
    task = a_task(tmp_path, a_plan(conditions=[PAD], forms=[]))
    with visiting("Forward:600", "/study", study=task) as visit:
        first, robot = visit.page, visit.graph.robot
        first.get_by_role("button", name="I agree").click()
        first.get_by_role("button", name="Continue").click()
        begin_lap(first)
        around = robot.surroundings
        visit.wait_until(lambda: visit.text(".banner .headline") == "Standing" and around.course is not None)
        assert len(around.world.gates if around.world else ()) == 2
        assert not first.locator(".sliders").is_visible()
        first.keyboard.down("w")  # keys are another input
        second = visit.another_page()
        second.set_default_timeout(PATIENCE_MS)
        second.goto(first.url)
        second.get_by_role("button", name="Give up").click()
        second.locator(".study", has_text="Another viewer drives, and leads this study").wait_for()
        assert robot.state.truth.x < 0.01, "neither by the sign that is shown all the time nor by keys"

        first.close()
        path = tmp_path / "laps.csv"
        eventually(path.exists)
        second.locator(".study", has_text="not counted").wait_for()
        second.locator(".banner", has_text="the robot stands until a lap begins").wait_for()
        assert [row["outcome"] for row in rows(path)] == ["repeated"]
        begin_lap(second)
        third = visit.another_page()
        third.set_default_timeout(PATIENCE_MS)
        third.goto(second.url)
        third.get_by_role("button", name="Ask to drive").click()
        second.get_by_role("button", name="Hand over").click()
        second.locator(".study", has_text="The lap before was not counted").wait_for()
        begin_lap(third)
        third.get_by_role("button", name="Give up").click()
        third.locator(".study", has_text="Lap 1 of 2").wait_for()
        assert [row["outcome"] for row in rows(path)] == ["repeated", "repeated", "given_up"]
        study = third.url
        third.goto(study.replace("/study", "/settings"))
        third.locator(".banner").get_by_role("button", name="Reset").click()
        third.wait_for_timeout(1000)
        assert third.locator(".banner .headline").inner_text() == "Stopped"
        third.goto(study)
        third.locator(".study", has_text="Lap 1 of 2").wait_for()
        third.set_viewport_size(SMALLEST_PHONE)
        assert third.evaluate("document.documentElement.scrollWidth") <= SMALLEST_PHONE["width"]
        assert faults(third) == []
        assert visit.troubles == []


def test_only_the_input_of_the_condition_drives(tmp_path: Path) -> None:
    ways = ("keys", "sliders", "gamepad")
    plan = a_plan(
        participants=1, conditions=[{"name": way, "input": way} for way in ways], forms=[], practice_laps=0, laps=1
    )
    with visiting("NONE:600", "/", study=a_task(tmp_path, plan), camera={"fps": 5}) as visit:
        page, state = visit.page, visit.graph.robot
        assert page.locator("nav.links a").count() == 0, "a participant gets the study only"
        page.evaluate(PLUG_IN, [])
        page.get_by_role("button", name="I agree").click()
        for number, way in enumerate(order_of(plan, "P01")[0], 1):
            page.get_by_role("button", name="Continue").click()
            begin_lap(page)
            for other in {*ways, "pad"} - {way, "sliders"}:
                hold(page, other, down=True)
                page.wait_for_timeout(300)
                hold(page, other, down=False)
            if way != "sliders":
                assert not page.locator(".sliders").is_visible()
            assert state.state.truth.x < 0.01, f"neither of the others drives next to {way}"
            hold(page, way, down=True)
            visit.wait_until(lambda number=number: len(rows(tmp_path / "laps.csv")) == number)  # type: ignore[misc]
            hold(page, way, down=False)
        assert [row["input"] for row in rows(tmp_path / "laps.csv")] == [*order_of(plan, "P01")[0]]
        assert visit.troubles == []


def hold(page: Page, way: str, *, down: bool) -> None:
    if way == "keys":
        page.keyboard.down("w") if down else page.keyboard.up("w")
    elif way == "gamepad":
        push(page, 0, down=down)
    elif way == "sliders" and down:
        for _ in range(3):
            page.get_by_role("button", name="faster forward").click()
    elif way == "pad" and (box := page.locator(".pad").bounding_box()):
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 4)
        page.mouse.down() if down else page.mouse.up()


def begin_lap(page: Page) -> None:
    page.get_by_role("button", name="Begin lap").click()
    page.locator(".study", has_text="Drive through the yellow gate").wait_for()
