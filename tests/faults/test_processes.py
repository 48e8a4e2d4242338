"""Signals to real processes: a part of the rows that ``make faults`` writes into docs/faults.md."""

from collections.abc import Iterator

import pytest

from tests.faults.table import LIMIT_S, written

pytest.importorskip("cyclonedds")

from tests.faults.processes import SIGNALS, Rig, Row, outcome_of, rig, rows

SEEN_S = 0.05
"""What it takes until the speed has fallen by so much, or until the onlooker looks, that it is seen."""
CONTROL = [row for row in rows() if row.by == "signs" and row.where == "control" and row.fault.startswith(SIGNALS)]
ROBOT = [row for row in rows() if row.where == "robot" and row.fault.startswith("SIGSTOP")]


@pytest.fixture(scope="module")
def signs() -> Iterator[Rig]:
    with rig("signs") as made:
        yield made


@pytest.mark.exhaustive
@pytest.mark.slow
@pytest.mark.parametrize("row", [*CONTROL, *ROBOT], ids=lambda row: row.name)
def test_the_robot_stands_within_the_limit_and_until_neutral_was_seen(signs: Rig, row: Row) -> None:
    outcome = outcome_of(row, signs)
    assert outcome.zero_s is None or outcome.zero_s <= LIMIT_S + SEEN_S
    assert not outcome.moves_again


def test_what_was_seen_of_processes_holds_too() -> None:
    seen = written("processes")
    assert len(seen) >= len(SIGNALS) * 5
    for where, fault, zero, again, _ in seen:
        assert zero == "-" or float(zero) <= LIMIT_S + SEEN_S, f"{where}: {fault}"
        assert again == "no", f"{where}: {fault}"
