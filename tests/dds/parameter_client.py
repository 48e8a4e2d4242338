"""What a client of ROS 2's parameter services sends and reads over DDS, byte by byte as rmw_cyclonedds_cpp does.

A part of ``peer.py``: types written by hand, encoded by cyclonedds. No definition of a request's type is told to
others, as rmw_cyclonedds_cpp tells none of any; cyclonedds has to tell one, which is that of any bytes. A request is
its body with 16 bytes before it, the handle of the client's writer (uint64) and a number (int64); the reply begins
with the same. Reader and writer have the same ``clientid=`` in their user data.
"""

import itertools
import time
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import byte, float64, int64, sequence, uint8, uint32, uint64
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros_types import CDR, RELIABLE, Time

MSG, SRV = "rcl_interfaces::msg::dds_::", "rcl_interfaces::srv::dds_::"


@dataclass
class Log(IdlStruct, typename=f"{MSG}Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


@dataclass
class ParameterValue(IdlStruct, typename=f"{MSG}ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[byte] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
class Parameter(IdlStruct, typename=f"{MSG}Parameter_"):
    name: str
    value: ParameterValue


@dataclass
class ParameterEvent(IdlStruct, typename=f"{MSG}ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


@dataclass
class FloatingPointRange(IdlStruct, typename=f"{MSG}FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
class IntegerRange(IdlStruct, typename=f"{MSG}IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
class ParameterDescriptor(IdlStruct, typename=f"{MSG}ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatingPointRange, 1]
    integer_range: sequence[IntegerRange, 1]


@dataclass
class ListParametersResult(IdlStruct, typename=f"{MSG}ListParametersResult_"):
    names: sequence[str]
    prefixes: sequence[str]


@dataclass
class SetParametersResult(IdlStruct, typename=f"{MSG}SetParametersResult_"):
    successful: bool
    reason: str


def _exchanged(name: str, **members: Any) -> Any:
    """Return the type of a request or a reply, which begins with the client and the number of the request."""
    return make_idl_struct(name, f"{SRV}{name}_", {"client": uint64, "number": int64, **members})


SERVICES = {
    service: (_exchanged(f"{service}_Request", **request), _exchanged(f"{service}_Response", **reply))
    for service, request, reply in (
        ("ListParameters", {"prefixes": sequence[str], "depth": uint64}, {"result": ListParametersResult}),
        ("GetParameters", {"names": sequence[str]}, {"values": sequence[ParameterValue]}),
        ("GetParameterTypes", {"names": sequence[str]}, {"types": sequence[uint8]}),
        ("DescribeParameters", {"names": sequence[str]}, {"descriptors": sequence[ParameterDescriptor]}),
        ("SetParameters", {"parameters": sequence[Parameter]}, {"results": sequence[SetParametersResult]}),
        ("SetParametersAtomically", {"parameters": sequence[Parameter]}, {"result": SetParametersResult}),
    )
}
_numbers = itertools.count(1)


class Client:
    """A client of one service."""

    def __init__(self, participant: DomainParticipant, service: str, kind: str, *, identified: bool) -> None:
        request, reply = SERVICES[kind]
        number = next(_numbers).to_bytes(4, "big")
        identity = ".".join(f"{byte:x}" for byte in participant.guid.bytes[:12] + number)
        qos = Qos(
            RELIABLE,
            Policy.Durability.Volatile,
            Policy.History.KeepLast(1000),
            CDR,
            Policy.Userdata(f"clientid={identity};".encode() if identified else b""),
        )
        self.request_type = request
        self.raw_type = raw_type(request)
        self.handle = 0x1122334455667700 + int.from_bytes(number, "big")
        self.writer: Any = DataWriter(participant, Topic(participant, f"rq{service}Request", self.raw_type), qos=qos)
        self.reader: Any = DataReader(participant, Topic(participant, f"rr{service}Reply", reply), qos=qos)

    def call(self, values: dict[str, Any], timeout_s: float) -> Any:
        """Send a request once a server is seen; return the reply's fields, or None when none comes."""
        deadline_s = time.monotonic() + timeout_s
        while not self.writer.get_publication_matched_status().current_count and time.monotonic() < deadline_s:
            time.sleep(0.005)
        number = next(_numbers)
        filled = {name: _filled(name, value) for name, value in values.items()}
        request = self.request_type(client=self.handle, number=number, **filled)
        self.writer.write(self.raw_type(request.serialize(use_version_2=False)))
        while time.monotonic() < deadline_s:
            for reply in self.reader.take(10):
                # All clients of a service hear all replies.
                if not isinstance(reply, InvalidSample) and (reply.client, reply.number) == (self.handle, number):
                    return asdict(reply)
            time.sleep(0.002)
        return None


def raw_type(kind: Any) -> Any:
    """Return a type of the same name, whose instances are made of the bytes that go over the wire."""
    struct: Any = make_idl_struct("Opaque", kind.__idl_typename__, {"raw": uint8}, dataclassify=False)
    struct.__init__ = lambda self, raw: setattr(self, "raw", raw)
    struct.serialize = lambda self, *_, **__: self.raw
    return struct


def _filled(name: str, value: Any) -> Any:
    if name != "parameters":
        return value
    known = {one.name for one in fields(ParameterValue)}
    assert all(set(given) <= known for given in value.values())
    return [Parameter(name=one, value=ParameterValue(**given)) for one, given in value.items()]
