"""The rule by which a row of the table of signs is worse or better, with made counts."""

from dataclasses import replace
from pathlib import Path

import pytest
from _sign_table import LEAST_OF_SAMPLE, Counts, Row, Table, compare, failures, news, read_table, row_of, sums

from handsteer.types import BACKWARD, FORWARD, STOP

BACK = row_of("choose", "arjav", BACKWARD, "back", "raw")
NO_SIGN = row_of("report", "hagrid", "no sign", "like", "raw")


def failing(row: Row, before: Counts, now: Counts, least: int = 1) -> list[str]:
    return list(failures(compare({row: before}, {row: now}, least=least)))


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (Counts(349, 352, 0), Counts(346, 352, 0)),  # 0.85 points
        (Counts(14, 14, 0), Counts(13, 14, 0)),  # one photo is 7 points
        (Counts(1000, 1232, 2), Counts(1000, 1232, 3)),
        (Counts(4900, 5000, 3), Counts(4900, 5000, 8)),  # 0.1 points
        (Counts(14, 90, 0), Counts(90, 90, 0)),
    ],
)
def test_losses_within_the_rule_are_accepted(before: Counts, now: Counts) -> None:
    assert failing(BACK, before, now) == []


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (Counts(349, 352, 0), Counts(345, 352, 0)),  # 1.1 points
        (Counts(14, 14, 0), Counts(12, 14, 0)),
        (Counts(1000, 1232, 2), Counts(1000, 1232, 4)),
        (Counts(4900, 5000, 3), Counts(4900, 5000, 9)),
        (Counts(14, 90, 0), Counts(90, 90, 2)),  # more are right, but others move the robot
    ],
)
def test_a_worse_row_is_named_with_both_counts(before: Counts, now: Counts) -> None:
    (line,) = failing(BACK, before, now)
    assert line.startswith("worse: choose / arjav / Backward / back / raw: ")
    assert f"right {before.right} of {before.of}" in line
    assert f"-> {now.right} of {now.of}" in line
    assert line.endswith(f"moved by mistake {before.moved} -> {now.moved}")


def test_the_sample_may_lose_two_pictures_of_a_row_but_not_three() -> None:
    before = Counts(40, 40, 0)
    assert failing(BACK, before, Counts(38, 40, 2), LEAST_OF_SAMPLE) == []
    assert failing(BACK, before, Counts(37, 40, 0), LEAST_OF_SAMPLE)
    assert failing(BACK, before, Counts(40, 40, 3), LEAST_OF_SAMPLE)


def test_many_rows_that_lose_one_picture_each_are_found_by_their_sum() -> None:
    rows = [row_of("report", f"people {number}", FORWARD, "", "raw") for number in range(10)]
    before, now = ({row: Counts(right, 50, 0) for row in rows} for right in (50, 49))
    (line,) = failures(compare(before, now))
    assert line.startswith("worse: all / all / Forward / - / raw: right 500 of 500")


def test_sums_keep_signs_and_views_separate() -> None:
    rows = [replace_row(BACK, shown=shown, kind=kind) for shown in (BACKWARD, STOP) for kind in ("back", "palm")]
    total = sums({**dict.fromkeys(rows, Counts(1, 2, 1)), replace_row(BACK, view="mirrored"): Counts(5, 5, 5)})
    assert total == {row_of("all", "all", shown, "", "raw"): Counts(2, 4, 2) for shown in (BACKWARD, STOP)}


def replace_row(row: Row, **fields: str) -> Row:
    return row._replace(**fields)


def test_a_row_that_gains_or_is_new_asks_for_an_update_of_the_table() -> None:
    other = row_of("report", "sld", STOP, "", "raw")
    changes = compare({BACK: Counts(14, 90, 0)}, {BACK: Counts(80, 90, 0), other: Counts(164, 164, 0)})
    assert not list(failures(changes))
    assert [line.partition(": right")[0] for line in news(changes)] == [
        f"better: {BACK.name}",
        f"not in the table: {other.name}",
    ]


def test_a_row_that_gains_and_loses_nothing_is_better() -> None:
    def verdict(before: Counts, now: Counts) -> str:
        (change,) = compare({NO_SIGN: before}, {NO_SIGN: now})
        return change.verdict

    assert verdict(Counts(80, 90, 3), Counts(81, 90, 3)) == "better"
    assert verdict(Counts(80, 90, 3), Counts(80, 90, 2)) == "better"
    assert verdict(Counts(80, 90, 3), Counts(80, 90, 3)) == "same"
    assert verdict(Counts(80, 90, 3), Counts(90, 90, 4)) == "same"


@pytest.mark.parametrize(
    ("before", "now", "verdict"),
    [
        ({BACK: Counts(1, 2, 0)}, {}, "not measured"),
        ({BACK: Counts(1, 2, 0)}, {BACK: Counts(3, 3, 0)}, "other pictures"),
    ],
)
def test_rows_that_cannot_be_compared_fail(before: dict[Row, Counts], now: dict[Row, Counts], verdict: str) -> None:
    (line,) = failures(compare(before, now))
    assert line.startswith(f"{verdict}: {BACK.name}")


def test_a_table_is_written_and_read_again(tmp_path: Path) -> None:
    table = Table("digest", {BACK: Counts(9, 90, 1), NO_SIGN: Counts(80, 80, 0)}, {BACK: Counts(4, 40, 0)})
    table.write(tmp_path / "table.json")
    assert read_table(tmp_path / "table.json") == table
    replace(table, sample={}).write(tmp_path / "table.json")
    assert read_table(tmp_path / "table.json").sample == {}
    assert read_table(tmp_path / "none.json") == Table("", {}, {})
