"""``python -m handsteer.plugins.dds.look``: prints the ROS 2 graph in the environment's domain, as JSON.

Arguments, if any, are full names of nodes to wait for, which announce themselves every few seconds only.
"""

import json
import os
import sys
import time
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass

from handsteer.errors import TransportError
from handsteer.plugins.dds.discovery import Endpoint
from handsteer.plugins.dds.network import Network, network
from handsteer.plugins.dds.participant import Participant
from handsteer.plugins.dds.topics import describe, misfits
from handsteer.plugins.ros2.names import NodeName, ros_type_name
from handsteer.transports.base import UNNAMED, many_publishers

# ROS 2's own tools hide nodes whose names begin with it.
_HIDDEN = "_"
_TOPIC = "rt/"
_LOOK_S = 0.02
_VELOCITIES = {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"}
_AT_LEAST_S, _QUIET_S, _AT_MOST_S = 0.6, 0.4, 3.0
# More than two announcements of our nodes to others, see network.py.
_FOUND_WITHIN_S = 6.0
# Fast DDS announces the names of nodes up to three seconds after their publishers and subscribers, most sooner.
_NAMES_S = 2.0

Ends = list[tuple[Endpoint, str | None]]


@dataclass(frozen=True)
class ObservedTopic:
    """A topic and its publishers.

    Attributes:
        name: Full name, such as ``/r1/image_raw``.
        types: Its types, such as ``sensor_msgs/msg/Image``; more than one is a fault.
        publishers: The node of each publisher; a node with two publishers is listed twice.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]


@dataclass(frozen=True)
class ObservedGraph:
    """An observed graph.

    Attributes:
        place: Where it was observed, in words: ``domain 0, this machine``.
        nodes: Full names; two nodes of one name are listed twice.
        topics: By name.
        warnings: Problems, one sentence each.
    """

    place: str
    nodes: tuple[str, ...]
    topics: tuple[ObservedTopic, ...]
    warnings: tuple[str, ...]


def problems_of(nodes: Iterable[str], topics: Iterable[ObservedTopic]) -> list[str]:
    """Return problems: several publishers of commands, several types of a topic, several nodes of one name."""
    found = [
        f"{count} nodes have the name {name}: end one of them, or rename it (-r __node:=other)"
        for name, count in Counter(nodes).items()
        if count > 1
    ]
    for topic in topics:
        if len(topic.types) > 1:
            found.append(
                f"{topic.name} has the types {' and '.join(topic.types)}: only those of one type are connected"
            )
        if len(topic.publishers) > 1 and _VELOCITIES & set(topic.types):
            found.append(many_publishers(topic.name, topic.publishers))
    return found


def observe_domain(network: Network, awaited: Collection[str] = ()) -> ObservedGraph:
    """Return the graph in a domain.

    Args:
        network: The domain, and how to find others.
        awaited: Full names of nodes to wait for, for six seconds at most.

    Raises:
        TransportError: The domain cannot be joined.
    """
    participant = Participant(network, NodeName("handsteer_graph"), is_observer=True)
    try:
        _wait_until_quiet(participant)
        _wait_for(participant, set(awaited))
        return _graph(network.place, *participant.others())
    finally:
        participant.close()


def _wait_until_quiet(participant: Participant) -> None:
    """Wait until nothing new is found, and all nodes have announced their names."""
    began_s = changed_s = time.monotonic()
    known = -1
    while (now_s := time.monotonic()) < began_s + _AT_MOST_S:
        nodes, ends = participant.others()
        if len(nodes) + len(ends) != known:
            known, changed_s = len(nodes) + len(ends), now_s
        is_quiet = now_s - began_s >= _AT_LEAST_S and now_s - changed_s >= _QUIET_S
        if is_quiet and (now_s - began_s >= _NAMES_S or all(node for _, node in ends)):
            return
        time.sleep(_LOOK_S)


def _wait_for(participant: Participant, awaited: set[str]) -> None:
    deadline_s = time.monotonic() + _FOUND_WITHIN_S
    while not awaited <= set(participant.others()[0]) and time.monotonic() < deadline_s:
        time.sleep(_LOOK_S)


def _graph(place: str, nodes: Iterable[str], ends: Ends) -> ObservedGraph:
    shown = tuple(sorted(name for name in nodes if not _is_hidden(name)))
    seen = [(end, node or UNNAMED) for end, node in ends if end.topic.startswith(_TOPIC) and not _is_hidden(node or "")]
    topics = tuple(_topic(name, seen) for name in sorted({end.topic for end, _ in seen}))
    return ObservedGraph(place, shown, topics, (*problems_of(shown, topics), *_misfits(seen)))


def _topic(name: str, ends: list[tuple[Endpoint, str]]) -> ObservedTopic:
    here = [(end, node) for end, node in ends if end.topic == name]
    return ObservedTopic(
        name=name.removeprefix("rt"),
        types=tuple(sorted({ros_type_name(end.type) for end, _ in here})),
        publishers=tuple(sorted(node for end, node in here if end.publishes)),
    )


def _misfits(ends: list[tuple[Endpoint, str]]) -> list[str]:
    """Return a sentence for each mismatch of a publisher and a subscriber, once for identical ones."""
    lines = [
        f"{writer.topic.removeprefix('rt')}: nothing passes from {publisher} to {subscriber}: {'; '.join(reasons)} "
        f"(offered: {describe(writer.qos)}; requested: {describe(reader.qos)})"
        for writer, publisher in ends
        for reader, subscriber in ends
        if writer.publishes and not reader.publishes
        if (writer.topic, writer.type) == (reader.topic, reader.type)
        if (reasons := misfits(writer.qos, reader.qos))
    ]
    return sorted(set(lines))


def _is_hidden(node: str) -> bool:
    return node.rpartition("/")[2].startswith(_HIDDEN)


def main() -> None:
    """Print nodes, topics and problems; exit code 2 if the domain cannot be joined."""
    try:
        seen = asdict(observe_domain(network(os.environ), sys.argv[1:]))
    except TransportError as error:
        sys.stderr.write(f"{error}\n")
        sys.stderr.flush()
        os._exit(2)  # do not wait for a partially started middleware
    sys.stdout.write(json.dumps(seen))


if __name__ == "__main__":
    main()
