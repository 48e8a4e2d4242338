"""Messages of the Foxglove WebSocket protocol, as far as a server of topics needs it.

Text is JSON with the field ``op``; binary messages begin with a byte for their kind. Clients that know the newer name
of the protocol (Foxglove) and those that know the older one (Lichtblick, older versions of Foxglove) both connect: what
is used here is the same in both.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from handsteer.errors import LiveError
from handsteer.messages import Topic, type_name
from handsteer.transports.ros2.encoding import message_definition

SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol, the preferred one first."""

LARGEST_REQUEST_BYTES: Final = 256 * 1024
"""A client's message is at most this long; one that subscribes to a hundred channels has 5 kB."""

_MESSAGE_DATA: Final = struct.Struct("<BIQ")
_MESSAGE_OPCODE: Final = 1
_LARGEST_ID: Final = 0xFFFF_FFFF
_WARNING: Final = 1


@dataclass(frozen=True)
class Subscribe:
    """A client subscribes.

    Attributes:
        channels: Number of the channel by the number that the client gives its subscription.
    """

    channels: Mapping[int, int]


@dataclass(frozen=True)
class Unsubscribe:
    """A client ends subscriptions.

    Attributes:
        subscriptions: Their numbers.
    """

    subscriptions: Sequence[int]


def server_info(session: str) -> str:
    """Return the first message to a client; ``session`` differs for each start of the server."""
    info = {"name": "handsteer", "capabilities": [], "supportedEncodings": [], "metadata": {}, "sessionId": session}
    return json.dumps({"op": "serverInfo", **info})


def advertise(channels: Mapping[int, tuple[str, Topic[Any]]]) -> str:
    """Return the message that offers ``channels``, each with the full name of its topic and the topic."""
    return json.dumps({"op": "advertise", "channels": [_channel(*each) for each in channels.items()]})


def _channel(number: int, named: tuple[str, Topic[Any]]) -> dict[str, Any]:
    name, topic = named
    kind = type_name(topic.type)
    schema = {"schemaName": kind, "schemaEncoding": "ros2msg", "schema": message_definition(kind)}
    return {"id": number, "topic": name, "encoding": "cdr", **schema}


def status(text: str) -> str:
    """Return a warning that clients show to people."""
    return json.dumps({"op": "status", "level": _WARNING, "message": text})


def message_data(subscription: int, time_ns: int, raw: bytes) -> bytes:
    """Return a message of a topic.

    Args:
        subscription: The number that the client gave its subscription.
        time_ns: When the message was received, in ns since 1970.
        raw: The message as little-endian CDR.
    """
    return _MESSAGE_DATA.pack(_MESSAGE_OPCODE, subscription, time_ns) + raw


def read_request(data: str | bytes) -> Subscribe | Unsubscribe | None:
    """Read what a client has sent; None if it asks for what this server does not offer.

    Raises:
        LiveError: It is not a message of the protocol.
    """
    if isinstance(data, bytes):
        raise LiveError("this server is read-only: it takes no messages on topics")
    try:
        request = json.loads(data)
    except (ValueError, RecursionError):
        raise LiveError("expected JSON") from None
    if not isinstance(request, dict):
        raise LiveError("expected a JSON object with the field op")
    if request.get("op") == "subscribe":
        pairs = [_pair(each) for each in _list(request, "subscriptions")]
        return Subscribe(dict(pairs))
    if request.get("op") == "unsubscribe":
        return Unsubscribe([_number(each, "subscriptionIds") for each in _list(request, "subscriptionIds")])
    return None


def _pair(each: object) -> tuple[int, int]:
    if not isinstance(each, dict):
        raise LiveError("subscriptions: expected objects with id and channelId")
    return _number(each.get("id"), "id"), _number(each.get("channelId"), "channelId")


def _list(request: dict[str, Any], name: str) -> list[Any]:
    value = request.get(name)
    if not isinstance(value, list):
        raise LiveError(f"{name}: expected a list")
    return value


def _number(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _LARGEST_ID:
        raise LiveError(f"{name}: expected a whole number from 0 to {_LARGEST_ID}")
    return value
