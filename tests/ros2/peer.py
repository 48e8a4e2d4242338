"""A plain node of a real ROS 2: rclpy, its own types, its own DDS. It runs on the Python of ``make ros2``.

It reads orders as lines of JSON from its input and answers each by one line of JSON; they are those of
``tests/dds/peer.py`` as far as it has them. Beside them, ``endpoints`` (topic) returns what ``ros2 topic info -v``
says, ``topics`` what ``ros2 topic list -t`` says, ``shift`` (from, to, type) publishes on one topic what comes on
another, ``services`` (node) returns those of a node, and ``servers`` (service) counts who offers it. ``parameters``
(node, call, arguments) calls one of the parameter services as rclpy's own client does, and returns the reply's fields,
or None when nobody answers; ``dump`` (node) returns all values as ``ros2 param dump`` writes them, and ``load`` (node,
values) sets them as ``ros2 param load`` does; ``call`` (service) calls one of std_srvs/Trigger; ``change_state`` (node,
transition) and ``state`` (node) are the calls of a lifecycle manager.
"""

import json
import sys
import tempfile
import threading
import time
from contextlib import suppress
from functools import reduce
from typing import Any

import rclpy
import yaml
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist, TwistStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log, ParameterValue
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage, Image, Joy
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

TYPES = {
    kind.__name__: kind
    for kind in (Bool, Clock, CompressedImage, Image, Joy, Log, Odometry, String, Twist, TwistStamped)
}
with suppress(ImportError):  # not built where there is no compiler
    from tf2_msgs.msg import TFMessage

    TYPES["TFMessage"] = TFMessage

rclpy.init()
node = rclpy.create_node("looker")
noted: dict[str, list[Any]] = {}
publishers: dict[str, Any] = {}
clients: dict[str, Any] = {}


def profile(order: dict[str, Any]) -> QoSProfile:
    reliable = order.get("reliable", True)
    return QoSProfile(
        depth=order.get("depth", 100),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if order.get("latched") else DurabilityPolicy.VOLATILE,
    )


def record(order: dict[str, Any]) -> bool:
    found: list[Any] = []
    noted[order["topic"]] = found

    def note(message: Any) -> None:
        found.append([time.monotonic(), [value(message, path) for path in order["fields"]]])

    node.create_subscription(TYPES[order["type"]], order["topic"], note, profile(order))
    return True


def part(of: Any, name: str) -> Any:
    return of[int(name)] if name.isdigit() else getattr(of, name)


def value(message: Any, path: str) -> Any:
    found = reduce(part, path.split("."), message)
    if isinstance(found, Time):
        return found.sec + found.nanosec / 1e9
    if isinstance(message, Joy) and not isinstance(found, (str, Time)):
        return list(found)
    return found if isinstance(found, (bool, int, float, str)) else len(found)


def get(order: dict[str, Any]) -> list[Any]:
    return list(noted[order["topic"]])


def advertise(order: dict[str, Any]) -> bool:
    publishers[order["topic"]] = node.create_publisher(TYPES[order["type"]], order["topic"], profile(order))
    return True


def listeners(order: dict[str, Any]) -> int:
    return int(publishers[order["topic"]].get_subscription_count())


def publish(order: dict[str, Any]) -> bool:
    publisher = publishers[order["topic"]]
    message = publisher.msg_type()
    for path, wanted in order["values"].items():
        *parts, last = path.split(".")
        setattr(reduce(getattr, parts, message), last, wanted)
    for _ in range(order.get("count", 1)):
        publisher.publish(message)
        time.sleep(order.get("period_s", 0.0))
    return True


def publish_raw(order: dict[str, Any]) -> bool:
    """Send bytes that are no message."""
    publishers[order["topic"]].publish(bytes.fromhex(order["hex"]))
    return True


def run_clock(order: dict[str, Any]) -> bool:
    """Publish simulated time at 50 Hz, beside other orders."""
    publisher = publishers["/clock"]

    def run() -> None:
        for step in range(int(order["seconds"] * 50)):
            now_s = order["from_s"] + step / 50
            publisher.publish(Clock(clock=Time(sec=int(now_s), nanosec=int(now_s % 1 * 1e9))))
            time.sleep(0.02)

    threading.Thread(target=run, daemon=True).start()
    return True


def shift(order: dict[str, Any]) -> bool:
    kind = TYPES[order["type"]]
    publisher = node.create_publisher(kind, order["to"], profile(order))
    node.create_subscription(kind, order["from"], publisher.publish, profile(order))
    return True


def graph(_: dict[str, Any]) -> dict[str, Any]:
    return {
        f"{namespace.rstrip('/')}/{name}": {
            "publishes": dict(node.get_publisher_names_and_types_by_node(name, namespace)),
            "subscribes": dict(node.get_subscriber_names_and_types_by_node(name, namespace)),
        }
        for name, namespace in node.get_node_names_and_namespaces()
    }


def topics(_: dict[str, Any]) -> dict[str, list[str]]:
    return dict(node.get_topic_names_and_types())


def services(order: dict[str, Any]) -> dict[str, list[str]]:
    namespace, _, name = order["node"].rpartition("/")
    return dict(node.get_service_names_and_types_by_node(name, namespace or "/"))


def servers(order: dict[str, Any]) -> int:
    return int(node.count_services(order["service"]))


def parameters(order: dict[str, Any]) -> Any:
    if order["node"] not in clients:
        clients[order["node"]] = AsyncParameterClient(node, order["node"])
    client = clients[order["node"]]
    if not client.wait_for_services(20.0):
        return None
    arguments = [Parameter(**one) if isinstance(one, dict) else one for one in order["arguments"]]
    return waited(getattr(client, order["call"])(arguments), order.get("timeout_s", 10.0))


def fields(message: Any) -> Any:
    if hasattr(message, "get_fields_and_field_types"):
        return {name: fields(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, (bool, int, float, str)):
        return message
    return [fields(one) for one in message]


def dump(order: dict[str, Any]) -> dict[str, Any]:
    names = parameters({**order, "call": "list_parameters", "arguments": []})["result"]["names"]
    found = parameters({**order, "call": "get_parameters", "arguments": sorted(names)})["values"]
    values = [ParameterValue(**value) for value in found]
    return dict(zip(sorted(names), map(parameter_value_to_python, values), strict=True))


def load(order: dict[str, Any]) -> Any:
    """As a file in YAML, whose empty lists say nothing of what they are for."""
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump({order["node"]: {"ros__parameters": order["values"]}}, file)
        file.flush()
        answer = clients[order["node"]].load_parameter_file(file.name)
        return waited(answer, 10.0)


def call(order: dict[str, Any]) -> Any:
    client = node.create_client(Trigger, order["service"])
    return waited(client.call_async(Trigger.Request()), 10.0) if client.wait_for_service(20.0) else None


def change_state(order: dict[str, Any]) -> Any:
    """Ask for a transition by its number, as Nav2's lifecycle manager does; return whether it succeeded."""
    client = node.create_client(ChangeState, f"{order['node']}/change_state")
    wanted = ChangeState.Request(transition=Transition(id=getattr(Transition, order["transition"])))
    answer = waited(client.call_async(wanted), 10.0) if client.wait_for_service(20.0) else None
    return answer and answer["success"]


def state(order: dict[str, Any]) -> Any:
    """Return the state's label, as ``ros2 lifecycle get`` does."""
    client = node.create_client(GetState, f"{order['node']}/get_state")
    answer = waited(client.call_async(GetState.Request()), 10.0) if client.wait_for_service(20.0) else None
    return answer and answer["current_state"]["label"]


def waited(answer: Any, timeout_s: float) -> Any:
    deadline_s = time.monotonic() + timeout_s
    while not answer.done() and time.monotonic() < deadline_s:
        time.sleep(0.001)
    return fields(answer.result()) if answer.done() else None


def endpoints(order: dict[str, Any]) -> list[dict[str, Any]]:
    both = [
        ("publisher", node.get_publishers_info_by_topic(order["topic"])),
        ("subscription", node.get_subscriptions_info_by_topic(order["topic"])),
    ]
    return [
        {
            "kind": kind,
            "node": f"{info.node_namespace.rstrip('/')}/{info.node_name}",
            "type": info.topic_type,
            "hash": str(info.topic_type_hash),
            "reliability": info.qos_profile.reliability.name,
            "durability": info.qos_profile.durability.name,
        }
        for kind, infos in both
        for info in infos
    ]


def spin() -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with suppress(ExternalShutdownException):
        executor.spin()


thread = threading.Thread(target=spin, daemon=True)
thread.start()
print("ready", flush=True)
for line in sys.stdin:
    wanted = json.loads(line)
    try:
        answer: Any = globals()[wanted["order"]](wanted)  # the function of that name
    except Exception as error:  # a node that leaves meanwhile
        answer = {"error": str(error)}
    print(json.dumps(answer), flush=True)
rclpy.shutdown()
thread.join()
node.destroy_node()
