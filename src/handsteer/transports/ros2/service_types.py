"""The types of ROS 2's parameter services, which rosbags does not have: requests, replies and hashes.

Source of the definitions: package rcl_interfaces, ``srv/*.srv``. Since Iron, the hash of a service is that of a message
with its request, its reply and its introspection event (REP 2016).
"""

from dataclasses import dataclass

from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"


@dataclass(frozen=True)
class Service:
    """The type of a service.

    Attributes:
        name: Such as ``rcl_interfaces/srv/ListParameters``.
        request_definition: Fields of the request, as in a ``.msg`` file.
        reply_definition: Fields of the reply.
    """

    name: str
    request_definition: str
    reply_definition: str

    @property
    def request(self) -> str:
        """Name of the request's type."""
        return f"{self.name}_Request"

    @property
    def reply(self) -> str:
        """Name of the reply's type."""
        return f"{self.name}_Response"


def _service(name: str, request: str, reply: str) -> Service:
    return Service(f"rcl_interfaces/srv/{name}", request, reply)


LIST_PARAMETERS = _service(
    "ListParameters", "string[] prefixes\nuint64 depth", "rcl_interfaces/ListParametersResult result"
)
GET_PARAMETERS = _service("GetParameters", "string[] names", "rcl_interfaces/ParameterValue[] values")
GET_PARAMETER_TYPES = _service("GetParameterTypes", "string[] names", "uint8[] types")
DESCRIBE_PARAMETERS = _service(
    "DescribeParameters", "string[] names", "rcl_interfaces/ParameterDescriptor[] descriptors"
)
SET_PARAMETERS = _service(
    "SetParameters", "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult[] results"
)
SET_PARAMETERS_ATOMICALLY = _service(
    "SetParametersAtomically", "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult result"
)
SERVICES = (
    LIST_PARAMETERS,
    GET_PARAMETERS,
    GET_PARAMETER_TYPES,
    DESCRIBE_PARAMETERS,
    SET_PARAMETERS,
    SET_PARAMETERS_ATOMICALLY,
)
"""All parameter services."""


def register_services(store: Typestore) -> None:
    """Add the services' requests and replies, and the types their hashes depend on, to ``store``."""
    # A char of ROS 2 is a uint8, which the type's hash depends on.
    constants, fields = store.fielddefs[_EVENT_INFO]
    patched = [
        (name, (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)) if name == "client_gid" else kind)
        for name, kind in fields
    ]
    store.fielddefs[_EVENT_INFO] = (constants, patched)
    for service in SERVICES:
        for name, definition in (
            (service.request, service.request_definition),
            (service.reply, service.reply_definition),
        ):
            store.register({name: next(iter(get_types_from_msg(definition, name).values()))})
        event = f"{service.name}_Event"
        ends = (("request", service.request), ("response", service.reply))
        store.fielddefs[event] = (
            [],
            [
                ("info", (Nodetype.NAME, _EVENT_INFO)),
                *((field, (Nodetype.SEQUENCE, ((Nodetype.NAME, kind), 1))) for field, kind in ends),
            ],
        )
        store.fielddefs[service.name] = (
            [],
            [(f"{field}_message", (Nodetype.NAME, kind)) for field, kind in (*ends, ("event", event))],
        )
