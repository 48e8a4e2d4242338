"""A graph of several processes as seen by an observer: its nodes, topics and problems."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

UNNAMED = "a node without a name"
"""Name of a node that was not announced, for its publishers and subscribers."""
_VELOCITIES = {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped", "geometry_msgs/Twist"}


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

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


def amiss(nodes: Iterable[str], topics: Iterable[ObservedTopic]) -> list[str]:
    """Return problems common to all transports: several commanders or types of a topic, duplicate node names."""
    said = [
        f"{count} nodes have the name {name}: end one of them, or rename it (-r __node:=other)"
        for name, count in Counter(nodes).items()
        if count > 1
    ]
    for topic in topics:
        if len(topic.types) > 1:
            said.append(f"{topic.name} has the types {' and '.join(topic.types)}: only those of one type are connected")
        if len(topic.publishers) > 1 and _VELOCITIES & set(topic.types):
            said.append(many_voices(topic.name, topic.publishers))
    return said


def many_voices(topic: str, publishers: Sequence[str]) -> str:
    """Return a warning about a command topic that has several ``publishers``."""
    return (
        f"{topic} has {len(publishers)} publishers ({', '.join(publishers)}), and a robot "
        "obeys all of them in turn: end all but one, or give each a topic of its own by remapping"
    )
