"""A plain rospy node that knows nothing of handsteer: what others' nodes see of ours.

It reads orders as lines of JSON from its input and answers each by one line of JSON:
``record`` (topic, package, type, fields) starts to note messages, ``get`` (topic) returns what was noted as
``[time_s, [values]]``, ``advertise`` (topic, package, type), ``listeners`` (topic) returns how many listen, and
``publish`` (topic, values, count, period_s) sends messages.
"""

import importlib
import json
import sys
import time
from functools import reduce
from typing import Any

import rospy

noted: dict[str, list[Any]] = {}
publishers: dict[str, Any] = {}
subscribers: list[Any] = []


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
        setattr(part, last, rospy.Time.from_sec(value) if isinstance(kind, rospy.Time) else value)
    for _ in range(order.get("count", 1)):
        publisher.publish(message)
        time.sleep(order.get("period_s", 0.0))
    return True


ORDERS = {order.__name__: order for order in (record, get, advertise, listeners, publish)}

rospy.init_node("peer", anonymous=True)
print("ready", flush=True)
for line in sys.stdin:
    order = json.loads(line)
    print(json.dumps(ORDERS[order["order"]](order)), flush=True)
