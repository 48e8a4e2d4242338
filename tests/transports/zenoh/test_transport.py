import subprocess
import sys
from collections.abc import Iterator

import pytest

from handsteer.clock import Clock, WallClock
from handsteer.transports import join
from handsteer.transports.base import Session, Transport
from tests.contracts.transport_contract import TransportContract
from tests.processes import free_port

pytest.importorskip("zenoh")


class TestZenoh(TransportContract):
    settle_s = 0.3

    def name_of(self, node: str) -> str:
        return "/r1/tests"

    @pytest.fixture
    def session(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
        # No router, and nobody else: this process talks to itself.
        monkeypatch.setenv("ZENOH_ROUTER_CHECK_ATTEMPTS", "-1")
        monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'connect/endpoints=["tcp/127.0.0.1:{free_port()}"]')
        session = join("zenoh", "tests", ["--ros-args", "-r", "__ns:=/r1"])
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


@pytest.mark.slow
@pytest.mark.parametrize("module", ["zenoh", "xxhash"])
def test_without_zenoh_it_says_what_to_install(module: str) -> None:
    program = f"import sys; sys.modules['{module}'] = None; from handsteer.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", program, "control", "--transport", "zenoh"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert f"the transport zenoh needs the package {module}: run pip install 'handsteer[zenoh]'" in done.stderr
    assert "Traceback" not in done.stderr
