from collections.abc import Iterator

import pytest

from handsteer.clock import WallClock
from handsteer.transports import join
from handsteer.transports.protocol import Session, Transport
from tests.contracts.transport_contract import TransportContract
from tests.ros1.graph import Ros1Graph, ros1_graph

pytestmark = pytest.mark.ros1


@pytest.fixture(scope="session")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros1Graph]:
    """The one master that rospy can have in this process."""
    with ros1_graph(tmp_path_factory.mktemp("ros")) as graph, pytest.MonkeyPatch.context() as patch:
        for name in ("ROS_MASTER_URI", "ROS_HOSTNAME", "ROS_HOME"):
            patch.setenv(name, graph.env[name])
        yield graph


@pytest.fixture(scope="session")
def session(graph: Ros1Graph) -> Session:
    """This process as a ROS node; it leaves the graph when the process ends."""
    return join("ros1", "tests", ["__ns:=bench"])


class TestRos1(TransportContract):
    settle_s = 0.3

    @pytest.fixture
    def transport(self, session: Session) -> Iterator[Transport]:
        from handsteer.transports.ros1.transport import Ros1Transport  # noqa: PLC0415 - only where ROS 1 is

        transport = Ros1Transport(session.clock)
        yield transport
        transport.close()

    @pytest.fixture
    def clock(self, session: Session) -> WallClock:
        assert isinstance(session.clock, WallClock)
        return session.clock
