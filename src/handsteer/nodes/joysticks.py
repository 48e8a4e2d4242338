"""Subscribes the control to joysticks: the hand on ``/gesture/joy``, and a gamepad on ``/joy``."""

import logging
import math
from collections.abc import Callable
from typing import Protocol

from handsteer.config import JoyConfig
from handsteer.messages import JOY, Joy, Topic, stick_in
from handsteer.nodes.base import Node
from handsteer.nodes.timing import duration_in_words
from handsteer.timeouts import STALE_S
from handsteer.transports.base import Received, Subscription
from handsteer.types import Stick

log = logging.getLogger(__name__)


class OnGamepad(Protocol):
    """Receives the states of a gamepad."""

    def __call__(self, stick: Stick, received: Received[Joy], *, is_at_rest: bool) -> None:
        """Process one; ``is_at_rest`` is whether its button is not held, and was not before."""
        ...


class Joysticks:
    """Passes on the states of both joysticks while they are wanted.

    Args:
        node: The control.
        hand: Topic of the hand as a joystick.
        on_hand: Receives each of its messages.
        rule: How the gamepad's messages are read.
        on_gamepad: Receives each state of the gamepad; a message whose stamp does not advance is not another one.
    """

    def __init__(
        self,
        node: Node,
        hand: Topic[Joy],
        on_hand: Callable[[Received[Joy]], None],
        rule: JoyConfig,
        on_gamepad: OnGamepad,
    ) -> None:
        self._node, self._hand = node, hand
        self._on_hand, self._on_gamepad = on_hand, on_gamepad
        self._rule = rule.model_dump()
        self._is_gamepad_held = self._has_warned = False
        self._stamped_s = -math.inf
        self._subscriptions: dict[str, Subscription] = {}

    def listen(self, *, hand: bool, gamepad: bool) -> None:
        """Subscribe to what is wanted, and unsubscribe from the rest; without effect if that is so already."""
        if not gamepad:
            self._is_gamepad_held = False
        self._listen(self._hand, hand, self._on_hand)
        self._listen(JOY, gamepad, self._take)

    def _listen(self, topic: Topic[Joy], on: bool, deliver: Callable[[Received[Joy]], None]) -> None:
        if on and topic.name not in self._subscriptions:
            self._subscriptions[topic.name] = self._node.subscribe(topic, deliver)
        elif not on and topic.name in self._subscriptions:
            self._subscriptions.pop(topic.name).close()

    def _is_new(self, stamped_s: float | None) -> bool:
        """Return whether a gamepad's message was not sent before; one without a stamp counts as sent on arrival."""
        if stamped_s is None:
            return True
        ahead_s = stamped_s - self._node.clock.now()
        if abs(ahead_s) > STALE_S and not self._has_warned:
            self._has_warned = True
            when = f"{duration_in_words(abs(ahead_s))} {'ahead' if ahead_s > 0 else 'ago'}"
            name = self._node.transport.topic_name(JOY)
            log.warning("%s is stamped %s, and not followed: are the clocks of the machines synchronised?", name, when)
        if ahead_s > STALE_S or stamped_s <= self._stamped_s:
            return False
        self._stamped_s = stamped_s
        return True

    def _take(self, received: Received[Joy]) -> None:
        if not self._is_new(received.captured_s):
            return
        stick = stick_in(received.message, **self._rule)
        was_held = self._is_gamepad_held
        if not stick.is_valid and not was_held:
            return  # neither a release, nor something to follow
        self._is_gamepad_held = stick.held
        self._on_gamepad(stick, received, is_at_rest=not (stick.held or was_held))
