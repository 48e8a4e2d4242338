"""What becomes of a fault in stepped time."""

from dataclasses import dataclass
from functools import lru_cache

from tests.faults.chain import SPEED_MPS, Chain
from tests.faults.rows import Row, lower_the_hand, rows

DRIVE_S, FAULT_S, AFTER_S, NEUTRAL_S = 0.8, 2.0, 1.0, 0.5
AT_ONCE_S = 0.02
"""One step of the chain: what is slower than this is not the same moment."""


@dataclass(frozen=True)
class Outcome:
    """What was seen.

    Attributes:
        where: The node or topic that the fault befell.
        fault: What happened.
        zero_s: From the moment at which the reason to drive ended to the last one at which the robot was asked to move.
        moves_again: Whether it moved after the fault, before whoever drives had let go.
        drives_again: Whether it could be driven after that.
        said: What the control says meanwhile; what the robot says where the control is gone.
    """

    where: str
    fault: str
    zero_s: float
    moves_again: bool
    drives_again: bool
    said: str


@lru_cache
def outcomes() -> dict[str, Outcome]:
    """Return what becomes of each row, by its name."""
    return {row.name: outcome_of(row) for row in rows()}


def outcome_of(row: Row) -> Outcome:
    """Drive, let it happen, let it end; then let go, and drive again."""
    chain = row.make()
    chain.run(NEUTRAL_S)
    _hold(chain, row)
    chain.run(DRIVE_S)
    assert chain.base.is_asked_to_move, f"{row.name}: does not drive to begin with: {chain.said}"
    ended_s = chain.clock.now()
    row.begin(chain)
    if row.leaves_reason:
        chain.run(1.0)
        ended_s = chain.clock.now()
        row.end_reason(chain)
    chain.run(FAULT_S / 2)
    said = chain.said["hand_sign_control"] if chain.is_well("control") else chain.said["robot"]
    chain.run(FAULT_S / 2)
    moved = chain.moved(ended_s, chain.clock.now())
    row.end(chain)
    ended = chain.clock.now()
    chain.run(AFTER_S)
    again = bool(chain.moved(ended + AT_ONCE_S, chain.clock.now()))
    lower_the_hand(chain)
    chain.run(NEUTRAL_S)
    _hold(chain, row)
    chain.run(DRIVE_S)
    return Outcome(
        row.where, row.fault, max(moved, default=ended_s) - ended_s, again, chain.base.is_asked_to_move, said
    )


def _hold(chain: Chain, row: Row) -> None:
    if row.by_stick:
        chain.page.holds_stick = True
    else:
        chain.show("Forward")


__all__ = ["SPEED_MPS", "Outcome", "outcome_of", "outcomes"]
