"""Subscribes the control to joysticks: the hand on ``/gesture/joy``, and a gamepad on ``/joy``."""

from collections.abc import Callable

from handsteer.config import JoyConfig
from handsteer.messages import JOY, Joy, Topic, stick_in
from handsteer.nodes.base import Node
from handsteer.transports.base import Received, Subscription
from handsteer.types import Stick

OnStick = Callable[[Stick, Received[Joy]], None]


class Joysticks:
    """Passes on the states of both joysticks while they are wanted.

    Args:
        node: The control.
        hand: Topic of the hand as a joystick.
        on_hand: Receives each of its states.
        rule: How the gamepad's messages are read.
        on_gamepad: Receives the gamepad's states while its button is held, and the first one after its release: one at
            rest leaves the robot to others.
    """

    def __init__(self, node: Node, hand: Topic[Joy], on_hand: OnStick, rule: JoyConfig, on_gamepad: OnStick) -> None:
        self._node, self._hand = node, hand
        self._on_hand, self._on_gamepad = on_hand, on_gamepad
        self._rule = rule.model_dump()
        self._is_gamepad_held = False
        self._subscriptions: list[Subscription] = []

    def listen(self, *, on: bool) -> None:
        """Subscribe or unsubscribe; without effect if that is so already."""
        if on == bool(self._subscriptions):
            return
        for subscription in self._subscriptions:
            subscription.close()
        self._is_gamepad_held = False
        self._subscriptions = (
            [
                self._node.subscribe(self._hand, lambda received: self._on_hand(stick_in(received.message), received)),
                self._node.subscribe(JOY, self._take),
            ]
            if on
            else []
        )

    def _take(self, received: Received[Joy]) -> None:
        stick = stick_in(received.message, **self._rule)
        was_held, self._is_gamepad_held = self._is_gamepad_held, stick.held
        if stick.held or was_held:
            self._on_gamepad(stick, received)
