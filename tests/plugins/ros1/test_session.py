import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from handsteer.errors import TransportError
from handsteer.messages import GESTURE_JOY, HAND_SIGN, STOP, STOPPED, Image, Joy, Topic, type_name
from handsteer.nodes.base import Node
from handsteer.testing.transport_contract import SessionContract, eventually
from handsteer.transports import join
from handsteer.transports.base import Received, Session, Transport
from tests.ros1.graph import Ros1Graph, ros1_graph

pytestmark = pytest.mark.ros1


@pytest.fixture(scope="session")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros1Graph]:
    """The one master that rospy can have in this process."""
    with ros1_graph(tmp_path_factory.mktemp("ros")) as graph, pytest.MonkeyPatch.context() as patch:
        for name in ("ROS_MASTER_URI", "ROS_HOSTNAME", "ROS_HOME"):
            patch.setenv(name, graph.env[name])
        yield graph


class TestRos1(SessionContract):
    full_name = "/tests"

    @pytest.fixture(scope="session")
    def session(self, graph: Ros1Graph) -> Session:
        """This process as a ROS node; it leaves the graph when the process ends."""
        return join("ros1", "tests", [])

    @pytest.fixture
    def transport(self, session: Session) -> Iterator[Transport]:
        from handsteer.plugins.ros1.topics import Ros1Transport  # noqa: PLC0415 - only where ROS 1 is

        transport = Ros1Transport(session.clock)
        yield transport
        transport.close()

    @pytest.mark.slow
    def test_a_slow_node_gets_fresh_images(self, graph: Ros1Graph, make_node: Callable[[str], Node]) -> None:
        """The transport hands on each image, for bags; the node keeps a camera's newest, so that none waits."""
        listener = make_node("listener")
        ages_s: list[float] = []
        done = threading.Event()

        def callback(received: Received[Image]) -> None:
            assert received.captured_s is not None
            ages_s.append(listener.clock.now() - received.captured_s)
            time.sleep(0.1)
            if len(ages_s) == 40:
                done.set()

        topic = Topic("/fast_camera", Image, is_global=True)
        listener.subscribe(topic, callback)
        listener.start()
        camera = graph.peer("__name:=fast_camera")
        camera.ask("advertise", topic=topic.name, package="sensor_msgs", type="Image")
        assert eventually(lambda: camera.ask("listeners", topic=topic.name) > 0)
        camera.ask("stream", topic=topic.name, width=320, height=240, period_s=1 / 30, count=100_000)
        assert done.wait(60.0)
        camera.kill()
        # It is 1.3 s for a callback of the transport; a fresh one is at most as old as one callback is long, 0.1 s.
        assert float(np.median(ages_s)) < 0.7, ages_s

    def test_a_node_that_has_subscribed_to_stop_knows_at_once_who_reports_stops(self, transport: Transport) -> None:
        """Until it knows, a control follows no sign; the master is polled every four seconds."""
        transport.advertise("early", STOPPED)
        transport.subscribe("early", STOP, lambda received: None)
        assert transport.publishers_of(STOPPED) == ["/tests"]

    def test_a_hand_that_a_link_has_held_back_is_late_whatever_the_clock_of_its_machine_says(
        self, graph: Ros1Graph, transport: Transport
    ) -> None:
        came: list[tuple[float, bool]] = []

        def note(received: Received[Joy]) -> None:
            came.append((received.message.axes[1], received.is_late))

        transport.subscribe("listener", GESTURE_JOY, note)
        hand = graph.peer("__name:=hand_elsewhere")
        hand.ask("advertise", topic="/gesture/joy", package="sensor_msgs", type="Joy")
        assert eventually(lambda: hand.ask("listeners", topic="/gesture/joy") > 0)

        def show(forward: float, *, held: bool, delay_s: float) -> None:
            stamp_s = time.time() + 60.0 - delay_s
            values = {"axes": [0.0, forward], "buttons": [int(held)], "header.stamp": stamp_s}
            hand.ask("publish", topic="/gesture/joy", values=values)

        show(0.5, held=True, delay_s=0.0)
        assert eventually(lambda: came == [(0.5, False)])
        show(0.75, held=True, delay_s=0.8)
        show(0.0, held=False, delay_s=0.8)
        assert eventually(lambda: came[1:] == [(0.0, True)]), came
        show(1.0, held=True, delay_s=0.0)
        assert eventually(lambda: came[2:] == [(1.0, False)])

    @pytest.mark.parametrize(
        ("topic", "raw"),
        [
            pytest.param(HAND_SIGN, "03000000e4f6fc", id="no text"),
            pytest.param(GESTURE_JOY, "00" * 16 + "02000000" + "00" * 4, id="truncated"),
            pytest.param(GESTURE_JOY, "", id="empty"),
        ],
    )
    def test_messages_that_cannot_be_read_are_left_out_and_logged_once(
        self,
        graph: Ros1Graph,
        transport: Transport,
        caplog: pytest.LogCaptureFixture,
        topic: Topic[Any],
        raw: str,
    ) -> None:
        heard: list[Received[Any]] = []
        transport.subscribe("listener", topic, heard.append)
        package, _, kind = type_name(topic.type).split("/")
        peer = graph.peer("__name:=odd")
        peer.ask("advertise", topic=topic.name, package=package, type=kind)
        assert eventually(lambda: peer.ask("listeners", topic=topic.name) > 0)
        for _ in range(5):
            peer.ask("publish_raw", topic=topic.name, raw=raw)
        peer.ask("publish", topic=topic.name, values={})
        assert eventually(lambda: len(heard) > 0)
        assert len(heard) == 1
        # rospy, too, logs what it does with nodes of earlier tests that were killed.
        ours = [record for record in caplog.records if record.name.startswith("handsteer")]
        lines = [record.getMessage() for record in ours if record.levelno >= logging.WARNING]
        assert len(lines) == 1, lines
        assert lines[0].startswith(f"{topic.name}: a message of {len(raw) // 2} bytes cannot be read")
        peer.kill()

    def test_a_process_has_one_name(self, session: Session) -> None:
        with pytest.raises(TransportError, match=r"is the ROS node /tests already.*one a process.*process of its own"):
            join("ros1", "another", [])


def test_a_transport_that_is_not_there() -> None:
    with pytest.raises(TransportError, match="there is no transport 'carrier_pigeon': use dds or ros1"):
        join("carrier_pigeon", "camera", [])
