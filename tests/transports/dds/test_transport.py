import subprocess
import sys
from collections.abc import Iterator

import pytest

from handsteer.clock import Clock, WallClock
from handsteer.transports import join
from handsteer.transports.base import Session, Transport
from tests.contracts.transport_contract import TransportContract
from tests.dds.graph import free_domain

pytest.importorskip("cyclonedds")


class TestDds(TransportContract):
    settle_s = 0.3

    def name_of(self, node: str) -> str:
        return "/r1/tests"

    @pytest.fixture
    def session(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))
        session = join("dds", "tests", ["--ros-args", "-r", "__ns:=/r1"])
        yield session
        session.close()

    @pytest.fixture
    def transport(self, session: Session) -> Transport:
        return session.transport

    @pytest.fixture
    def clock(self, session: Session) -> Clock:
        assert isinstance(session.clock, WallClock)
        return session.clock

    def test_the_process_has_its_full_name(self, session: Session) -> None:
        assert session.name == "/r1/tests"
        assert session.transport.full_name("my_camera") == "r1/tests: my_camera"


def test_without_cyclonedds_it_says_what_to_install() -> None:
    program = "import sys; sys.modules['cyclonedds'] = None; from handsteer.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", program, "control", "--transport", "dds"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "needs the package cyclonedds: run pip install 'handsteer[dds]'" in done.stderr
    assert "Traceback" not in done.stderr
