"""The table of guards is valid; ``make mutants`` breaks each, and ``make test-all`` a quarter of them."""

import datetime
from dataclasses import replace

import pytest
from scripts.mutants import FEWEST, PARTS, Mutant, part_of_day, read_table

MUTANTS = read_table()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: f"{mutant.file}: {mutant.guard}")
def test_a_row_changes_one_place_and_names_tests_that_are_there(mutant: Mutant) -> None:
    assert mutant.problem == ""


def test_there_are_enough_and_no_two_are_the_same() -> None:
    assert len({(each.file, each.find, each.replace) for each in MUTANTS}) == len(MUTANTS) >= FEWEST
    assert len({each.guard for each in MUTANTS}) == len(MUTANTS)


def test_each_comes_up_within_so_many_days() -> None:
    today = datetime.date(2026, 11, 24)
    days = [part_of_day(MUTANTS, today + datetime.timedelta(days=n)) for n in range(PARTS)]
    assert sorted(each.guard for day in days for each in day) == sorted(each.guard for each in MUTANTS)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"find": "no such text"}, "occurs 0 times"),
        ({"find": "self"}, "times in"),
        ({"file": "nowhere.py"}, "there is no nowhere.py"),
        ({"tests": ()}, "names no guard or no test"),
        ({"tests": ("control/test_safety.py::test_nothing",)}, "there is no test"),
        ({"tests": ("control/test_safety.py",)}, "there is no test"),
        ({"tests": ("control/test_histories.py::test_histories",)}, "only by chance"),
        (
            {"tests": ("control/test_safety.py::test_whatever_happens_a_stopped_robot_follows_nobody",)},
            "finds it only by chance",
        ),
    ],
)
def test_what_is_wrong_with_a_row_is_said(changes: dict[str, object], words: str) -> None:
    row = next(each for each in MUTANTS if each.file == "control/safety.py")
    assert words in replace(row, **changes).problem  # type: ignore[arg-type]
