"""Runs nodes by hand on a stepped clock."""

from typing import TypeVar

from handsteer.clock import SteppedClock
from handsteer.messages import Topic
from handsteer.nodes.base import Node
from handsteer.transports.in_process import InProcessTransport

M = TypeVar("M")


class Bench:
    """A transport, a clock, and whatever nodes a test puts on it."""

    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.transport = InProcessTransport()
        self.nodes: list[Node] = []

    def record(self, topic: Topic[M]) -> list[M]:
        """Return a list that grows with each message of ``topic``."""
        messages: list[M] = []
        self.transport.subscribe("recorder", topic, lambda received: messages.append(received.message))
        return messages

    def run(self, seconds: float) -> None:
        """Let ``seconds`` of the clock pass, serving each timer and message in its time."""
        end_s = self.clock.now() + seconds
        while True:
            while any([node.spin_once() for node in self.nodes]):
                pass
            due = [node.next_due_s for node in self.nodes if node.next_due_s is not None]
            if not due or min(due) > end_s:
                break
            self.clock.advance_to(min(due))
        self.clock.advance_to(end_s)
