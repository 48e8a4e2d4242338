"""Links that are cut or slow, between machines: what docs/faults.md says of them, and a part of it seen again."""

import pytest

from tests.distributed.network import NoNamespacesError
from tests.faults.table import LIMIT_S, written

pytest.importorskip("cyclonedds")

from tests.faults.networks import LAYOUTS, drive, outcome_of, rows

SEEN_S = 0.05
"""What it takes until the speed has fallen by so much that it is seen."""


@pytest.mark.netns
@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_robot_behind_a_link_that_is_cut_stands_in_time_and_until_neutral_was_seen(layout: str) -> None:
    row = next(row for row in rows() if row.where == layout)
    try:
        with drive(layout) as made:
            outcome = outcome_of(row, made)
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")
    assert outcome.zero_s is not None
    assert outcome.zero_s <= LIMIT_S + SEEN_S
    assert not outcome.moves_again


def test_what_was_seen_of_links_holds_too() -> None:
    seen = written("networks")
    assert {(where, fault) for where, fault, *_ in seen} == {(row.where, row.fault) for row in rows()}
    for where, fault, zero, again, _ in seen:
        assert float(zero) <= LIMIT_S + SEEN_S, f"{where}: {fault}"
        assert again == "no", f"{where}: {fault}"
