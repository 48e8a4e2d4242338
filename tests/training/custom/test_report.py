from handsteer.training.custom.report import Lookalike, TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import Confusion


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
