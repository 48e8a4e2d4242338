from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.teach.dataset import Dataset, LabelSummary
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion
from handsteer.plugins.teach.report import (
    CustomSignFigures,
    Lookalike,
    TrainingReport,
    false_hands,
    how_it_was_tried,
    mistakes,
    split,
)
from tests.plugins.teach.takes import take


def report(held_out: str = "take", *, counts: tuple[tuple[int, ...], ...], known: int = 0) -> TrainingReport:
    found = (Lookalike("Peace", "Forward", Share(known, 30)),) if known else ()
    return TrainingReport((), held_out, Confusion(("Peace", "Call", "NONE"), counts), Share(4, 1000), found)


def test_what_gets_confused_is_told_the_most_frequent_first() -> None:
    told = mistakes(report(counts=((27, 0, 3), (1, 39, 0), (0, 0, 0)), known=2))
    assert told == [
        "Peace is mistaken for no sign 3 of 30 times",
        "Peace is mistaken for Forward 2 of 30 times",
        "Call is mistaken for Peace 1 of 40 times",
    ]
    assert mistakes(report(counts=((30, 0, 0), (0, 40, 0), (0, 0, 0)))) == []


def test_the_figures_say_what_they_are_of() -> None:
    of_takes = report(counts=((0, 0, 0),) * 3)
    assert how_it_was_tried(of_takes).endswith("one take at a time; not yet tested on other persons")
    assert how_it_was_tried(report("person", counts=((0, 0, 0),) * 3)).endswith("one person at a time")
    assert false_hands(of_takes).startswith("Of synthetic hands of all shapes, 0.4% are recognised")


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


def test_a_hand_counts_once_however_often_it_was_tried() -> None:
    either = CustomSignFigures(LabelSummary("Peace", 5, 119, 1, 1), False, 0.9, Share(230, 238))
    assert (either.hands_tried, replace(either, recall=None).hands_tried) == (119, 0)
    assert replace(either, sided=True, recall=Share(100, 119)).hands_tried == 119
    tried = replace(report(counts=((0, 0, 0),) * 3), signs=(either,))
    assert how_it_was_tried(tried).startswith("Recognition of held-out hands, each as it is and mirrored, one take")
