"""The master's address, without a master: who is surely gone, and who may only be busy."""

import socket
import threading
from collections.abc import Iterator

import pytest

from handsteer.errors import TransportError
from tests.processes import free_port

pytest.importorskip("rosgraph")

from handsteer.plugins.ros1.master import Lifeline, Master, MasterGone  # it imports rosgraph


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def uri(server: socket.socket) -> str:
    return f"http://localhost:{server.getsockname()[1]}"


def test_an_address_that_refuses_has_no_master() -> None:
    with pytest.raises(MasterGone, match=r"no ROS master answers at http://localhost:.*start roscore"):
        Master(f"http://localhost:{free_port()}").ping()


@pytest.mark.parametrize("waiting", [0, 8])
def test_one_that_does_not_answer_may_be_busy(listening: socket.socket, waiting: int) -> None:
    """Also where so many wait for it that the system takes no further connection; localhost's other address refuses."""
    listening.listen(1)
    others = [socket.socket() for _ in range(waiting)]
    for other in others:
        other.setblocking(False)
        other.connect_ex(listening.getsockname())
    with pytest.raises(TransportError) as caught:
        Master(uri(listening)).ping()
    assert not isinstance(caught.value, MasterGone)
    for other in others:
        other.close()


def test_a_lifeline_holds_until_the_other_end_dies(listening: socket.socket) -> None:
    line = Lifeline(uri(listening))
    assert line.wait(0.05)
    connection, _ = listening.accept()
    assert line.wait(0.05)
    threading.Timer(0.1, connection.close).start()
    listening.close()
    assert not line.wait(60.0)
    assert not line.wait(60.0)  # nor can it be made again
    line.close()
