"""The server of topics, by real clients."""

import random
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from handsteer.clock import RealClock
from handsteer.config import Config, FoxgloveConfig, load
from handsteer.errors import LiveError
from handsteer.graph import Graph
from handsteer.messages import (
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    ROBOT_DESCRIPTION,
    SCAN,
    Header,
    Image,
    String,
    Time,
    Topic,
)
from handsteer.plugins.foxglove.server import LiveServer
from handsteer.transports.in_process import InProcessTransport
from tests.plugins.foxglove.viewer import NEW, OLD, Viewer
from tests.processes import eventually

TOPICS = (HAND_SIGN, IMAGE_RAW, SCAN, ROBOT_DESCRIPTION)
ON_DEMAND = (
    "/scan",
    "/image_raw/compressed",
    "/gesture/image_annotated",
    "/gesture/image_landmarks",
    "/gesture/image_drawn",
    "/camera_info",
    "/gesture/joy",
)


@contextmanager
def served(transport: InProcessTransport, **config: object) -> Iterator[str]:
    settings = FoxgloveConfig.model_validate({"port": 0, **config})
    server = LiveServer(transport, RealClock(), TOPICS, settings)
    try:
        yield server.start()
    finally:
        server.stop()


@pytest.fixture
def transport() -> Iterator[InProcessTransport]:
    transport = InProcessTransport()
    yield transport
    transport.close()


@pytest.fixture
def address(transport: InProcessTransport) -> Iterator[str]:
    with served(transport) as address:
        yield address


@contextmanager
def driving(**sections: dict[str, object]) -> Iterator[tuple[Graph, str]]:
    camera = {"source": "virtual", "width": 320, "height": 240, "fps": 15}
    config: Config = load(base={"camera": camera, "virtual_hand": {"script": "Stop:1 Forward:600"}, **sections})
    with Graph(config) as graph:
        server = LiveServer(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0))
        address = server.start()
        graph.start()
        try:
            yield graph, address
        finally:
            server.stop()


def picture(number: int, side: int = 400) -> Image:
    data = np.zeros(side * side * 3, np.uint8)
    return Image(Header(Time(0, 0), str(number)), side, side, "bgr8", 0, side * 3, data)


@pytest.mark.slow
def test_every_message_of_every_topic_of_a_drive_is_read() -> None:
    with driving() as (graph, address), Viewer(address) as viewer:
        quiet = {"/stop", "/stopped", "/joy", "/clock", "/steering/cmd_vel", "/audit"}
        assert set(viewer.channels) == {topic.name for topic in graph.topics}
        viewer.subscribe(viewer.channels)
        often = set(viewer.channels) - quiet - {"/robot_description"}
        seen = viewer.until(often, 20)
        signs = {each.message.data for each in seen if each.topic == "/gesture/hand_sign"}
        assert signs <= {"NONE", "Stop", "Forward"}
        (description,) = [each.message.data for each in seen if each.topic == "/robot_description"]
        assert "<robot" in description
        assert all(abs(each.time_ns / 1e9 - time.time()) < 120 for each in seen)
        viewer.unsubscribe(set(viewer.channels) - {CMD_VEL.name})
        eventually(lambda: (seen := viewer.next()).topic == CMD_VEL.name and seen.message.linear.x > 0)


@pytest.mark.slow
def test_topics_on_demand_are_computed_only_while_a_client_looks() -> None:
    with driving() as (graph, address):
        publishers = {name: graph.transport.advertise("probe", topic_of(graph, name)) for name in ON_DEMAND}

        def wanted() -> set[str]:
            return {name for name, publisher in publishers.items() if publisher.has_subscribers}

        # The control of the joystick subscribes to nothing in the mode for signs.
        assert not wanted()
        with Viewer(address) as viewer:
            viewer.subscribe(ON_DEMAND)
            eventually(lambda: wanted() == set(ON_DEMAND))
            viewer.until(ON_DEMAND)
            viewer.unsubscribe(["/scan"])
            eventually(lambda: wanted() == set(ON_DEMAND) - {"/scan"})
        eventually(lambda: not wanted(), what="the end of all subscriptions of a client that has left")


def topic_of(graph: Graph, name: str) -> Topic[Any]:
    return next(topic for topic in graph.topics if topic.name == name)


@pytest.mark.parametrize("protocol", [NEW, OLD])
def test_both_names_of_the_protocol(transport: InProcessTransport, address: str, protocol: str) -> None:
    with Viewer(address, protocol) as viewer:
        assert viewer.socket.subprotocol == protocol
        assert viewer.info["op"] == "serverInfo"
        assert viewer.info["capabilities"] == []
        assert viewer.channels["/gesture/hand_sign"]["schemaName"] == "std_msgs/msg/String"
        viewer.subscribe(["/gesture/hand_sign"])
        publisher = transport.advertise("recognition", HAND_SIGN)
        eventually(lambda: publisher.has_subscribers)
        publisher.publish(String(data="Go"))
        assert viewer.next().message.data == "Go"


def test_another_protocol_is_refused(address: str) -> None:
    with pytest.raises(InvalidHandshake):
        Viewer(address, "chat")


def test_every_client_gets_the_last_message_of_a_latched_topic(transport: InProcessTransport, address: str) -> None:
    transport.advertise("robot", ROBOT_DESCRIPTION).publish(String(data="<robot/>"))
    for _ in range(2):
        with Viewer(address) as first, Viewer(address) as second:
            for viewer in (first, second):
                viewer.subscribe([ROBOT_DESCRIPTION.name])
                assert viewer.next().message.data == "<robot/>"


def test_a_client_that_never_reads_delays_no_other(transport: InProcessTransport, address: str) -> None:
    publisher = transport.advertise("camera", IMAGE_RAW)
    with Viewer(address) as deaf, Viewer(address) as viewer:
        viewer.subscribe([IMAGE_RAW.name])
        eventually(lambda: publisher.has_subscribers)
        deaf.subscribe([IMAGE_RAW.name])
        for number in range(200):
            publisher.publish(picture(number))
            assert int(viewer.next().message.header.frame_id) == number
        # What the deaf one finds is as much as its connection holds, and then the newest.
        publisher.publish(picture(1000))
        numbers = [int(deaf.next().message.header.frame_id)]
        while numbers[-1] != 1000:
            numbers.append(int(deaf.next().message.header.frame_id))
        assert numbers == sorted(set(numbers))
        assert len(numbers) < 100


def test_a_flood_keeps_the_newest_in_order(transport: InProcessTransport, address: str) -> None:
    with Viewer(address) as viewer:
        viewer.subscribe([HAND_SIGN.name])
        publisher = transport.advertise("recognition", HAND_SIGN)
        eventually(lambda: publisher.has_subscribers)
        for number in range(20_000):
            publisher.publish(String(data=str(number)))
        numbers = [int(viewer.next().message.data)]
        while numbers[-1] != 19_999:
            numbers.append(int(viewer.next().message.data))
        assert numbers == sorted(set(numbers))


WRONG = [
    "no json",
    "[1]",
    "null",
    '{"op": "subscribe"}',
    '{"op": "subscribe", "subscriptions": 3}',
    '{"op": "subscribe", "subscriptions": [3]}',
    '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}',
    '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
    '{"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 1}]}',
    '{"op": "subscribe", "subscriptions": [{"id": 1e3, "channelId": 1}]}',
    '{"op": "subscribe", "subscriptions": [{"id": true, "channelId": 1}]}',
    '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}, {"id": 2, "channelId": 1}]}',
    '{"op": "unsubscribe", "subscriptionIds": ["a"]}',
    "[" * 100_000,
    "9" * 100_000,
    b"",
    b"\x01",
    b"\x01\x00\x00\x00\x00" + b"\xff" * 50,
]


@pytest.mark.parametrize("wrong", WRONG, ids=range(len(WRONG)))
def test_a_wrong_request_gets_a_warning_and_the_next_is_served(
    transport: InProcessTransport, address: str, wrong: str | bytes
) -> None:
    transport.advertise("robot", ROBOT_DESCRIPTION).publish(String(data="<robot/>"))
    with Viewer(address) as viewer:
        viewer.socket.send(wrong)
        said = viewer.said()
        assert said["op"] == "status"
        assert said["level"] == 1
        viewer.subscribe([ROBOT_DESCRIPTION.name])
        assert viewer.next().message.data == "<robot/>"


@pytest.mark.parametrize(
    "unknown", ['{"op": "getParameters"}', "{}", '{"op": ["a"]}', '{"op": "fetchAsset", "uri": 1}']
)
def test_what_the_server_does_not_offer_is_ignored(address: str, unknown: str) -> None:
    with Viewer(address) as viewer:
        viewer.socket.send(unknown)
        viewer.socket.send("no json")
        assert viewer.said()["message"] == "expected JSON"


def test_a_client_cannot_publish(address: str) -> None:
    with Viewer(address) as viewer:
        viewer.ask(op="advertise", channels=[{"id": 1, "topic": "/cmd_vel", "encoding": "cdr", "schemaName": "x"}])
        viewer.socket.send(b"\x01\x01\x00\x00\x00" + b"\x00" * 52)
        assert "read-only" in viewer.said()["message"]


def test_a_huge_request_ends_its_connection_only(transport: InProcessTransport, address: str) -> None:
    with Viewer(address) as other, Viewer(address) as viewer:
        viewer.socket.send('{"op": "' + "a" * 10_000_000)
        with pytest.raises(ConnectionClosed, match="1009"):
            viewer.said()
        transport.advertise("robot", ROBOT_DESCRIPTION).publish(String(data="<robot/>"))
        other.subscribe([ROBOT_DESCRIPTION.name])
        assert other.next().message.data == "<robot/>"


def test_random_bytes_end_nothing(transport: InProcessTransport, address: str) -> None:
    transport.advertise("robot", ROBOT_DESCRIPTION).publish(String(data="<robot/>"))
    dice = random.Random(3)
    site = urlsplit(address)
    for number in range(60):
        if number % 2:  # before the handshake
            raw = socket.create_connection((site.hostname, site.port))
        else:  # after it: frames of any kind
            viewer = Viewer(address)
            raw = viewer.socket.socket
        with raw:
            for _ in range(dice.randrange(1, 4)):
                try:
                    raw.sendall(dice.randbytes(dice.randrange(1, 3000)))
                except OSError:
                    break
    with Viewer(address) as viewer:
        viewer.subscribe([ROBOT_DESCRIPTION.name])
        assert viewer.next().message.data == "<robot/>"


def test_clients_that_change_their_minds_all_the_time_cost_the_graph_little(
    transport: InProcessTransport, address: str
) -> None:
    changes = count()
    subscribe = transport.subscribe
    transport.subscribe = lambda *what: (next(changes), subscribe(*what))[1]  # type: ignore[method-assign]
    began_s = time.monotonic()
    with Viewer(address) as viewer:
        for _ in range(200):
            viewer.subscribe([SCAN.name])
            viewer.unsubscribe([SCAN.name])
        viewer.socket.send("no json")
        viewer.said()
    assert next(changes) <= 2 + 10 * (time.monotonic() - began_s)


def test_there_are_only_so_many_clients(address: str) -> None:
    viewers: list[Viewer] = []
    try:
        viewers.extend(Viewer(address) for _ in range(16))
        with pytest.raises(InvalidHandshake, match="503"):
            Viewer(address)
        viewers.pop().socket.close()

        def connects() -> bool:
            try:
                viewers.append(Viewer(address))
            except InvalidHandshake:
                return False
            return True

        assert eventually(connects)
    finally:
        for viewer in viewers:
            viewer.socket.close()


@pytest.mark.parametrize("settings", [{"token": "always"}, {"host": "0.0.0.0"}])
def test_the_token_is_asked_for(transport: InProcessTransport, settings: dict[str, str]) -> None:
    with served(transport, **settings) as address:
        site = urlsplit(address)
        assert site.query.startswith("token=")
        token = site.query.removeprefix("token=")
        bare = f"ws://127.0.0.1:{site.port}"
        for wrong in (bare, f"{bare}/?token=", f"{bare}/?token={token}a", f"{bare}/?token=%ff&token={token}"):
            with pytest.raises(InvalidHandshake, match="401"):
                Viewer(wrong)
        # With the token, any page may connect.
        Viewer(f"{bare}/?token={token}", headers=[("Origin", "https://viewer.example")]).socket.close()
        Viewer(bare, headers=[("Authorization", f"Bearer {token}")]).socket.close()


def test_pages_of_other_sites_are_refused(address: str, caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(InvalidHandshake, match="401"):
        Viewer(address, headers=[("Origin", "https://evil.example")])
    assert "--foxglove.token always" in caplog.text
    Viewer(address, headers=[("Origin", "https://app.foxglove.dev")]).socket.close()


def test_a_port_in_use(transport: InProcessTransport, address: str) -> None:
    port = urlsplit(address).port
    with pytest.raises(LiveError, match=rf"^port {port} on 127\.0\.0\.1 is in use: choose another with --foxglove N"):
        LiveServer(transport, RealClock(), TOPICS, FoxgloveConfig(port=port)).start()


def test_the_end_disconnects_everyone(transport: InProcessTransport) -> None:
    with served(transport) as address:
        viewer, deaf = Viewer(address), Viewer(address)
        for each in (viewer, deaf):
            each.subscribe([IMAGE_RAW.name])
        publisher = transport.advertise("camera", IMAGE_RAW)
        eventually(lambda: publisher.has_subscribers)
        for number in range(50):
            publisher.publish(picture(number))
    with pytest.raises(ConnectionClosed):
        viewer.until(["no such topic"])
    assert not publisher.has_subscribers
    assert not [thread for thread in threading.enumerate() if thread.name == "foxglove"]
    deaf.socket.close()
