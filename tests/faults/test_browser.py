"""Faults of the page from which somebody drives: what docs/faults.md says of them, and a part of it seen again."""

import pytest

from tests.faults.browser import Row, outcome_of, rows
from tests.faults.table import LIMIT_S, written
from tests.plugins.page.visits import NEEDS_A_BROWSER

SEEN_AGAIN = ("hangs", "network", "scripts")


@pytest.mark.parametrize(
    "row", [row for row in rows() if any(each in row.fault for each in SEEN_AGAIN)], ids=lambda row: row.name
)
class TestSeenAgain:
    """Rows made anew."""

    pytestmark = NEEDS_A_BROWSER

    def test_the_robot_stands_within_the_limit_and_until_it_was_released(self, row: Row) -> None:
        outcome = outcome_of(row)
        assert outcome.zero_s is not None
        assert outcome.zero_s <= LIMIT_S
        assert not outcome.moves_again


def test_what_was_seen_of_pages_holds_too() -> None:
    seen = written("browser")
    assert {(where, fault) for where, fault, *_ in seen} == {(row.where, row.fault) for row in rows()}
    for where, fault, zero, again, _ in seen:
        assert float(zero) <= LIMIT_S, f"{where}: {fault}"
        assert again == "no", f"{where}: {fault}"
