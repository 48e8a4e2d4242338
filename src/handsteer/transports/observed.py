"""A graph of several processes as somebody sees who looks on: its nodes, its topics, and what is amiss."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

UNNAMED = "a node without a name"
"""Whoever publishes or subscribes, but has not told which node it is."""
_VELOCITIES = {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped", "geometry_msgs/Twist"}


@dataclass(frozen=True)
class ObservedTopic:
    """A topic, and who publishes it.

    Attributes:
        name: Full name, as ``/r1/image_raw``.
        types: Its types, as ``sensor_msgs/msg/Image``; more than one is a fault.
        publishers: The node of each publisher; a node that has two is there twice.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]


@dataclass(frozen=True)
class ObservedGraph:
    """What was seen of a graph.

    Attributes:
        place: Where was looked, in words: ``domain 0, this machine``.
        nodes: Full names; two nodes of one name are there twice.
        topics: By name.
        warnings: What is amiss, a sentence each.
    """

    place: str
    nodes: tuple[str, ...]
    topics: tuple[ObservedTopic, ...]
    warnings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain values, for JSON."""
        return asdict(self)


def amiss(nodes: Iterable[str], topics: Iterable[ObservedTopic]) -> list[str]:
    """Return what is amiss whatever carries the messages: two that drive one robot, two of one name, two types."""
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
    """Return what is to be said of a topic that a robot obeys and that has several ``publishers``."""
    return (
        f"{topic} has {len(publishers)} publishers ({', '.join(publishers)}), and a robot "
        "obeys all of them in turn: end all but one, or give each a topic of its own by remapping"
    )
