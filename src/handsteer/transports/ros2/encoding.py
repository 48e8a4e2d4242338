"""The encoding of ROS 2 messages: CDR with its header of four bytes, and the names and hashes of types."""

import dataclasses
import functools
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from handsteer.messages import TurtlePose

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


def encode(message: Any) -> bytes:
    """Return ``message`` as little-endian CDR."""
    return bytes(types().serialize_cdr(message, message.__msgtype__))


def decode(raw: bytes, name: str) -> Any:
    """Decode a message of the type ``name`` (``std_msgs/msg/String``); its arrays are read-only views of ``raw``.

    Raises:
        Exception: ``raw`` is not such a message; the type depends on where rosbags fails.
    """
    return types().deserialize_cdr(raw, name)


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
