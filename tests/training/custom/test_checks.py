from hypothesis import given
from hypothesis import strategies as st

from handsteer.training.custom.dataset import Dataset
from handsteer.training.custom.report import split
from tests.training.custom.takes import take

HANDS = take("Hi", "Peace", hands=1).hands


def dataset(*takes: tuple[str, str, str]) -> Dataset:
    return Dataset(tuple(take(label, "Peace", person=who, session=when, hands=1) for label, who, when in takes))


@given(
    st.lists(
        st.tuples(st.sampled_from(["A", "B", "NONE"]), st.sampled_from("xyzw"), st.sampled_from("12")),
        min_size=4,
        max_size=12,
    )
)
def test_a_person_is_never_on_both_sides(takes: list[tuple[str, str, str]]) -> None:
    data = dataset(*takes)
    labels = [label for label in data.labels if label != "NONE"]
    kind, folds = split(data, labels)
    for fold in folds:
        assert not {id(each) for each in fold.held_out} & {id(each) for each in fold.rest}
        assert {each.label for each in fold.held_out} <= {each.label for each in fold.rest} - {"NONE"}
        if kind == "person":
            assert not {each.person for each in fold.held_out} & {each.person for each in fold.rest}
        if kind == "session":
            assert not {(each.person, each.session) for each in fold.held_out} & {
                (each.person, each.session) for each in fold.rest
            }


def test_what_is_held_out_depends_on_what_there_is() -> None:
    assert split(dataset(("A", "x", "1"), ("A", "y", "1"), ("B", "x", "1"), ("B", "x", "1")), ["A", "B"])[0] == "person"
    assert split(dataset(("A", "x", "1"), ("A", "x", "2")), ["A"])[0] == "session"
    assert split(dataset(("A", "x", "1"), ("A", "x", "1")), ["A"])[0] == "take"
    assert split(dataset(("A", "x", "1"), ("A", "x", "1"), ("B", "y", "1"), ("B", "y", "1")), ["A", "B"])[0] == "take"


def test_every_take_is_held_out_once() -> None:
    data = dataset(*[("A", "x", "1")] * 5, *[("B", "x", "1")] * 4)
    _, folds = split(data, ["A", "B"])
    held_out = [id(each) for fold in folds for each in fold.held_out]
    assert sorted(held_out) == sorted(id(each) for each in data.takes)
    assert len(folds) == 3
