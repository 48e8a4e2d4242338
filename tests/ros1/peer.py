"""A plain rospy node that knows nothing of handsteer: what others' nodes see of ours.

It reads orders as lines of JSON from its input and answers each by one line of JSON. ``record`` (topic, package, type,
fields) starts to note messages, ``record_stamps`` (topic) those of large ones, ``record_diagnostics`` the values of
nodes; ``get`` (topic) returns what was noted as ``[time_s, [values]]``. ``advertise`` (topic, package, type) comes
before ``listeners`` (topic), which returns how many listen, ``publish`` (topic, values, count, period_s),
``publish_raw`` (topic, raw: hexadecimal bytes), ``stream`` of images, and ``run_clock`` of simulated time, which
``stop_clock`` ends.
"""

import importlib
import json
import struct
import sys
import threading
import time
from functools import reduce
from typing import Any

import rospy

noted: dict[str, list[Any]] = {}
publishers: dict[str, Any] = {}
subscribers: list[Any] = []
clock_stands = threading.Event()


def message_type(order: dict[str, Any]) -> Any:
    return getattr(importlib.import_module(f"{order['package']}.msg"), order["type"])


def record(order: dict[str, Any]) -> bool:
    mine: list[Any] = []
    noted[order["topic"]] = mine

    def note(message: Any) -> None:
        values = [reduce(getattr, field.split("."), message) for field in order["fields"]]
        mine.append([time.monotonic(), [v.to_sec() if hasattr(v, "to_sec") else v for v in values]])

    subscribers.append(rospy.Subscriber(order["topic"], message_type(order), note, tcp_nodelay=True))
    return True


def record_stamps(order: dict[str, Any]) -> bool:
    """Note the stamps of the headers alone, without unpacking what may be a large message."""
    mine: list[Any] = []
    noted[order["topic"]] = mine

    def note(message: Any) -> None:
        _, seconds, nanoseconds = struct.unpack_from("<III", message._buff)
        mine.append([time.monotonic(), [seconds + nanoseconds / 1e9]])

    subscribers.append(rospy.Subscriber(order["topic"], rospy.AnyMsg, note, buff_size=2**24, tcp_nodelay=True))
    return True


def record_diagnostics(_order: dict[str, Any]) -> bool:
    mine: list[Any] = []
    noted["/diagnostics"] = mine

    def note(message: Any) -> None:
        statuses = [[status.name, {pair.key: pair.value for pair in status.values}] for status in message.status]
        mine.append([time.monotonic(), [statuses]])

    subscribers.append(
        rospy.Subscriber("/diagnostics", importlib.import_module("diagnostic_msgs.msg").DiagnosticArray, note)
    )
    return True


def get(order: dict[str, Any]) -> list[Any]:
    return list(noted[order["topic"]])


def advertise(order: dict[str, Any]) -> bool:
    publishers[order["topic"]] = rospy.Publisher(order["topic"], message_type(order), queue_size=100, tcp_nodelay=True)
    return True


def listeners(order: dict[str, Any]) -> int:
    return int(publishers[order["topic"]].get_num_connections())


def publish(order: dict[str, Any]) -> bool:
    publisher = publishers[order["topic"]]
    message = publisher.data_class()
    for field, value in order["values"].items():
        *path, last = field.split(".")
        part = reduce(getattr, path, message)
        kind = getattr(part, last)
        setattr(part, last, rospy.Time.from_sec(value) if hasattr(kind, "to_sec") else value)
    for _ in range(order.get("count", 1)):
        publisher.publish(message)
        time.sleep(order.get("period_s", 0.0))
    return True


def publish_raw(order: dict[str, Any]) -> bool:
    """Send bytes that need not be a message of the topic's type."""
    publisher = publishers[order["topic"]]
    raw = bytes.fromhex(order["raw"])
    kind = type("Raw", (publisher.data_class,), {"serialize": lambda self, buffer: buffer.write(raw)})
    publisher.publish(kind())
    return True


def stream(order: dict[str, Any]) -> bool:
    """Send images at a steady rate on a thread, stamped when they are sent, as a camera does."""
    publisher, width, height = publishers[order["topic"]], order["width"], order["height"]
    message = publisher.data_class(height=height, width=width, encoding="bgr8", step=3 * width)
    message.data = bytes(3 * width * height)

    def run() -> None:
        due_s = time.monotonic()
        for _ in range(order["count"]):
            message.header.stamp = rospy.Time.from_sec(time.time())
            publisher.publish(message)
            due_s += order["period_s"]
            time.sleep(max(0.0, due_s - time.monotonic()))

    threading.Thread(target=run, daemon=True).start()
    return True


def run_clock(order: dict[str, Any]) -> bool:
    """Tell the time on /clock, from ``from_s`` on, ``rate`` times as fast as real time, until ``stop_clock``."""
    publisher = publishers["/clock"]
    clock_stands.clear()

    def run() -> None:
        began_s = time.monotonic()
        while not clock_stands.is_set():
            publisher.publish(rospy.Time.from_sec(order["from_s"] + (time.monotonic() - began_s) * order["rate"]))
            time.sleep(0.01)

    threading.Thread(target=run, daemon=True).start()
    return True


def stop_clock(_order: dict[str, Any]) -> bool:
    clock_stands.set()
    return True


rospy.init_node("peer", anonymous=True)
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    answer = globals()[order["order"]](order)  # the function of that name
    print(json.dumps(answer), flush=True)
