"""``python -m handsteer.transports.look``: prints the ROS 2 graph in the environment's domain, as JSON."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterable

from handsteer.errors import TransportError
from handsteer.transports.dds.matching import Endpoint
from handsteer.transports.dds.network import Network, network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.qos import describe, misfits
from handsteer.transports.observed import UNNAMED, ObservedGraph, ObservedTopic, amiss
from handsteer.transports.ros2.encoding import ros_type_name
from handsteer.transports.ros2.names import NodeName

# ROS 2's own tools hide nodes whose names begin with it.
_HIDDEN = "_"
_TOPIC = "rt/"
_LOOK_S = 0.02
_AT_LEAST_S, _QUIET_S, _AT_MOST_S = 0.6, 0.4, 3.0
# Fast DDS announces the names of nodes up to three seconds after their publishers and subscribers, most sooner.
_NAMES_S = 2.0

Ends = list[tuple[Endpoint, str | None]]


def observe_domain(network: Network) -> ObservedGraph:
    """Return the graph in a domain.

    Raises:
        TransportError: The domain cannot be joined.
    """
    participant = Participant(network, NodeName("handsteer_graph"), looks_on=True)
    try:
        began_s = time.monotonic()
        _wait_until_quiet(participant)
        _wait(lambda: all(node for _, node in participant.others()[1]), began_s + _NAMES_S)
        return _graph(network.place, *participant.others())
    finally:
        participant.close()


def _wait(condition: Callable[[], bool], deadline_s: float) -> None:
    while not condition() and time.monotonic() < deadline_s:
        time.sleep(_LOOK_S)


def _wait_until_quiet(participant: Participant) -> None:
    """Wait until no further node is found."""
    began_s = changed_s = time.monotonic()
    known = -1

    def quiet() -> bool:
        nonlocal known, changed_s
        nodes, ends = participant.others()
        now = time.monotonic()
        if len(nodes) + len(ends) != known:
            known, changed_s = len(nodes) + len(ends), now
        return now - began_s >= _AT_LEAST_S and now - changed_s >= _QUIET_S

    _wait(quiet, began_s + _AT_MOST_S)


def _graph(place: str, nodes: Iterable[str], ends: Ends) -> ObservedGraph:
    shown = tuple(sorted(name for name in nodes if not _is_hidden(name)))
    seen = [(end, node or UNNAMED) for end, node in ends if end.topic.startswith(_TOPIC) and not _is_hidden(node or "")]
    topics = tuple(_topic(name, seen) for name in sorted({end.topic for end, _ in seen}))
    return ObservedGraph(place, shown, topics, (*amiss(shown, topics), *_misfits(seen)))


def _topic(name: str, ends: list[tuple[Endpoint, str]]) -> ObservedTopic:
    here = [(end, node) for end, node in ends if end.topic == name]
    return ObservedTopic(
        name=_ros_topic(name),
        types=tuple(sorted({ros_type_name(end.type) for end, _ in here})),
        publishers=tuple(sorted(node for end, node in here if end.publishes)),
    )


def _misfits(ends: list[tuple[Endpoint, str]]) -> list[str]:
    """Return a sentence for each mismatch of a publisher and a subscriber, once for identical ones."""
    lines = [
        f"{_ros_topic(writer.topic)}: nothing passes from {publisher} to {subscriber}: {'; '.join(reasons)} "
        f"(offered: {describe(writer.qos)}; requested: {describe(reader.qos)})"
        for writer, publisher in ends
        for reader, subscriber in ends
        if writer.publishes and not reader.publishes
        if (writer.topic, writer.type) == (reader.topic, reader.type)
        if (reasons := misfits(writer.qos, reader.qos))
    ]
    return sorted(set(lines))


def _ros_topic(name: str) -> str:
    return name.removeprefix("rt")


def _is_hidden(node: str) -> bool:
    return node.rpartition("/")[2].startswith(_HIDDEN)


def main() -> None:
    """Print nodes, topics and problems; exit code 2 if the domain cannot be joined."""
    try:
        seen = observe_domain(network(os.environ)).as_dict()
    except TransportError as error:
        sys.stderr.write(f"{error}\n")
        sys.stderr.flush()
        os._exit(2)  # do not wait for a partially started middleware
    sys.stdout.write(json.dumps(seen))


if __name__ == "__main__":
    main()
