"""Names of nodes, topics and types in ROS 2, with their remapping, and the encoding of messages: CDR."""

import dataclasses
import functools
import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from handsteer.errors import TransportError
from handsteer.messages import Topic, TurtlePose

M = TypeVar("M")

log = logging.getLogger(__name__)

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NODE = re.compile(_TOKEN)
_FULL = re.compile(rf"(/{_TOKEN})+")
_LONGEST = 255

_LARGEST = 232  # higher ones have no UDP ports in DDS

_FLOAT32: Any = (Nodetype.BASE, ("float32", 0))
_DISCOVERY = "rmw_dds_common/msg/ParticipantEntitiesInfo"
# It cannot be computed, because rosbags does not know that ROS 2 converts a char to uint8.
_KNOWN_HASHES = {_DISCOVERY: "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"}
_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
_PARAMETER_SERVICES = {
    "ListParameters": ("string[] prefixes\nuint64 depth", "rcl_interfaces/ListParametersResult result"),
    "GetParameters": ("string[] names", "rcl_interfaces/ParameterValue[] values"),
    "GetParameterTypes": ("string[] names", "uint8[] types"),
    "DescribeParameters": ("string[] names", "rcl_interfaces/ParameterDescriptor[] descriptors"),
    "SetParameters": ("rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult[] results"),
    "SetParametersAtomically": ("rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult result"),
}
"""Requests and replies of ROS 2's parameter services, which rosbags does not have: package rcl_interfaces, ``srv/``."""


@dataclass(frozen=True)
class Remap:
    """A rule ``-r source:=target``, for one node or for all; the source is a topic, ``__node`` or ``__ns``."""

    source: str
    target: str
    node: str | None = None

    def applies_to(self, node: str) -> bool:
        """Return whether the rule applies to the node of this name."""
        return self.node in {None, node}


@dataclass(frozen=True)
class NodeName:
    """A node's name and namespace (such as ``/`` or ``/r1``), and its rules for topics, of which the first applies."""

    name: str
    namespace: str = "/"
    remaps: tuple[Remap, ...] = ()

    @property
    def full(self) -> str:
        """The full name, such as ``/r1/my_camera``."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def topic(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic``, such as ``/r1/image_raw``, remapped.

        A topic that is beneath another is renamed with it, unless it has a rule of its own.

        Raises:
            TransportError: A rule results in a name that is not allowed.
        """
        full = self.expand(topic.ros_name)
        for rule in self.remaps:
            if rule.applies_to(self.name) and self.expand(rule.source) == full:
                return self.expand(rule.target)
        return full if topic.beneath is None else topic.moved_with(self.topic(topic.beneath))

    def expand(self, name: str) -> str:
        """Return the full name of one that may be relative (``a``), private (``~/a``) or contain ``{node}``, ``{ns}``.

        Raises:
            TransportError: It is not a valid topic name.
        """
        base = self.namespace.rstrip("/")
        full = name.replace("{node}", self.name).replace("{namespace}", base).replace("{ns}", base)
        if full == "~" or full.startswith("~/"):
            full = self.full + full[1:]
        elif not full.startswith("/"):
            full = f"{base}/{full}"
        if not _FULL.fullmatch(full) or len(full) > _LONGEST:
            raise TransportError(
                f"{name!r} is not a valid topic name in ROS 2: it should have letters, digits and _, as camera/image"
            )
        return full


def identify(node: str, remaps: Sequence[Remap]) -> NodeName:
    """Return the name of the node whose default name is ``node``, with ``remaps`` applied.

    Raises:
        TransportError: A rule has a name that is not allowed.
    """
    name = next((rule.target for rule in remaps if rule.source == "__node" and rule.applies_to(node)), node)
    if not _NODE.fullmatch(name) or len(name) > _LONGEST:
        raise TransportError(f"__node:={name}: the name of a node has letters, digits and _, as my_camera")
    namespace = next((rule.target for rule in remaps if rule.source == "__ns" and rule.applies_to(name)), "/")
    if namespace != "/" and (not _FULL.fullmatch(namespace) or len(namespace) > _LONGEST):
        raise TransportError(f"__ns:={namespace}: a namespace starts with a slash and does not end with one, as /r1")
    named = NodeName(name, namespace, tuple(rule for rule in remaps if not rule.source.startswith("__")))
    for rule in named.remaps:
        named.expand(rule.source)
        named.expand(rule.target)
    return named


def domain_id(environment: Mapping[str, str]) -> int:
    """Return ``ROS_DOMAIN_ID``, 0 to 232, of ``environment``; 0 if it is not set.

    Raises:
        TransportError: It has a value that is not allowed.
    """
    text = environment.get("ROS_DOMAIN_ID", "")
    if not text:
        return 0
    if not (text.isascii() and text.isdigit() and int(text) <= _LARGEST):
        raise TransportError(f"ROS_DOMAIN_ID is {text!r}: it should be a whole number from 0 to {_LARGEST}")
    return int(text)


def request_type(service: str) -> str:
    """Return the name of the request's type of the service type ``service``."""
    return f"{service}_Request"


def reply_type(service: str) -> str:
    """Return the name of the reply's type of the service type ``service``."""
    return f"{service}_Response"


def _register_services(store: Typestore) -> None:
    """Add requests and replies of the parameter services, and what the hashes of the services depend on.

    Since Iron, the hash of a service is that of a message with its request, its reply and its introspection event (REP
    2016).
    """
    # A char of ROS 2 is a uint8, which the type's hash depends on.
    constants, fields = store.fielddefs[_EVENT_INFO]
    char_array: Any = (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16))
    patched = [(name, char_array if name == "client_gid" else kind) for name, kind in fields]
    store.fielddefs[_EVENT_INFO] = (constants, patched)
    for name, definitions in _PARAMETER_SERVICES.items():
        service = f"rcl_interfaces/srv/{name}"
        ends = {"request": request_type(service), "response": reply_type(service)}
        for kind, definition in zip(ends.values(), definitions, strict=True):
            store.register({kind: next(iter(get_types_from_msg(definition, kind).values()))})
        exchanged: list[Any] = [(end, (Nodetype.SEQUENCE, ((Nodetype.NAME, kind), 1))) for end, kind in ends.items()]
        store.fielddefs[f"{service}_Event"] = ([], [("info", (Nodetype.NAME, _EVENT_INFO)), *exchanged])
        parts = {**ends, "event": f"{service}_Event"}
        store.fielddefs[service] = ([], [(f"{part}_message", (Nodetype.NAME, kind)) for part, kind in parts.items()])


@functools.cache
def types(distribution: str = "jazzy") -> Typestore:
    """Return the message types of a ROS 2 distribution: ``humble``, or ``jazzy`` for all newer ones.

    The types of the parameter services are in ``jazzy``, and are the same in both.
    """
    store = message_types(Stores.ROS2_HUMBLE if distribution == "humble" else Stores.ROS2_JAZZY)
    if distribution != "humble":
        _register_services(store)
    return store


def message_types(stores: Stores = Stores.ROS2_JAZZY) -> Typestore:
    """Return a new copy of the message types of rosbags, with those that it lacks."""
    store = get_typestore(stores)
    store.register({TurtlePose.__msgtype__: ([], [(part.name, _FLOAT32) for part in dataclasses.fields(TurtlePose)])})
    return store


@functools.cache
def compile_type(name: str) -> None:
    """Let rosbags compile what encodes and decodes the type ``name``, which otherwise delays its first message.

    A signal must not interrupt it: where Python runs source text, an interrupt ends the process with another exit code.
    """
    types().get_msgdef(name)
    for _, kind in types().fielddefs[name][1]:
        of: Any = kind[1][0] if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else kind
        if of[0] == Nodetype.NAME:
            compile_type(of[1])


def message_definition(name: str) -> str:
    """Return the definition of the type ``name`` and of all that it contains, as in ``.msg`` files (``ros2msg``)."""
    definition, _ = types().generate_msgdef(name, ros_version=2)
    return definition


def encode(message: Any) -> bytes:
    """Return ``message`` as little-endian CDR."""
    return bytes(types().serialize_cdr(message, message.__msgtype__))


def decode(raw: bytes | memoryview, name: str) -> Any:
    """Decode a message of the type ``name`` (``std_msgs/msg/String``); its arrays are read-only views of ``raw``.

    Raises:
        Exception: ``raw`` is not such a message; the type depends on where rosbags fails.
    """
    return types().deserialize_cdr(raw, name)


class MessageReader(Generic[M]):
    """Decodes the messages of a topic; the first of those that cannot be read is logged.

    Args:
        name: Full name of the topic.
        decode: Converts bytes to a message, and raises any exception if they are none.
    """

    def __init__(self, name: str, decode: Callable[[bytes | memoryview], M]) -> None:
        self._name = name
        self._decode = decode
        self._is_logged = False

    def read(self, raw: bytes | memoryview) -> M | None:
        """Return the message in ``raw``; None if it cannot be read, which must not end the subscription."""
        try:
            return self._decode(raw)
        except Exception as error:
            if not self._is_logged:
                log.warning("%s: a message of %d bytes cannot be read: %s", self._name, len(raw), error)
            self._is_logged = True
            return None


def type_hash(name: str) -> str:
    """Return the hash of the message, request, reply or service ``name``, as ``RIHS01_df66…`` (ROS REP 2016)."""
    return _KNOWN_HASHES.get(name) or types().hash_rihs01(name)


def dds_type_name(name: str) -> str:
    """Return ROS 2's name in DDS for a type: ``geometry_msgs::msg::dds_::Twist_`` for ``geometry_msgs/msg/Twist``."""
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def ros_type_name(dds_name: str) -> str:
    """Return the type's name in ROS 2, ``geometry_msgs/msg/Twist``, for its name in DDS."""
    return dds_name.replace("::dds_::", "::").replace("::", "/").removesuffix("_")
