"""A publisher of velocity commands as Twist or TwistStamped, depending on the robot's subscription."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from handsteer.clock import Clock
from handsteer.messages import Topic, command, type_name
from handsteer.transports.base import KnowsTypes, Publisher, Transport

_LOOK_PERIOD_S = 0.25

log = logging.getLogger(__name__)


class Commands:
    """A publisher of velocity commands.

    A topic may allow two types (``Topic.or_type``). If the transport knows the types of subscribers, :meth:`follow`
    changes to the second type as soon as there is a subscriber of it, and to the first if there are only subscribers of
    that. Observing tools subscribe to the type that they find, which is initially the first, so a subscriber of the
    second is a robot.

    Args:
        advertise: Returns the publisher of a topic.
        topic: The topic, with Twist, TwistStamped or either.
        clock: The graph's clock, for stamps.
        frame_id: Coordinate frame of a TwistStamped.
    """

    def __init__(
        self,
        transport: Transport,
        advertise: Callable[[Topic[Any]], Publisher[Any]],
        topic: Topic[Any],
        clock: Clock,
        frame_id: str,
    ) -> None:
        self._transport = transport
        self._advertise = advertise
        self._clock = clock
        self._frame_id = frame_id
        self._topic = topic
        # In order of preference.
        self._types = {type_name(kind): kind for kind in (topic.or_type, topic.type) if kind is not None}
        self._graph = transport if isinstance(transport, KnowsTypes) and topic.or_type else None
        self._looked_s = -math.inf
        self._warned = False
        self._publisher = advertise(topic)

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers."""
        return self._publisher.has_subscribers

    def send(self, linear_mps: float, angular_radps: float, captured_s: float | None = None) -> None:
        """Command a velocity, in m/s forward and rad/s to the left; ``captured_s`` is as in :class:`Publisher`."""
        stamp = self._clock.stamp(self._clock.now())
        self._publisher.publish(command(self._topic, linear_mps, angular_radps, stamp, self._frame_id), captured_s)

    def follow(self) -> bool:
        """Change to the type of the subscribers; checks at most four times a second, however often it is called.

        A zero is sent before a change. Returns at once, except for a change, which takes a tenth of a second or two.

        Returns:
            Whether the type has changed, so that another robot may be the subscriber.
        """
        now = self._clock.now()
        if self._graph is None or now - self._looked_s < _LOOK_PERIOD_S:
            return False
        self._looked_s = now
        subscribed = self._graph.subscribed_types(self._topic)
        taken = [kind for name, kind in self._types.items() if name in subscribed]
        changes = bool(taken) and taken[0] is not self._topic.type
        if changes:
            self._change(self._graph, taken[0])
        if len(taken) > 1 and not self._warned:
            log.warning(
                "%s: subscribers take both %s; commands go out as %s only: end the others, or set cmd_vel_type",
                self._transport.topic_name(self._topic),
                " and ".join(self._types),
                type_name(self._topic.type),
            )
        self._warned = len(taken) > 1
        return changes

    def _change(self, graph: KnowsTypes, kind: type[Any]) -> None:
        self.send(0.0, 0.0)
        # Only one publisher at a time: not every middleware lets a process have two types on one topic, and no tool
        # displays it.
        graph.withdraw(self._publisher)
        self._topic = replace(self._topic, type=kind, or_type=self._topic.type)
        self._publisher = self._advertise(self._topic)
        log.info("%s: commands go out as %s from now on", self._transport.topic_name(self._topic), type_name(kind))
