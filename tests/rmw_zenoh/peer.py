"""A plain Zenoh program that knows nothing of handsteer: what nodes under rmw_zenoh see of ours.

Key expressions, liveliness tokens, attachments and CDR are written by hand here, from ROS 2's own documents. It takes
the endpoint of a router and a domain, reads orders as lines of JSON from its input and answers each by one line of
JSON. ``record`` (topic, type, fields, latched) starts to note messages, ``get`` (topic) returns what was noted as
``[time_s, [values]]``, ``attachments`` (topic) what came with them. ``advertise`` (topic, type, latched) comes before
``listeners`` (topic), ``publish`` (topic, values, count, period_s, age_s) and ``publish_raw`` (topic, hex). ``call``
(node, service, hex) asks a service. ``introduce`` (name, topic, type, kind) tells a liveliness token, ``graph`` returns
what tokens tell of others.
"""

import json
import os
import struct
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

# As `ros2 topic info -v` prints them.
HASHES = {
    "std_msgs::msg::dds_::Bool_": "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs::msg::dds_::String_": "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "geometry_msgs::msg::dds_::Twist_": "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "geometry_msgs::msg::dds_::TwistStamped_": "RIHS01_"
    "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    "sensor_msgs::msg::dds_::Image_": "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "sensor_msgs::msg::dds_::Joy_": "RIHS01_0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5",
    "nav_msgs::msg::dds_::Odometry_": "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "rosgraph_msgs::msg::dds_::Clock_": "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
}
SERVICES = {
    "get_parameters": (
        "rcl_interfaces::srv::dds_::GetParameters_",
        "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    ),
    "set_parameters": (
        "rcl_interfaces::srv::dds_::SetParameters_",
        "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
    ),
}
TYPES = {name.split("::")[-1].rstrip("_"): name for name in HASHES}
HEADER = b"\x00\x01\x00\x00"
GID = bytes(range(16))


class Reader:
    """Reads little-endian CDR, in which each number stands at a multiple of its own size."""

    def __init__(self, raw: bytes) -> None:
        assert raw[:4] == HEADER, raw[:4].hex()
        self.raw, self.at = raw[4:], 0

    def number(self, kind: str) -> Any:
        size = struct.calcsize(kind)
        self.at += -self.at % size
        (value,) = struct.unpack_from(f"<{kind}", self.raw, self.at)
        self.at += size
        return value

    def numbers(self, count: int) -> list[float]:
        return [self.number("d") for _ in range(count)]

    def text(self) -> str:
        length = self.number("I")
        self.at += length
        return self.raw[self.at - length : self.at - 1].decode()

    def stamp(self) -> float:
        return float(self.number("i") + self.number("I") / 1e9)


def read_string(reader: Reader) -> dict[str, Any]:
    return {"data": reader.text()}


def read_twist(reader: Reader) -> dict[str, Any]:
    values = reader.numbers(6)
    return {"linear.x": values[0], "angular.z": values[5]}


def read_twist_stamped(reader: Reader) -> dict[str, Any]:
    stamp, frame = reader.stamp(), reader.text()
    values = reader.numbers(6)
    return {"header.stamp": stamp, "header.frame_id": frame, "twist.linear.x": values[0], "twist.angular.z": values[5]}


def read_odometry(reader: Reader) -> dict[str, Any]:
    reader.stamp(), reader.text(), reader.text()
    pose, _, twist = reader.numbers(7), reader.numbers(36), reader.numbers(6)
    return {
        "pose.pose.position.x": pose[0],
        "pose.pose.orientation.z": pose[5],
        "twist.twist.linear.x": twist[0],
        "twist.twist.angular.z": twist[5],
    }


def read_image(reader: Reader) -> dict[str, Any]:
    stamp, _ = reader.stamp(), reader.text()
    height, width = reader.number("I"), reader.number("I")
    return {"header.stamp": stamp, "height": height, "width": width}


READERS: dict[str, Callable[[Reader], dict[str, Any]]] = {
    "String": read_string,
    "Twist": read_twist,
    "TwistStamped": read_twist_stamped,
    "Odometry": read_odometry,
    "Image": read_image,
}


def cdr(kind: str, values: dict[str, Any]) -> bytes:
    if kind == "String":
        text: bytes = values["data"].encode() + b"\0"
        return HEADER + struct.pack("<I", len(text)) + text
    if kind == "Bool":
        return HEADER + struct.pack("<?", values["data"])
    if kind == "Clock":
        return HEADER + struct.pack("<iI", values["clock.sec"], values.get("clock.nanosec", 0))
    if kind == "Joy":
        axes, buttons = values["axes"], values["buttons"]
        header = struct.pack("<iII", 0, 0, 1) + bytes(4)  # no frame: one zero byte, and three up to the next number
        return (
            HEADER
            + header
            + struct.pack(f"<I{len(axes)}f", len(axes), *axes)
            + struct.pack(f"<I{len(buttons)}i", len(buttons), *buttons)
        )
    assert kind == "Twist"
    return HEADER + struct.pack("<6d", values.get("linear.x", 0.0), 0, 0, 0, 0, values.get("angular.z", 0.0))


ROUTER, DOMAIN = sys.argv[1:]
config = zenoh.Config()
for name, value in {
    "mode": "peer",
    "connect/endpoints": [ROUTER],
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2},
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "scouting/multicast/enabled": False,
    "timestamping/enabled": True,
    "transport/shared_memory/enabled": False,
}.items():
    config.insert_json5(name, json.dumps(value))
for pair in filter(None, os.environ.get("PEER_CONFIG", "").split(";")):
    config.insert_json5(*pair.split("="))
session = zenoh.open(config)
noted: dict[str, list[Any]] = {}
attached: dict[str, list[Any]] = {}
kept: list[Any] = []
publishers: dict[str, Any] = {}
matching: dict[str, Any] = {}
kinds: dict[str, str] = {}
numbers: dict[str, int] = {}
tokens: dict[str, bool] = {}


def key(order: dict[str, Any]) -> str:
    kind = TYPES[order["type"]]
    return f"{DOMAIN}{order['topic']}/{kind}/{HASHES[kind]}"


def watch(sample: zenoh.Sample) -> None:
    if sample.kind == zenoh.SampleKind.PUT:
        tokens[str(sample.key_expr)] = True
    else:
        tokens.pop(str(sample.key_expr), None)


def record(order: dict[str, Any]) -> bool:
    topic, read, fields = order["topic"], READERS[order["type"]], order["fields"]
    noted[topic], attached[topic] = [], []

    def note(sample: zenoh.Sample) -> None:
        values = read(Reader(sample.payload.to_bytes()))
        noted[topic].append([time.monotonic(), [values[field] for field in fields]])
        assert sample.attachment is not None, topic
        attached[topic].append(sample.attachment.to_bytes().hex())

    if order.get("latched"):
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
        kept.append(zenoh.ext.declare_advanced_subscriber(session, key(order), note, history=history))
    else:
        kept.append(session.declare_subscriber(key(order), note))
    return True


def get(order: dict[str, Any]) -> list[Any]:
    return list(noted[order["topic"]])


def attachments(order: dict[str, Any]) -> list[Any]:
    return list(attached[order["topic"]])


def advertise(order: dict[str, Any]) -> bool:
    topic = order["topic"]
    matching[topic] = publishers[topic] = session.declare_publisher(key(order))
    if order.get("latched"):
        publishers[topic] = zenoh.ext.declare_advanced_publisher(
            session, key(order), cache=zenoh.ext.CacheConfig(1), publisher_detection=True
        )
    kinds[topic], numbers[topic] = order["type"], 0
    return True


def listeners(order: dict[str, Any]) -> int:
    return int(matching[order["topic"]].matching_status.matching)


def send(topic: str, raw: bytes, age_s: float = 0.0) -> None:
    numbers[topic] += 1
    attachment = struct.pack("<qqB", numbers[topic], time.time_ns() - round(age_s * 1e9), len(GID)) + GID
    publishers[topic].put(raw, attachment=attachment)


def publish(order: dict[str, Any]) -> bool:
    raw = cdr(kinds[order["topic"]], order["values"])
    for _ in range(order.get("count", 1)):
        send(order["topic"], raw, order.get("age_s", 0.0))
        time.sleep(order.get("period_s", 0.0))
    return True


def publish_raw(order: dict[str, Any]) -> bool:
    """Send bytes that are no message."""
    send(order["topic"], bytes.fromhex(order["hex"]))
    return True


def call(order: dict[str, Any]) -> list[Any]:
    """Ask a service of a node; return payload and attachment of each reply."""
    node, service = order["node"], order["service"]
    found = session.get(
        f"{DOMAIN}{node}/{service}/{'/'.join(SERVICES[service])}",
        payload=bytes.fromhex(order["hex"]),
        attachment=struct.pack("<qqB", order.get("number", 1), time.time_ns(), len(GID)) + GID,
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=10.0,
    )
    replies = []
    for reply in found:
        assert reply.ok is not None, service
        assert reply.ok.attachment is not None, service
        replies.append([reply.ok.payload.to_bytes().hex(), reply.ok.attachment.to_bytes().hex()])
    return replies


def run_clock(order: dict[str, Any]) -> bool:
    """Tell the time on /clock, in real time, from ``from_s`` on, for ``seconds``."""

    def run() -> None:
        began_s = time.monotonic()
        while (passed_s := time.monotonic() - began_s) < order["seconds"]:
            now_s = order["from_s"] + passed_s
            send("/clock", cdr("Clock", {"clock.sec": int(now_s), "clock.nanosec": int(now_s % 1 * 1e9)}))
            time.sleep(0.01)

    threading.Thread(target=run, daemon=True).start()
    return True


def introduce(order: dict[str, Any]) -> bool:
    """Tell by a liveliness token that a node has a publisher (MP) or subscriber (MS)."""
    kind, topic = TYPES[order["type"]], order["topic"].replace("/", "%")
    what = f"{order['kind']}/%/%/{order['name']}/{topic}/{kind}/{HASHES[kind]}/::,10:,:,:,,"
    kept.append(session.liveliness().declare_token(f"@ros2_lv/{DOMAIN}/{session.zid()}/0/7/{what}"))
    return True


def graph(_order: dict[str, Any]) -> dict[str, Any]:
    """Return nodes by full name: publishers and subscribers by topic, each with type, hash and quality of service."""
    nodes: dict[str, Any] = {}
    for token in sorted(tokens):
        _, domain, zid, *rest = token.split("/")
        _, _, kind, enclave, namespace, name, *what = rest
        assert (domain, enclave, zid != str(session.zid())) == (DOMAIN, "%", True) or zid == str(session.zid()), token
        node = f"{namespace.replace('%', '/').rstrip('/')}/{name}"
        known = nodes.setdefault(node, {"alive": False, "MP": {}, "MS": {}, "SS": {}})
        if kind == "NN":
            known["alive"] = True
        else:
            topic, *details = what
            known[kind][topic.replace("%", "/")] = [*details, token]
    return nodes


kept.append(session.liveliness().declare_subscriber(f"@ros2_lv/{DOMAIN}/**", watch, history=True))
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    answer = globals()[order["order"]](order)  # the function of that name
    print(json.dumps(answer), flush=True)
session.close()
