import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import StudyError
from handsteer.plugins.study.forms import FORMS, score
from handsteer.plugins.study.plan import FormName


def answers(form: FormName, values: list[int]) -> dict[str, int]:
    return dict(zip((item.name for item in FORMS[form].items), values, strict=True))


def test_the_forms_have_the_items_and_answers_of_their_sources() -> None:
    assert len(FORMS["tlx"].items) == 6
    assert FORMS["tlx"].answers == tuple(range(0, 101, 5))
    assert len(FORMS["sus"].items) == 10
    assert FORMS["sus"].answers == (1, 2, 3, 4, 5)
    names = [item.name for form in FORMS.values() for item in form.items]
    assert len(set(names)) == 16


@pytest.mark.parametrize(
    ("values", "expected"),
    [([5, 1] * 5, 100.0), ([1, 5] * 5, 0.0), ([3] * 10, 50.0), ([4, 2, 4, 2, 5, 1, 5, 2, 4, 3], 80.0)],
)
def test_the_sus_score_is_as_brooke_defines_it(values: list[int], expected: float) -> None:
    assert score("sus", answers("sus", values)) == expected


@given(st.lists(st.integers(0, 20).map(lambda mark: 5 * mark), min_size=6, max_size=6))
def test_the_raw_tlx_is_the_mean_of_its_scales(values: list[int]) -> None:
    assert score("tlx", answers("tlx", values)) == pytest.approx(sum(values) / 6)


@given(st.lists(st.integers(1, 5), min_size=10, max_size=10), st.integers(0, 9))
def test_a_sus_score_rises_with_odd_items_and_falls_with_even_ones(values: list[int], at: int) -> None:
    before = score("sus", answers("sus", values))
    assert 0 <= before <= 100
    if values[at] < 5:
        values[at] += 1
        assert score("sus", answers("sus", values)) - before == (2.5 if at % 2 == 0 else -2.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tlx_effort": 7}, "question 5: 7 is not a valid answer: 0 to 100 are"),
        ({"tlx_effort": 105}, "question 5: 105 is not a valid answer"),
        ({"tlx_mental": True}, "question 1: True is not a valid answer"),
        ({"sus_1": 3}, "tlx has no item sus_1"),
    ],
)
def test_an_impossible_answer_is_refused(change: dict[str, int], message: str) -> None:
    with pytest.raises(StudyError, match=message):
        score("tlx", {**answers("tlx", [50] * 6), **change})


def test_a_missing_answer_is_named() -> None:
    given = answers("sus", [3] * 10)
    del given["sus_4"]
    with pytest.raises(StudyError, match="question 4 has no answer yet"):
        score("sus", given)
