"""What becomes of a fault in stepped time."""

from dataclasses import dataclass
from functools import lru_cache

from tests.faults.chain import Chain
from tests.faults.row import Row, lower_the_hand
from tests.faults.rows import rows

# Steering that is heard for the first time within two seconds after the start has to let go first.
START_S, START_WITH_STICK_S = 1.6, 2.1
DRIVE_S, AFTER_S, NEUTRAL_S = 0.6, 1.0, 0.7
AT_ONCE_S = 0.02
"""One step of the chain: what is slower than this is not the same moment."""


@dataclass(frozen=True)
class Outcome:
    """What was seen.

    Attributes:
        where: The node or topic that the fault befell.
        fault: What happened.
        zero_s: From the moment at which the reason to drive ended to the last one at which the robot was asked to move;
            None where that cannot be told, as the robot's node itself was away.
        moves_again: Whether it moved after the fault, before whoever drives had let go.
        drives_again: Whether it could be driven after that.
        said: What the control says meanwhile; what the robot says where the control is gone.
    """

    where: str
    fault: str
    zero_s: float | None
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
    chain.run(START_WITH_STICK_S if row.by_stick else START_S)
    _hold(chain, row)
    chain.run(DRIVE_S)
    assert chain.base.is_asked_to_move, f"{row.name}: does not drive to begin with: {chain.said}"
    ended_s = chain.clock.now()
    row.begin(chain)
    if row.leaves_reason:
        chain.run(1.0)
        ended_s = chain.clock.now()
        row.end_reason(chain)
    chain.run(row.lasts_s / 2)
    said = chain.said[next(name for name in chain.speakers if name in chain.said)]
    chain.run(row.lasts_s / 2)
    moved = chain.moved(ended_s, chain.clock.now())
    row.end(chain)
    ended = chain.clock.now()
    chain.run(AFTER_S)
    again = bool(chain.moved(ended + AT_ONCE_S, chain.clock.now()))
    # Whose zero was lost on the way has to let go once more.
    for _ in range(2 if row.by_stick else 1):
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
