"""Names of nodes, topics and types in ROS 2, and their remapping."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from handsteer.errors import TransportError
from handsteer.messages import Topic

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NODE = re.compile(_TOKEN)
_FULL = re.compile(rf"(/{_TOKEN})+")
_LONGEST = 255

_LARGEST = 232  # higher ones have no UDP ports in DDS


@dataclass(frozen=True)
class Remap:
    """A rule ``-r source:=target``, for one node or for all; the source is a topic, ``__node`` or ``__ns``."""

    source: str
    target: str
    node: str | None = None

    def applies_to(self, node: str) -> bool:
        """Return whether the rule applies to the node of this name."""
        return self.node in {None, node}


@dataclass(frozen=True)
class NodeName:
    """A node's name and namespace (such as ``/`` or ``/r1``), and its rules for topics, of which the first applies."""

    name: str
    namespace: str = "/"
    remaps: tuple[Remap, ...] = ()

    @property
    def full(self) -> str:
        """The full name, such as ``/r1/my_camera``."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def topic(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic``, such as ``/r1/image_raw``, remapped.

        A topic that is beneath another is renamed with it, unless it has a rule of its own.

        Raises:
            TransportError: A rule results in a name that is not allowed.
        """
        full = self.expand(topic.ros_name)
        for rule in self.remaps:
            if rule.applies_to(self.name) and self.expand(rule.source) == full:
                return self.expand(rule.target)
        return full if topic.beneath is None else topic.moved_with(self.topic(topic.beneath))

    def expand(self, name: str) -> str:
        """Return the full name of one that may be relative (``a``), private (``~/a``) or contain ``{node}``, ``{ns}``.

        Raises:
            TransportError: It is not a valid topic name.
        """
        base = self.namespace.rstrip("/")
        full = name.replace("{node}", self.name).replace("{namespace}", base).replace("{ns}", base)
        if full == "~" or full.startswith("~/"):
            full = self.full + full[1:]
        elif not full.startswith("/"):
            full = f"{base}/{full}"
        if not _FULL.fullmatch(full) or len(full) > _LONGEST:
            raise TransportError(
                f"{name!r} is not a valid topic name in ROS 2: it should have letters, digits and _, as camera/image"
            )
        return full


def identify(node: str, remaps: Sequence[Remap]) -> NodeName:
    """Return the name of the node whose default name is ``node``, with ``remaps`` applied.

    Raises:
        TransportError: A rule has a name that is not allowed.
    """
    name = next((rule.target for rule in remaps if rule.source == "__node" and rule.applies_to(node)), node)
    if not _NODE.fullmatch(name) or len(name) > _LONGEST:
        raise TransportError(f"__node:={name}: the name of a node has letters, digits and _, as my_camera")
    namespace = next((rule.target for rule in remaps if rule.source == "__ns" and rule.applies_to(name)), "/")
    if namespace != "/" and (not _FULL.fullmatch(namespace) or len(namespace) > _LONGEST):
        raise TransportError(f"__ns:={namespace}: a namespace starts with a slash and does not end with one, as /r1")
    named = NodeName(name, namespace, tuple(rule for rule in remaps if not rule.source.startswith("__")))
    for rule in named.remaps:
        named.expand(rule.source)
        named.expand(rule.target)
    return named


def domain_id(environment: Mapping[str, str]) -> int:
    """Return ``ROS_DOMAIN_ID``, 0 to 232, of ``environment``; 0 if it is not set.

    Raises:
        TransportError: It has a value that is not allowed.
    """
    text = environment.get("ROS_DOMAIN_ID", "")
    if not text:
        return 0
    if not (text.isascii() and text.isdigit() and int(text) <= _LARGEST):
        raise TransportError(f"ROS_DOMAIN_ID is {text!r}: it should be a whole number from 0 to {_LARGEST}")
    return int(text)


def dds_type_name(name: str) -> str:
    """Return ROS 2's name in DDS for a type: ``geometry_msgs::msg::dds_::Twist_`` for ``geometry_msgs/msg/Twist``."""
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def ros_type_name(dds_name: str) -> str:
    """Return the type's name in ROS 2, ``geometry_msgs/msg/Twist``, for its name in DDS."""
    return dds_name.replace("::dds_::", "::").replace("::", "/").removesuffix("_")
