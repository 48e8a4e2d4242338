"""A plain DDS program that knows nothing of handsteer: what others' nodes see of ours.

cyclonedds itself encodes the types of ``ros_types.py``. It reads orders as lines of
JSON from its input and answers each by one line of JSON. ``record`` (topic, type, fields, reliable) starts to note
messages, ``get`` (topic, since_s) returns what was noted as ``[time_s, [values]]``. ``advertise`` (topic, type,
reliable) comes before ``listeners`` (topic), which returns how many listen, ``publish`` (topic, values, count,
period_s) and ``publish_raw`` (topic, hex); ``repeat`` (topic, values or null, every_s) publishes in the background
until the next one. ``set_clock`` (rate, jump_s) tells simulated time. ``introduce`` (name) makes it a node for ROS 2,
and ``graph`` and ``user_data`` (topic) return what a ROS 2 node would know of others. ``call`` (service, type, fields)
asks as a client of rmw_cyclonedds_cpp does, and
returns the reply's fields; ``parameter_client.py`` has its types.

Arguments: the number of the domain; a configuration of Cyclone DDS where it shall not keep to this machine; the name of
its machine, if it shall have another.
"""

import json
import sys
import threading
import time
from functools import reduce
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from parameter_client import Client, Log, ParameterEvent
from ros_types import (
    CDR,
    LOOPBACK,
    RELIABLE,
    Bool,
    Clock,
    CompressedImage,
    DiagnosticArray,
    Gid,
    Image,
    Joy,
    NodeEntitiesInfo,
    Odometry,
    ParticipantEntitiesInfo,
    String,
    Time,
    Twist,
)

TYPES = {
    kind.__name__: kind
    for kind in (
        Bool,
        String,
        Image,
        Joy,
        CompressedImage,
        Twist,
        Odometry,
        DiagnosticArray,
        Clock,
        Log,
        ParameterEvent,
    )
}

number, config, hostname = (*sys.argv[1:], "", "")[:3]
domain = Domain(int(number), config or LOOPBACK)
# Cyclone DDS tells others the name of its machine, unless it has been given another.
participant = DomainParticipant(
    int(number), Qos(*([Policy.Property("__Hostname", hostname, True)] if hostname else []))
)
noted: dict[str, list[Any]] = {}
readers: dict[str, tuple[Any, list[str]]] = {}
writers: dict[str, Any] = {}
repeated: dict[str, dict[str, Any] | None] = {}
repeating: set[str] = set()
simulated = {"from_s": 10_000.0, "began_s": 0.0, "rate": 0.0, "told": 0.0}
participants = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
endpoints = {
    "writers": BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
    "readers": BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
}
discovery_qos = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1), CDR)
discovery_topic = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo)
discovery = DataReader(
    participant, discovery_topic, qos=Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepAll, CDR)
)
introductions: list[Any] = []
infos: dict[bytes, Any] = {}


def qos(order: dict[str, Any]) -> Qos:
    reliability = RELIABLE if order.get("reliable", True) else Policy.Reliability.BestEffort
    durability = Policy.Durability.TransientLocal if order.get("latched") else Policy.Durability.Volatile
    return Qos(reliability, durability, Policy.History.KeepLast(order.get("depth", 100)), CDR)


def topic(order: dict[str, Any]) -> Any:
    return Topic(participant, f"rt{order['topic']}", TYPES[order["type"]])


def record(order: dict[str, Any]) -> bool:
    noted[order["topic"]] = []
    readers[order["topic"]] = (DataReader(participant, topic(order), qos=qos(order)), order["fields"])
    return True


def collect() -> None:
    while True:
        for name, (reader, fields) in list(readers.items()):
            for message in reader.take(100):
                if not isinstance(message, InvalidSample):
                    noted[name].append([time.monotonic(), [value(message, path) for path in fields]])
        time.sleep(0.002)


def value(message: Any, path: str) -> Any:
    found = reduce(part_of, path.split("."), message)
    if isinstance(found, Time):
        return found.sec + found.nanosec / 1e9
    return len(found) if isinstance(found, (bytes, list)) else found


def part_of(whole: Any, name: str) -> Any:
    return whole[int(name)] if name.isdigit() else getattr(whole, name)


def get(order: dict[str, Any]) -> list[Any]:
    since_s = order.get("since_s", 0.0)
    return [one for one in noted[order["topic"]] if one[0] > since_s]


def advertise(order: dict[str, Any]) -> bool:
    writers[order["topic"]] = DataWriter(participant, topic(order), qos=qos(order))
    return True


def listeners(order: dict[str, Any]) -> int:
    return int(writers[order["topic"]].get_publication_matched_status().current_count)


def publish(order: dict[str, Any]) -> bool:
    writer = writers[order["topic"]]
    message = writer.data_type()
    for path, wanted in order["values"].items():
        *parts, last = path.split(".")
        setattr(reduce(getattr, parts, message), last, wanted)
    for _ in range(order.get("count", 1)):
        writer.write(message)
        time.sleep(order.get("period_s", 0.0))
    return True


def repeat(order: dict[str, Any]) -> bool:
    """Publish again and again, in place of what was repeated on the topic before; nothing where there are no values."""
    name = order["topic"]
    repeated[name] = order if order["values"] is not None else None
    if name not in repeating:
        repeating.add(name)
        threading.Thread(target=keep_on, args=(name,), daemon=True).start()
    return True


def keep_on(name: str) -> None:
    while True:
        order = repeated[name]
        if order is not None:
            publish(order)
        time.sleep(order["every_s"] if order else 0.01)


def publish_raw(order: dict[str, Any]) -> bool:
    """Send bytes that are no message."""
    writer = writers[order["topic"]]
    message = writer.data_type()
    message.serialize = lambda **_: bytes.fromhex(order["hex"])
    writer.write(message)
    return True


def run_clock(order: dict[str, Any]) -> bool:
    """Tell the time on /clock, in real time, from ``from_s`` on, for ``seconds``."""
    writer = writers["/clock"]

    def run() -> None:
        began_s = time.monotonic()
        while (passed_s := time.monotonic() - began_s) < order["seconds"]:
            now_s = order["from_s"] + passed_s
            writer.write(Clock(Time(int(now_s), int(now_s % 1 * 1e9))))
            time.sleep(0.01)

    threading.Thread(target=run, daemon=True).start()
    return True


def set_clock(order: dict[str, Any]) -> bool:
    """Tell the time on /clock from now on, ``rate`` times as fast as real time; first jump by ``jump_s``."""
    now_s = simulated_s()
    simulated.update(from_s=now_s + order.get("jump_s", 0.0), began_s=time.monotonic(), rate=order.get("rate", 1.0))
    if not simulated["told"]:
        simulated["told"] = 1.0
        threading.Thread(target=tell_time, daemon=True).start()
    return True


def simulated_s() -> float:
    return simulated["from_s"] + (time.monotonic() - simulated["began_s"]) * simulated["rate"]


def tell_time() -> None:
    while True:
        now_s = simulated_s()
        writers["/clock"].write(Clock(Time(int(now_s), int(now_s % 1 * 1e9))))
        time.sleep(0.01)


def introduce(order: dict[str, Any], client: Client | None = None) -> bool:
    """Tell ROS 2 that all publishers and subscribers of this program belong to a node."""
    own_readers = [client.reader] if client else [reader for reader, _ in readers.values()]
    own_writers = [client.writer] if client else list(writers.values())
    node = NodeEntitiesInfo(
        node_namespace="/",
        node_name=order["name"],
        reader_gid_seq=[gid(reader) for reader in own_readers],
        writer_gid_seq=[gid(writer) for writer in own_writers],
    )
    introductions.append(DataWriter(participant, discovery_topic, qos=discovery_qos))
    introductions[-1].write(ParticipantEntitiesInfo(gid=gid(participant), node_entities_info_seq=[node]))
    return True


def gid(entity: Any) -> Gid:
    return Gid(data=list(entity.guid.bytes))


def graph(_order: dict[str, Any]) -> dict[str, Any]:
    """Return nodes by full name with the topics, types and user data of what they publish and subscribe to."""
    seen = {
        kind: {end.key.bytes: end for end in reader.read(1000) if end.sample_info.valid_data}
        for kind, reader in endpoints.items()
    }
    alive = {end.key.bytes: text(end.qos) for end in participants.read(100) if end.sample_info.valid_data}
    for info in discovery.take(100):
        if not isinstance(info, InvalidSample):
            infos[bytes(info.gid.data)] = info
    nodes: dict[str, Any] = {}
    for info in infos.values():
        for node in info.node_entities_info_seq:
            gids = {"writers": node.writer_gid_seq, "readers": node.reader_gid_seq}
            nodes[f"{node.node_namespace.rstrip('/')}/{node.node_name}"] = {
                "participant": alive.get(bytes(info.gid.data)),
                **{
                    kind: {
                        end.topic_name: [end.type_name, text(end.qos)]
                        for one in gids[kind]
                        if (end := seen[kind].get(bytes(one.data)))
                    }
                    for kind in gids
                },
            }
    return nodes


def user_data(order: dict[str, Any]) -> dict[str, list[str]]:
    """Return the user data of all publishers and subscribers of a topic that are not this program's."""
    return {
        kind: [
            text(end.qos)
            for end in reader.read(1000)
            if end.sample_info.valid_data
            and end.topic_name == order["topic"]
            and end.participant_key != participant.guid
        ]
        for kind, reader in endpoints.items()
    }


def call(order: dict[str, Any]) -> Any:
    """Ask a service, as a new client each time: a request may come before the other side knows its reader."""
    client = Client(participant, order["service"], order["type"], identified=order.get("identified", True))
    introduce({"name": "caller"}, client)
    return client.call(order["fields"], order.get("timeout_s", 20.0))


def text(of: Qos) -> str:
    return of[Policy.Userdata].data.decode() if Policy.Userdata in of else ""


threading.Thread(target=collect, daemon=True).start()
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    answer = globals()[order["order"]](order)  # the function of that name
    print(json.dumps(answer), flush=True)
