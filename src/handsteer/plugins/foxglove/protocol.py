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
from handsteer.messages import Topic, Twist, type_name, velocity_in
from handsteer.transports.encoding import decode, message_definition
from handsteer.types import Velocity

SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol, the preferred one first."""

LARGEST_REQUEST_BYTES: Final = 256 * 1024
"""A client's message is at most this long; one that subscribes to a hundred channels has 5 kB."""

_MESSAGE_DATA: Final = struct.Struct("<BIQ")
_CLIENT_DATA: Final = struct.Struct("<BI")
_MESSAGE_OPCODE: Final = 1
_COMMANDS: Final = "cmd_vel"
# The names of ROS 1 and 2.
_TWISTS: Final = ("geometry_msgs/Twist", "geometry_msgs/msg/Twist")
_ENCODINGS: Final = ("json", "cdr")
_LONGEST_NAME: Final = 200
_LARGEST_ID: Final = 0xFFFF_FFFF
_WARNING: Final = 1


@dataclass(frozen=True)
class Subscribe:
    """A client subscribes: numbers of channels by the numbers that it gives the subscriptions."""

    channels: Mapping[int, int]


@dataclass(frozen=True)
class Unsubscribe:
    """A client ends subscriptions, by their numbers."""

    subscriptions: Sequence[int]


@dataclass(frozen=True)
class ClientChannel:
    """A channel on which a client publishes.

    Attributes:
        topic: Full name of the topic.
        kind: Name of its type.
        encoding: How messages are encoded: ``json``, ``cdr`` or another.
    """

    topic: str
    kind: str
    encoding: str

    @property
    def has_commands(self) -> bool:
        """Whether its messages are commands that this server can read: Twist on a topic named ``cmd_vel``."""
        is_named = self.topic.rpartition("/")[2] == _COMMANDS
        return is_named and self.kind in _TWISTS and self.encoding in _ENCODINGS


@dataclass(frozen=True)
class Advertise:
    """A client will publish on these channels, by the numbers that it gives them."""

    channels: Mapping[int, ClientChannel]


@dataclass(frozen=True)
class Unadvertise:
    """A client will not publish any more on the channels of these numbers."""

    channels: Sequence[int]


@dataclass(frozen=True)
class Published:
    """A client has published a message.

    Attributes:
        channel: Number of the client's channel.
        content: The message, in the channel's encoding.
    """

    channel: int
    content: bytes


def server_info(session: str, *, takes_commands: bool) -> str:
    """Return the first message to a client.

    Args:
        session: Differs for each start of the server.
        takes_commands: Whether clients may publish commands.
    """
    can = {"capabilities": ["clientPublish"], "supportedEncodings": list(_ENCODINGS)} if takes_commands else {}
    nothing: dict[str, Any] = {"capabilities": [], "supportedEncodings": [], "metadata": {}}
    return json.dumps({"op": "serverInfo", "name": "handsteer", **nothing, **can, "sessionId": session})


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


Request = Subscribe | Unsubscribe | Advertise | Unadvertise | Published


def read_request(data: str | bytes) -> Request | None:
    """Read what a client has sent; None if it asks for what this server does not offer.

    Raises:
        LiveError: It is not a message of the protocol.
    """
    if isinstance(data, bytes):
        if len(data) < _CLIENT_DATA.size or data[0] != _MESSAGE_OPCODE:
            raise LiveError("expected the data of a message")
        return Published(_CLIENT_DATA.unpack_from(data)[1], data[_CLIENT_DATA.size :])
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
    if request.get("op") == "advertise":
        return Advertise(dict(_client_channel(each) for each in _list(request, "channels")))
    if request.get("op") == "unadvertise":
        return Unadvertise([_number(each, "channelIds") for each in _list(request, "channelIds")])
    return None


def read_command(content: bytes, encoding: str) -> Velocity:
    """Return the velocity in a Twist that a client has published.

    Raises:
        LiveError: It is not a Twist, or a number of it is not finite.
    """
    try:
        if encoding == "cdr":
            velocity = velocity_in(decode(content, type_name(Twist)))
        else:
            sent = json.loads(content)
            velocity = Velocity(_speed(sent, "linear", "x"), _speed(sent, "angular", "z"))
    except LiveError:
        raise
    except Exception:
        raise LiveError(f"expected geometry_msgs/Twist as {encoding}") from None
    if not velocity.is_finite:
        raise LiveError("a velocity is not a finite number")
    return velocity


def _pair(each: object) -> tuple[int, int]:
    if not isinstance(each, dict):
        raise LiveError("subscriptions: expected objects with id and channelId")
    return _number(each.get("id"), "id"), _number(each.get("channelId"), "channelId")


def _client_channel(each: object) -> tuple[int, ClientChannel]:
    if not isinstance(each, dict):
        raise LiveError("channels: expected objects with id, topic, encoding and schemaName")
    topic, kind, encoding = (str(each.get(name, ""))[:_LONGEST_NAME] for name in ("topic", "schemaName", "encoding"))
    return _number(each.get("id"), "id"), ClientChannel(topic, kind, encoding)


def _speed(twist: Any, vector: str, axis: str) -> float:
    value = twist.get(vector, {}).get(axis, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise LiveError(f"{vector}.{axis}: expected a number")
    return float(value)


def _list(request: dict[str, Any], name: str) -> list[Any]:
    value = request.get(name)
    if not isinstance(value, list):
        raise LiveError(f"{name}: expected a list")
    return value


def _number(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _LARGEST_ID:
        raise LiveError(f"{name}: expected a whole number from 0 to {_LARGEST_ID}")
    return value
