"""The message types of ROS 2, and the encoding of messages: CDR."""

import dataclasses
import functools
import logging
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from handsteer.messages import TurtlePose

M = TypeVar("M")

log = logging.getLogger(__name__)

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
