import itertools
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.study.order import group_size, order_of, steps_of, williams
from tests.plugins.study.plans import a_plan

COUNTS = st.integers(1, 12)


@given(COUNTS)
def test_each_row_has_each_treatment_once_and_each_place_has_it_equally_often(count: int) -> None:
    rows = williams(count)
    assert len(rows) == (1 if count == 1 else count * (1 + count % 2))
    assert all(sorted(row) == list(range(count)) for row in rows)
    for place in range(count):
        assert set(Counter(row[place] for row in rows).values()) == {len(rows) // count}


@given(COUNTS)
def test_each_treatment_follows_each_other_equally_often(count: int) -> None:
    pairs = Counter(pair for row in williams(count) for pair in itertools.pairwise(row))
    assert len(pairs) == count * (count - 1)
    assert set(pairs.values()) <= {1 + count % 2}


@given(st.integers(1, 5), st.integers(1, 4))
def test_over_all_participants_each_order_of_conditions_meets_each_of_courses_once(
    conditions: int, courses: int
) -> None:
    whole = len(williams(conditions)) * len(williams(courses))
    plan = a_plan(
        participants=whole,
        conditions=[{"name": f"c{number}"} for number in range(conditions)],
        courses=[f"k{number}" for number in range(courses)],
    )
    assert len({order_of(plan, person) for person in plan.participants}) == whole
    assert len(williams(conditions)) == group_size(plan)


@given(st.integers(0, 3), st.integers(1, 3), st.sampled_from([[], ["tlx"], ["sus", "tlx"]]))
def test_the_steps_are_those_of_the_plan(practice: int, laps: int, forms: list[str]) -> None:
    plan = a_plan(courses=["a", "b"], practice_laps=practice, laps=laps, forms=forms)
    steps = steps_of(plan, "P02")
    assert len(set(steps)) == len(steps)
    assert [step.kind for step in (steps[0], steps[1], steps[-1])] == ["consent", "instructions", "thanks"]
    assert Counter(step.kind for step in steps)["lap"] == 2 * 2 * (practice + laps)
    for condition in ("signs", "pad"):
        own = [step for step in steps if step.condition == condition]
        assert [step.form for step in own if step.form] == forms
        assert own[0].kind == "instructions"
        for course in ("a", "b"):
            driven = [(step.practice, step.lap) for step in own if step.course == course]
            assert driven == [(True, n + 1) for n in range(practice)] + [(False, n + 1) for n in range(laps)]


@pytest.mark.parametrize(("person", "order"), [("P01", ("signs", "pad")), ("P02", ("pad", "signs"))])
def test_two_conditions_alternate(person: str, order: tuple[str, str]) -> None:
    assert order_of(a_plan(), person)[0] == order
