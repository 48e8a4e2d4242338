"""Recording on the page, in a real browser."""

import resource
import signal
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page

from handsteer.plugins.record.mcap_reader import McapFile
from tests.plugins.page.test_steer_in_browser import press, take_seat
from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

RECORD, END = "Start a recording", "End recording"


@pytest.fixture
def visit(tmp_path: Path) -> Iterator[Visit]:
    with visiting("Stop:1 Forward:1", recording={"folder": str(tmp_path / "recordings")}) as visit:
        yield visit


def start(visit: Visit) -> None:
    take_seat(visit)
    press(visit.page, RECORD)
    visit.page.get_by_role("button", name=END).wait_for()


def card_of(page: Page) -> str:
    return page.locator(".record").inner_text()


def test_the_driver_records_everybody_sees_it_and_the_file_is_downloaded(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    start(visit)
    visit.wait_until(lambda: visit.text(".record .time") == "0:02")
    assert page.locator(".record .lamp").is_visible()
    assert page.locator(".top .recorded").is_visible()

    other = visit.another_page()
    other.goto(page.url)
    other.locator(".record .lamp:not(.hidden)").wait_for()
    assert not other.get_by_role("button", name=END).is_visible()
    address = f"{page.url.rstrip('/')}/recordings/"
    (path,) = (tmp_path / "recordings").iterdir()
    for name in (path.name, "..%2f..%2fetc%2fpasswd", "missing.mcap"):
        with pytest.raises(urllib.error.HTTPError) as refused:  # the first one is being written
            urllib.request.urlopen(address + name, timeout=30)
        assert refused.value.code == 404

    press(page, END)
    download = page.get_by_role("link", name="Download")
    download.wait_for()
    other.get_by_role("link", name="Download").wait_for()
    with page.expect_download() as downloaded:
        download.click()
    assert downloaded.value.suggested_filename == path.name
    file = McapFile(Path(downloaded.value.path()))
    topics = {recorded.topic for recorded in file.messages()}
    assert file.problem is None
    assert {"/image_raw/compressed", "/gesture/hand_sign", "/audit", "/diagnostics"} <= topics

    press(page, "Make report")
    page.get_by_role("link", name="Report").wait_for()
    shown = visit.another_page()
    faults: list[str] = []
    shown.on("pageerror", lambda error: faults.append(str(error)))
    shown.goto(page.url.rstrip("/") + str(page.get_by_role("link", name="Report").get_attribute("href")))
    shown.locator(".js-plotly-plot .main-svg").first.wait_for()  # its scripts run, in their sandbox
    assert path.name in shown.locator("h1").inner_text()
    assert faults == []
    assert visit.troubles == []


def test_a_viewer_cannot_record(visit: Visit, tmp_path: Path) -> None:
    take_seat(visit)
    other = visit.another_page()
    other.goto(visit.page.url)
    other.locator(".steer .hint", has_text="You watch").wait_for()
    button = other.locator(".record .text-button", has_text="Record").first
    assert not button.is_visible()
    button.dispatch_event("click")
    visit.wait_until(lambda: "Only the driver can record" in card_of(other))
    assert not (tmp_path / "recordings").exists()


def test_a_second_start_is_refused_and_the_first_goes_on(visit: Visit, tmp_path: Path) -> None:
    start(visit)
    visit.page.locator(".record .text-button", has_text="Record").first.dispatch_event("click")
    visit.wait_until(lambda: "end that first" in card_of(visit.page))
    assert len(list((tmp_path / "recordings").iterdir())) == 1
    assert visit.page.get_by_role("button", name=END).is_visible()


def test_a_full_disk_is_shown_and_driving_goes_on(visit: Visit) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        start(visit)
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, limits[1]))
        visit.wait_until(lambda: "The recording has ended: File too large. Driving goes on." in card_of(visit.page))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    frames = visit.graph.camera.frames
    visit.wait_until(lambda: visit.graph.camera.frames > frames + 10)
    visit.page.get_by_role("link", name="Download").wait_for()
    press(visit.page, RECORD)
    visit.page.get_by_role("button", name=END).wait_for()


def test_a_recording_of_the_command_line_is_shown_and_can_be_ended(visit: Visit, tmp_path: Path) -> None:
    visit.graph.record(tmp_path / "mine.mcap")
    visit.page.locator(".record .lamp:not(.hidden)").wait_for()
    take_seat(visit)
    press(visit.page, END)
    visit.wait_until(lambda: not visit.page.locator(".record .lamp").is_visible())
    assert "mine.mcap" in card_of(visit.page)
    assert not visit.page.get_by_role("link", name="Download").is_visible(), "it is not in the folder of recordings"
    assert McapFile(tmp_path / "mine.mcap").problem is None
