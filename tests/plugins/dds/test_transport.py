import subprocess
import sys
from collections.abc import Iterator

import pytest

from handsteer.testing.transport_contract import SessionContract
from handsteer.transports import join
from handsteer.transports.base import Session
from tests.dds.graph import free_domain

pytest.importorskip("cyclonedds")


class TestDds(SessionContract):
    @pytest.fixture
    def session(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))
        session = join("dds", "tests", ["--ros-args", "-r", "__ns:=/r1"])
        yield session
        session.close()


def test_without_cyclonedds_it_says_what_to_install() -> None:
    program = "import sys; sys.modules['cyclonedds'] = None; from handsteer.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", program, "control", "--transport", "dds"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert f"needs the package cyclonedds: run {sys.executable} -m pip install 'cyclonedds" in done.stderr
    assert "Traceback" not in done.stderr
