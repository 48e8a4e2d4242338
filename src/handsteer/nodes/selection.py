"""Sends velocity commands to the selected one of several robots, and zeros to the ones selected before."""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from handsteer.config.driving import NEXT
from handsteer.errors import quoted
from handsteer.messages import SELECT_ROBOT, SELECTED_ROBOT, String, Topic
from handsteer.nodes.base import Node
from handsteer.transports.commands import Commands

log = logging.getLogger(__name__)

_LAST_ZEROS = 10


class Selection:
    """The robots that one control drives, one at a time; the first is selected initially.

    A name on ``/select_robot`` selects a robot, ``next`` the following one; ``/selected_robot``, latched, has the
    selected one.

    Args:
        node: The control.
        names: Namespaces of the robots, in order, at least one.
        cmd_vel: The topic of commands within each namespace.
        advertise: Returns the publisher of a topic of commands.
        on_change: Called when another robot was selected, before anything is sent to it.

    Attributes:
        robot: Namespace of the robot that is driven.
        topics: The command topic of each robot.
    """

    def __init__(
        self,
        node: Node,
        names: tuple[str, ...],
        cmd_vel: Topic[Any],
        advertise: Callable[[Topic[Any]], Commands],
        on_change: Callable[[], None],
    ) -> None:
        self.robot = names[0]
        self._node = node
        self._names = names
        topics = {name: replace(cmd_vel, name=f"/{name}{cmd_vel.name}") for name in names}
        self.topics = tuple(topics.values())
        self._commands = {name: advertise(topic) for name, topic in topics.items()}
        self._on_change = on_change
        self._left: dict[str, int] = {}
        self._selected = node.publisher(SELECTED_ROBOT)
        self._selected.publish(String(data=self.robot))
        node.subscribe(SELECT_ROBOT, lambda received: self.select(received.message.data.strip()))

    @property
    def commands(self) -> Commands:
        """The publisher of commands to the selected robot."""
        return self._commands[self.robot]

    def follow(self) -> bool:
        """Use the message type that each robot subscribes to; return whether it has changed for the selected one."""
        changed = [name for name, commands in self._commands.items() if commands.follow()]
        return self.robot in changed

    def select(self, name: str) -> None:
        """Select the robot ``name``, or the following one for :data:`NEXT`; an unknown name changes nothing.

        The previous one gets a zero first, and more from :meth:`beat`, unless the control is inactive.
        """
        if name == NEXT:
            name = self._names[(self._names.index(self.robot) + 1) % len(self._names)]
        if name not in self._names:
            log.warning("there is no robot %s to select; there are %s", quoted(name), ", ".join(self._names))
        elif name != self.robot:
            if self._node.is_active:
                self._left[self.robot] = _LAST_ZEROS
            self._left.pop(name, None)
            self.robot = name
            self.beat()
            self._on_change()
            self._selected.publish(String(data=name))

    def beat(self) -> None:
        """Send a zero to each robot that was selected a moment ago."""
        for name in list(self._left):
            self._commands[name].send(0.0, 0.0)
            self._left[name] -= 1
            if not self._left[name]:
                del self._left[name]

    def forget(self) -> None:
        """Send nothing more to robots that were selected a moment ago."""
        self._left.clear()
