import subprocess
import sys
from collections.abc import Iterator

import pytest

from handsteer.testing.transport_contract import SessionContract
from handsteer.transports import join
from handsteer.transports.base import Session
from tests.processes import free_port

pytest.importorskip("zenoh")


class TestZenoh(SessionContract):
    @pytest.fixture
    def session(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
        # No router, and nobody else: this process talks to itself.
        monkeypatch.setenv("ZENOH_ROUTER_CHECK_ATTEMPTS", "-1")
        monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'connect/endpoints=["tcp/127.0.0.1:{free_port()}"]')
        session = join("zenoh", "tests", ["--ros-args", "-r", "__ns:=/r1"])
        yield session
        session.close()


@pytest.mark.slow
@pytest.mark.parametrize("module", ["zenoh", "xxhash"])
def test_without_zenoh_it_says_what_to_install(module: str) -> None:
    program = f"import sys; sys.modules['{module}'] = None; from handsteer.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", program, "control", "--transport", "zenoh"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert (
        f"the transport zenoh needs the package {module}: run {sys.executable} -m pip install 'eclipse-zenoh"
        in done.stderr
    )
    assert "Traceback" not in done.stderr
