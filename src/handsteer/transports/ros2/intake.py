"""Processing of serialised messages, common to all ROS 2 middlewares."""

import logging
import time
from typing import Generic, TypeVar

from handsteer.clock import Clock
from handsteer.messages import Topic, type_name
from handsteer.transports.channels import Deliver
from handsteer.transports.protocol import Received
from handsteer.transports.ros2.encoding import decode
from handsteer.transports.stale_messages import StaleMessageFilter
from handsteer.transports.stamps import capture_time

M = TypeVar("M")

log = logging.getLogger(__name__)


class Intake(Generic[M]):
    """Decodes the messages of a topic and passes them on, except late ones that do not stop the robot.

    Invalid and late messages are logged once, until they cease.

    Args:
        name: The topic's full name in the graph.
        send: Receives the messages.
    """

    def __init__(self, topic: Topic[M], name: str, clock: Clock, send: Deliver[M]) -> None:
        self._topic = topic
        self._name = name
        self._clock = clock
        self._send = send
        self._lateness = None if topic.lifespan_s is None else StaleMessageFilter(topic.lifespan_s)
        self._was_late = self._is_broken = False

    def take(self, raw: bytes, sender: bytes = b"", sent_s: float | None = None) -> None:
        """Process one message.

        Args:
            raw: The encoded message.
            sender: Identifies the sender; empty if unknown.
            sent_s: Time of sending, in seconds of the sender's clock; None if unknown.
        """
        is_late = self._is_late(sender, sent_s)
        try:
            message = decode(raw, type_name(self._topic.type))
        except Exception as error:
            # Invalid messages must not end the subscription.
            if not self._is_broken:
                log.warning("%s: a message of %d bytes cannot be read: %s", self._name, len(raw), error)
            self._is_broken = True
            return
        if not is_late or (self._topic.stops is not None and self._topic.stops(message)):
            self._send(Received(message, capture_time(message, self._clock), is_late=is_late))

    def _is_late(self, sender: bytes, sent_s: float | None) -> bool:
        if self._lateness is None or sent_s is None:
            return False
        is_late = self._lateness.is_late(sender, sent_s, time.monotonic())
        if is_late and not self._was_late:
            log.warning(
                "%s: messages come over %g s late and are not obeyed, but for stops: has the link stood still, has the "
                "clock of their sender been set back%s?",
                self._name,
                self._topic.lifespan_s,
                "" if sender else ", or have several senders clocks that differ",
            )
        self._was_late = is_late
        return is_late
