"""The file that keeps a Stop while a node waits for its master."""

from pathlib import Path

import pytest

pytest.importorskip("rospkg")

from handsteer.plugins.ros1.last_stop import LastStop


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def test_a_stop_is_kept_once_for_its_node_and_master(home: Path) -> None:
    kept = LastStop("http://a:11311", "/r1/control")
    assert not kept.take()
    kept.keep()
    assert not LastStop("http://a:11311", "/r2/control").take()
    assert not LastStop("http://b:11311", "/r1/control").take()
    assert LastStop("http://a:11311", "/r1/control").take()
    assert not kept.take()
    assert not list(home.iterdir())


def test_a_stop_whose_file_cannot_be_removed_holds(home: Path, caplog: pytest.LogCaptureFixture) -> None:
    kept = LastStop("http://a:11311", "/control")
    kept.keep()
    (file,) = home.iterdir()
    file.unlink()
    file.mkdir()  # not removed as a file, by any user
    assert kept.take()
    assert "cannot be removed" in caplog.text


def test_a_stop_that_cannot_be_kept_is_logged(home: Path, caplog: pytest.LogCaptureFixture) -> None:
    home.write_text("")
    LastStop("http://a:11311", "/control").keep()
    assert "cannot be kept" in caplog.text
    assert not LastStop("http://a:11311", "/control").take()
