"""A row of the table, and what rows are made of: things that happen to a node, or to whoever drives."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handsteer.messages import Topic
from handsteer.nodes.base import Node
from tests.faults.chain import Chain

Act = Callable[[Chain], None]


def nothing(_: Chain) -> None:
    """Do nothing."""


def lower_the_hand(chain: Chain) -> None:
    """End the reason of whoever drives: no sign, no stick."""
    chain.show()
    chain.page.holds_stick = False
    if chain.is_well("steering"):
        chain.steering.release()


@dataclass(frozen=True)
class Row:
    """A fault while the robot drives.

    Attributes:
        where: The node or topic that it befalls.
        fault: What happens, in words.
        begin: Makes it happen.
        end: Ends it.
        end_reason: Ends the reason to drive where the fault does not: the robot may drive on till then.
        by_stick: Whether the page's stick drives, and not a hand.
        lasts_s: For how long.
        is_for_good: Whether the robot has to stand even when the fault is over and neutral was seen.
        make: Builds the chain.
    """

    where: str
    fault: str
    begin: Act
    end: Act = nothing
    end_reason: Act = nothing
    by_stick: bool = False
    lasts_s: float = 2.0
    is_for_good: bool = False
    make: Callable[[], Chain] = Chain

    @property
    def name(self) -> str:
        return f"{self.where}: {self.fault}"

    @property
    def leaves_reason(self) -> bool:
        """Whether the robot may drive on during the fault, until the hand is lowered."""
        return self.end_reason is not nothing


class _Beat(Node):
    """Another program, which publishes without an end."""

    def __init__(self, chain: Chain, topic: Topic[Any], make: Callable[[], object], every_s: float) -> None:
        super().__init__("another", chain.faults, chain.clock)
        publisher = self.publisher(topic)
        self.every(every_s, lambda: publisher.publish(make()))


def publish_for_ever(chain: Chain, topic: Topic[Any], make: Callable[[], object], every_s: float = 1 / 30) -> None:
    chain.nodes["another"] = _Beat(chain, topic, make, every_s)


def silence(chain: Chain) -> None:
    if "another" in chain.nodes:
        chain.domain.kill("another")
        del chain.nodes["another"]


def lower_and_silence(chain: Chain) -> None:
    lower_the_hand(chain)
    chain.run(0.1)
    silence(chain)


def frozen(name: str) -> Act:
    return lambda chain: chain.freeze(name)


def unfrozen(name: str) -> Act:
    def end(chain: Chain) -> None:
        silence(chain)
        chain.thaw(name)

    return end


def killed(name: str) -> Act:
    return lambda chain: chain.kill(name)


def ended(name: str) -> Act:
    return lambda chain: chain.end(name)


def made(name: str) -> Act:
    def make(chain: Chain) -> None:
        chain.make(name)
        if name == "steering":
            chain.page.holds_stick = False

    return make
