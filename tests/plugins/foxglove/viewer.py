"""A client of the Foxglove WebSocket protocol, as far as tests and benchmarks need it."""

import json
import struct
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from websockets.sync.client import connect
from websockets.typing import Subprotocol

PATIENCE_S = 60.0
NEW, OLD = "foxglove.sdk.v1", "foxglove.websocket.v1"


@dataclass(frozen=True)
class Seen:
    """A message as a viewer gets it.

    Attributes:
        topic: Its topic.
        time_ns: When it was received, as the server says.
        message: Decoded by ``mcap-ros2-support``.
    """

    topic: str
    time_ns: int
    message: Any


class Viewer:
    """A connected client.

    Args:
        address: Of the server, ``ws://...``.
        protocol: Name of the protocol.
        headers: Further headers.
    """

    def __init__(self, address: str, protocol: str = NEW, headers: Sequence[tuple[str, str]] = ()) -> None:
        self.closing = ExitStack()
        connecting = connect(
            address,
            subprotocols=[Subprotocol(protocol)],
            additional_headers=headers,
            max_size=None,
            compression=None,
            proxy=None,
            close_timeout=1,
        )
        self.socket = self.closing.enter_context(connecting)
        self.info = self.said()
        channels = self.said()["channels"]
        self.channels: dict[str, dict[str, Any]] = {channel["topic"]: channel for channel in channels}
        self._topics = {channel["id"]: channel["topic"] for channel in channels}
        self._decoders: dict[str, Callable[[bytes], Any]] = {}

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *_: object) -> None:
        self.closing.close()

    def said(self) -> dict[str, Any]:
        """Return the next text message."""
        while isinstance(data := self.socket.recv(PATIENCE_S), bytes):
            pass
        said: dict[str, Any] = json.loads(data)
        return said

    def ask(self, **request: Any) -> None:
        """Send a text message."""
        self.socket.send(json.dumps(request))

    def subscribe(self, topics: Iterable[str]) -> None:
        """Subscribe to ``topics``; the number of a subscription is that of the channel plus 100."""
        ids = [self.channels[topic]["id"] for topic in topics]
        self.ask(op="subscribe", subscriptions=[{"id": number + 100, "channelId": number} for number in ids])

    def unsubscribe(self, topics: Iterable[str]) -> None:
        """End the subscriptions to ``topics``."""
        self.ask(op="unsubscribe", subscriptionIds=[self.channels[topic]["id"] + 100 for topic in topics])

    def advertise(self, encoding: str = "json", topic: str = "/cmd_vel", kind: str = "geometry_msgs/Twist") -> None:
        """Offer commands, on the channel 7."""
        self.ask(op="advertise", channels=[{"id": 7, "topic": topic, "encoding": encoding, "schemaName": kind}])

    def publish(self, content: bytes) -> None:
        """Publish a message on the channel 7."""
        self.socket.send(struct.pack("<BI", 1, 7) + content)

    def command(self, linear_mps: float, angular_radps: float = 0.0) -> None:
        """Publish a Twist as JSON."""
        twist = {"linear": {"x": linear_mps, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": angular_radps}}
        self.publish(json.dumps(twist).encode())

    def raw(self) -> tuple[str, int, bytes]:
        """Return topic, time and content of the next message."""
        while isinstance(data := self.socket.recv(PATIENCE_S), str):
            pass
        opcode, subscription, time_ns = struct.unpack_from("<BIQ", data)
        assert opcode == 1
        return self._topics[subscription - 100], time_ns, data[13:]

    def next(self) -> Seen:
        """Return the next message."""
        topic, time_ns, raw = self.raw()
        return Seen(topic, time_ns, self._decoder(topic)(raw))

    def until(self, topics: Iterable[str], count: int = 1) -> list[Seen]:
        """Return the messages until ``count`` have come on each of ``topics``."""
        missing, seen = dict.fromkeys(topics, count), []
        deadline_s = time.monotonic() + PATIENCE_S
        while any(left > 0 for left in missing.values()):
            assert time.monotonic() < deadline_s, f"these have not come within {PATIENCE_S:g} s: {missing}"
            seen.append(self.next())
            if seen[-1].topic in missing:
                missing[seen[-1].topic] -= 1
        return seen

    def _decoder(self, topic: str) -> Callable[[bytes], Any]:
        if topic not in self._decoders:
            channel = self.channels[topic]
            schema = Schema(1, channel["schema"].encode(), channel["schemaEncoding"], channel["schemaName"])
            decoder = DecoderFactory().decoder_for(channel["encoding"], schema)
            assert decoder is not None
            self._decoders[topic] = decoder
        return self._decoders[topic]
