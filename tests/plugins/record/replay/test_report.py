import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Request
from rosbags.rosbag2 import StoragePlugin

from handsteer.cli.app import run
from handsteer.errors import RecordingError
from handsteer.messages import CMD_VEL, DIAGNOSTICS, HAND_SIGN, String, Time, Topic, twist
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.status import CameraStatus, RecognitionStatus
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.replay.report import write_report
from handsteer.transports.encoding import encode
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS
from tests.plugins.record.test_bags import as_ros1, as_ros2

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
VOID = {"meta", "link", "img", "br"}


class Page(HTMLParser):
    """The texts, elements and data of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.figures: dict[str, Any] = {}
        self._open: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] == ["script"]:
            if self.elements[-1][1].get("id") == "figures":
                self.figures = json.loads(data)
        elif self._open[-1:] != ["style"] and data.strip():
            self.texts.append(data.strip())

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.elements)


@pytest.fixture(scope="module")
def page(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "drive.html"
    write_report(recording, path)
    return path


def evil_recording(path: Path) -> Path:
    """Write a recording whose names are HTML."""
    writer = McapWriter(path)
    writer.describe("handsteer", {"handsteer": EVIL, "config": json.dumps({"robot": {"kind": "sim", "world": EVIL}})})
    statuses = (CameraStatus(camera=EVIL), RecognitionStatus(seen=EVIL, confidence=0.5))
    messages: list[tuple[Topic[Any], Any]] = [
        *((DIAGNOSTICS, write_status(each, each.node, Time(sec=0, nanosec=0))) for each in statuses),
        *[(HAND_SIGN, String(data=EVIL))] * 5,
        (CMD_VEL, twist(0.1, 0.0)),
    ]
    for n, (topic, message) in enumerate(messages):
        writer.write(topic, topic.name, encode(message), n * 100_000_000)
    writer.close()
    return path


def test_the_page_has_all_charts_stops_and_totals(page: Path) -> None:
    parsed = Page(page)
    assert parsed.figures.keys() == {"timeline", "map"}
    panels = [name for name in parsed.figures["timeline"]["layout"] if name.startswith("yaxis")]
    assert len(panels) == 4
    assert parsed.count("img") == 3
    assert {"virtual hand", "2.63 m", "the Stop sign is shown", "Forward"} <= set(parsed.texts)
    assert "Latencies are unknown: it was recorded in stepped time, which has no delays." in parsed.texts
    assert page.stat().st_size < 6_000_000


def test_the_map_has_equal_axes_and_all_obstacles(page: Path) -> None:
    figure = Page(page).figures["map"]
    assert figure["layout"]["yaxis"]["scaleanchor"] == "x"
    assert len(figure["layout"]["shapes"]) == 13
    low, high = figure["layout"]["xaxis"]["range"]
    assert low < -5.9
    assert 5.9 < high < 8.0


def test_nothing_in_the_page_comes_from_elsewhere(page: Path) -> None:
    parsed = Page(page)
    links = [
        value for _, attributes in parsed.elements for name, value in attributes.items() if name in ("src", "href")
    ]
    assert links
    assert all(link is not None and link.startswith("data:") for link in links)
    policies = [attributes["content"] for _, attributes in parsed.elements if "http-equiv" in attributes]
    assert str(policies[0]).startswith("default-src 'none'; script-src 'sha256-")


def test_names_in_a_recording_are_text(tmp_path: Path) -> None:
    write_report(evil_recording(tmp_path / "evil.mcap"), tmp_path / "evil.html")
    parsed = Page(tmp_path / "evil.html")
    assert parsed.count("script") == 3
    assert parsed.count("img") == 0
    assert any(EVIL[:20] in text for text in parsed.texts)
    labels = parsed.figures["timeline"]["layout"]["yaxis"]["ticktext"]
    assert labels[0].startswith("&lt;/script&gt;")


@pytest.mark.parametrize("kind", ["ros1", "ros2"])
def test_bags_of_others_have_a_report(kind: str, recording: Path, tmp_path: Path) -> None:
    bag = tmp_path / ("drive.bag" if kind == "ros1" else "drive")
    if kind == "ros1":
        as_ros1(recording, bag)
    else:
        as_ros2(recording, bag, StoragePlugin.SQLITE3)
    facts = write_report(bag, tmp_path / "drive.html")
    parsed = Page(tmp_path / "drive.html")
    assert facts.totals()["frames"] == 241
    assert facts.unexplained == []
    assert facts.totals()["distance_m"] == pytest.approx(2.63, abs=0.05)
    assert parsed.figures.keys() == {"timeline", "map"}
    assert parsed.count("img") == 3
    assert any("no journal" in text for text in parsed.texts)


def test_a_report_is_overwritten_only_on_request(recording: Path, tmp_path: Path) -> None:
    page = tmp_path / "drive.html"
    page.write_text("mine")
    with pytest.raises(RecordingError, match=r"drive\.html exists already"):
        write_report(recording, page)
    assert page.read_text() == "mine"
    write_report(recording, page, force=True)
    assert page.read_text().startswith("<!DOCTYPE html>")
    assert [path.name for path in tmp_path.iterdir()] == ["drive.html"]


def test_a_report_never_overwrites_its_recording(recording: Path) -> None:
    before = recording.read_bytes()
    with pytest.raises(RecordingError, match="is the recording: give another name"):
        write_report(recording, recording, force=True)
    assert recording.read_bytes() == before


def test_a_report_that_cannot_be_written_is_an_error(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot write the report to .*missing"):
        write_report(recording, tmp_path / "missing" / "drive.html")


def test_the_verb_prints_the_totals(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "drive.mcap"
    copy.write_bytes(recording.read_bytes())
    assert run(["report", str(copy)]) == 0
    printed = capsys.readouterr().out
    assert "distance:   2.63 m" in printed
    assert printed.endswith(f"report: {tmp_path / 'drive.html'}\n")
    assert (tmp_path / "drive.html").is_file()
    assert run(["report", str(copy)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert run(["report", str(copy), "--force"]) == 0


def test_motion_without_a_reason_is_a_section_of_the_page_and_a_line_of_the_totals(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_report(recording, tmp_path / "drive.html")
    texts = Page(tmp_path / "drive.html").texts
    assert texts[texts.index("Motion without a live reason") + 1] == "There was none."
    writer = McapWriter(tmp_path / "forged.mcap")
    for time_s, velocity in ((0.0, 0.0), (1.0, 0.2), (1.3, 0.0), (2.0, 0.0)):
        writer.write(CMD_VEL, CMD_VEL.name, encode(twist(velocity, 0.0)), int(time_s * 1e9))
    writer.close()
    assert run(["report", str(tmp_path / "forged.mcap")]) == 0
    why = "no sign, no steering and no joystick was live"
    assert f"no reason:  0.3 s (motion without a live reason, at 1.00 s: {why})" in capsys.readouterr().out
    texts = Page(tmp_path / "forged.html").texts
    section = texts[texts.index("Motion without a live reason") :]
    assert section[:7] == ["Motion without a live reason", "at", "for", "why not", "1.00 s", "0.30 s", why]


def test_the_verb_prints_json(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["report", str(recording), "--json"]) == 0
    totals = json.loads(capsys.readouterr().out)
    assert totals["frames"] == 241
    assert not recording.with_suffix(".html").exists()


def test_the_report_on_a_folder_is_next_to_it(recording: Path, tmp_path: Path) -> None:
    as_ros2(recording, tmp_path / "rosbag2-10.00.00", StoragePlugin.MCAP)
    assert run(["report", str(tmp_path / "rosbag2-10.00.00")]) == 0
    assert (tmp_path / "rosbag2-10.00.00.html").is_file()


def test_the_verb_refuses_what_has_nothing_to_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    McapWriter(tmp_path / "empty.mcap").close()
    assert run(["report", str(tmp_path / "empty.mcap")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "empty.html").exists()


def test_a_terminal_gets_no_control_characters(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    writer = McapWriter(tmp_path / "drive.mcap")
    topic: Topic[String] = HAND_SIGN
    writer.write(topic, topic.name, encode(String(data="\x1b[2JForward")), 0)
    writer.close()
    assert run(["report", str(tmp_path / "drive.mcap")]) == 0
    printed = capsys.readouterr().out
    assert "?[2JForward" in printed
    assert "\x1b" not in printed


class TestInABrowser:
    pytestmark = NEEDS_A_BROWSER

    def test_the_charts_are_drawn_without_network_in_light_and_dark_and_on_a_phone(self, page: Path) -> None:
        with a_browser() as browser:
            opened = browser.new_context(offline=True, viewport={"width": 1440, "height": 900}).new_page()
            requests: list[str] = []
            troubles: list[str] = []

            def note(request: Request) -> None:
                if not request.url.startswith(("data:", "blob:")):
                    requests.append(request.url)

            opened.on("request", note)
            opened.on("console", lambda message: troubles.append(message.text))
            opened.on("pageerror", lambda error: troubles.append(str(error)))
            opened.goto(page.as_uri())
            for chart in ("timeline", "map"):
                opened.locator(f"#{chart} .main-svg").first.wait_for(timeout=PATIENCE_MS)
            assert opened.locator("#timeline .scatterlayer .trace").count() >= 10
            assert opened.locator("#map .shapelayer path").count() >= 13
            found = (
                Axe().run(opened, options={"runOnly": ["wcag2a", "wcag2aa", "best-practice"]}).response["violations"]
            )
            assert [fault["help"] for fault in found] == []
            panel = opened.locator("#timeline .nsewdrag").last
            panel.scroll_into_view_if_needed()
            box = panel.bounding_box()
            assert box is not None
            middle = box["y"] + box["height"] / 2
            opened.mouse.move(box["x"] + 0.25 * box["width"], middle)
            opened.mouse.down()
            opened.mouse.move(box["x"] + 0.5 * box["width"], middle, steps=5)
            opened.mouse.up()
            zoomed = opened.locator("#timeline").evaluate("chart => chart.layout.xaxis.range")
            assert zoomed == pytest.approx([2.0, 4.0], abs=0.1)
            opened.emulate_media(color_scheme="dark")
            opened.set_viewport_size({"width": 390, "height": 800})
            drawing = opened.locator("#timeline .main-svg").first
            for _ in range(PATIENCE_MS // 50):
                if drawing.evaluate("svg => svg.clientWidth") <= 390:
                    break
                opened.wait_for_timeout(50)
            assert opened.evaluate("document.documentElement.scrollWidth") <= 390
            assert requests == [page.as_uri()]
            assert troubles == []

    def test_names_in_a_recording_run_nothing(self, tmp_path: Path) -> None:
        write_report(evil_recording(tmp_path / "evil.mcap"), tmp_path / "evil.html")
        with a_browser() as browser:
            opened = browser.new_context(offline=True).new_page()
            dialogs: list[str] = []
            opened.on("dialog", lambda dialog: dialogs.append(dialog.message))
            opened.goto((tmp_path / "evil.html").as_uri())
            opened.locator("#timeline .main-svg").first.wait_for(timeout=PATIENCE_MS)
            assert "</script><script>" in str(opened.locator("#timeline").text_content())
            assert dialogs == []
