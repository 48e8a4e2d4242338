"""What docs/faults.md says of faults is what the code does; and none of them lets a robot move without a reason."""

import pytest

from tests.faults.rows import rows
from tests.faults.stepped import outcomes
from tests.faults.table import LIMIT_S, cells, written

# Each worker would compute the whole table for itself.
pytestmark = pytest.mark.xdist_group("stepped")
ROWS = {row.name: row for row in rows()}
LEAST_ROWS = 60


def test_there_are_as_many_rows_as_promised() -> None:
    assert len(ROWS) == len(rows()) >= LEAST_ROWS


@pytest.mark.parametrize("name", ROWS)
def test_the_robot_stands_within_the_limit_and_until_neutral_was_seen(name: str) -> None:
    outcome = outcomes()[name]
    assert outcome.zero_s is not None
    assert outcome.zero_s <= LIMIT_S + 1e-6
    assert not outcome.moves_again
    assert outcome.drives_again != ROWS[name].is_for_good


def test_the_document_says_what_the_code_does() -> None:
    assert written("stepped") == [cells(outcome) for outcome in outcomes().values()], "run make faults"
