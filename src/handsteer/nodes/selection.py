"""Sends velocity commands to the selected one of several robots, and zeros to the ones selected before."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from handsteer.messages import SELECT_ROBOT, SELECTED_ROBOT, String, Topic
from handsteer.nodes.base import Node
from handsteer.transports.base import Received
from handsteer.transports.commands import Commands

log = logging.getLogger(__name__)

_LAST_ZEROS = 10

Advertise = Callable[[Topic[Any]], Commands]

NEXT = "next"
"""Accepted by :meth:`Fleet.select` instead of a name."""


class Fleet:
    """Several robots, one of which is driven at a time.

    Args:
        names: Names of the robots, at least one; the first is selected initially.

    Attributes:
        selected: Name of the robot that is driven.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self.selected = self._names[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all robots, in order."""
        return self._names

    def select(self, name: str) -> bool:
        """Select the robot ``name``, or the next one for :data:`NEXT`; return whether the selection changed.

        An unknown name changes nothing.
        """
        if name == NEXT:
            name = self._names[(self._names.index(self.selected) + 1) % len(self._names)]
        if name == self.selected or name not in self._names:
            return False
        self.selected = name
        return True


class Selection:
    """The robots that one control drives, one at a time.

    A name on ``/select_robot`` selects a robot, ``next`` the following one; ``/selected_robot``, latched, has the
    selected one.

    Args:
        node: The control.
        names: Namespaces of the robots, in order.
        cmd_vel: The topic of commands within each namespace.
        advertise: Returns the publisher of a topic of commands.
        on_change: Called when another robot was selected, before anything is sent to it.

    Attributes:
        fleet: The robots, and which one is selected.
        topics: The command topic of each robot.
    """

    def __init__(
        self,
        node: Node,
        names: tuple[str, ...],
        cmd_vel: Topic[Any],
        advertise: Advertise,
        on_change: Callable[[], None],
    ) -> None:
        self.fleet = Fleet(names)
        topics = {name: replace(cmd_vel, name=f"/{name}{cmd_vel.name}") for name in names}
        self.topics = tuple(topics.values())
        self._commands = {name: advertise(topic) for name, topic in topics.items()}
        self._on_change = on_change
        self._left: dict[str, int] = {}
        self._selected = node.publisher(SELECTED_ROBOT)
        self._selected.publish(String(data=self.fleet.selected))
        node.subscribe(SELECT_ROBOT, self._on_select)

    @property
    def commands(self) -> Commands:
        """The publisher of commands to the selected robot."""
        return self._commands[self.fleet.selected]

    def follow(self) -> bool:
        """Use the message type that each robot subscribes to; return whether it has changed for the selected one."""
        changed = [name for name, commands in self._commands.items() if commands.follow()]
        return self.fleet.selected in changed

    def select(self, name: str) -> None:
        """Select the robot ``name`` (or ``next``); the previous one gets a zero first, and more from :meth:`beat`."""
        before = self.fleet.selected
        if not self.fleet.select(name):
            return
        self._left[before] = _LAST_ZEROS
        self._left.pop(self.fleet.selected, None)
        self.beat()
        self._on_change()
        self._selected.publish(String(data=self.fleet.selected))

    def beat(self) -> None:
        """Send a zero to each robot that was selected a moment ago."""
        for name in list(self._left):
            self._commands[name].send(0.0, 0.0)
            self._left[name] -= 1
            if not self._left[name]:
                del self._left[name]

    def _on_select(self, received: Received[String]) -> None:
        name = received.message.data.strip()
        self.select(name)
        if name != self.fleet.selected and name not in (*self.fleet.names, NEXT):
            log.warning("there is no robot %r to select; there are %s", name, ", ".join(self.fleet.names))
