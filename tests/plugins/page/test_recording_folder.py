import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import RecordingError
from handsteer.plugins.page.recording_folder import RecordingFolder

NOW = datetime.datetime(2026, 11, 22, 22, 20, 0)


def test_names_have_date_and_time_and_differ_within_a_second(tmp_path: Path) -> None:
    folder = RecordingFolder(tmp_path / "my" / "recordings")
    first = folder.new(NOW)
    assert first.name == "handsteer-2026-11-22T22-20-00.mcap"
    first.touch()
    second = folder.new(NOW)
    assert second.name == "handsteer-2026-11-22T22-20-00-2.mcap"
    assert folder.find(first.name) == first
    assert folder.find(second.name) is None


def test_a_folder_that_cannot_be_created(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot create the folder"):
        RecordingFolder(tmp_path / "file" / "recordings").new(NOW)


@pytest.mark.parametrize(
    "name", ["../secret.mcap", "a/../../secret.mcap", "/etc/passwd", "..", "", "link.mcap", "d.mcap"]
)
def test_nothing_outside_the_folder_is_found(name: str, tmp_path: Path) -> None:
    (tmp_path / "secret.mcap").touch()
    folder = tmp_path / "recordings"
    (folder / "d.mcap").mkdir(parents=True)
    (folder / "a").mkdir()
    (folder / "link.mcap").symlink_to(tmp_path / "secret.mcap")
    assert RecordingFolder(folder).find(name) is None


@given(st.text(max_size=300))
def test_any_name_may_be_asked_for(name: str) -> None:
    assert RecordingFolder(Path("missing")).find(name) is None
