"""The lesson, from step to step, with hands that are made."""

from dataclasses import replace

import pytest

from handsteer.config import TeachConfig
from handsteer.errors import DatasetError
from handsteer.plugins.page.lesson import LONGEST_HOLD_S, MOST_CLASSES, MOST_HANDS, MOST_TAKES, Lesson
from handsteer.plugins.page.lesson_state import NO_HAND, SMALL, STILL, SignClass, filled, hint, is_still
from handsteer.plugins.teach.collect import Facts
from handsteer.plugins.teach.dataset import Dataset
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.types import NONE
from tests.plugins.page.lessons import REPORT
from tests.plugins.teach.takes import take
from tests.recognition.hands import show_sign
from tests.recognition.models import model

NOTHING = SignGuess(NONE, 0.0)
HAND = show_sign("Peace")
PLAN = TeachConfig(takes=3, take_time=0.5, countdown=1.0)
FACTS = Facts(NONE, "Ann", "today", "page")


@pytest.fixture
def lesson() -> Lesson:
    lesson = Lesson(Dataset(), PLAN, FACTS)
    lesson.add_class("Peace")
    return lesson


def show(lesson: Lesson, seconds: float, hand: Hand | None = HAND) -> None:
    for _ in range(round(seconds * 20)):
        lesson.see(hand, NOTHING, {"Stop": 0.25}, 0.05)


def peace(lesson: Lesson) -> SignClass:
    return lesson.state.classes[0]


def numbers(lesson: Lesson) -> list[int]:
    return [each.number for each in peace(lesson).takes]


def labels(lesson: Lesson) -> list[str]:
    return [each.label for each in lesson.state.classes]


def recorded(lesson: Lesson) -> Lesson:
    lesson.record(peace(lesson).key)
    show(lesson, 6.0)
    return lesson


def taught(lesson: Lesson) -> Lesson:
    assert recorded(lesson).begin_training()
    lesson.learn(model(), REPORT)
    return lesson


def test_takes_are_recorded_one_after_the_other_each_after_a_countdown(lesson: Lesson) -> None:
    show(lesson, 2.0)
    assert peace(lesson).takes == (), "nothing is recorded before it is asked for"
    lesson.record(peace(lesson).key)
    show(lesson, 0.9)
    assert (lesson.state.status.phase, lesson.state.status.hands) == ("countdown", 0)
    show(lesson, 0.4)
    assert (lesson.state.status.phase, lesson.state.status.hands) == ("recording", 7)
    show(lesson, 6.0)
    assert (len(peace(lesson).takes), lesson.state.recorded, lesson.state.can_train) == (3, None, True)
    assert {len(each.take.hands) for each in peace(lesson).takes} <= {10, 11}
    assert {(each.take.label, each.take.person) for each in peace(lesson).takes} == {("Peace", "Ann")}
    lesson.record(peace(lesson).key)
    show(lesson, 3.0)
    assert len(peace(lesson).takes) == 4, "further ones come singly"


def test_a_take_lasts_while_a_button_is_held_but_not_for_long(lesson: Lesson) -> None:
    lesson.record(peace(lesson).key, hold=True)
    show(lesson, 0.7)
    assert lesson.state.is_held
    lesson.finish()
    assert (len(peace(lesson).takes), lesson.state.recorded) == (1, None)
    assert len(peace(lesson).takes[0].take.hands) == 14
    lesson.finish()
    lesson.record(peace(lesson).key, hold=True)
    show(lesson, 0.1)
    lesson.finish()
    assert (len(peace(lesson).takes), lesson.state.message) == (
        1,
        "Too few hands were seen: this take does not count.",
    )
    lesson.record(peace(lesson).key, hold=True)
    show(lesson, LONGEST_HOLD_S + 5.0)
    assert (len(peace(lesson).takes), lesson.state.recorded) == (2, None)


def test_a_pause_drops_the_take_that_is_under_way_only(lesson: Lesson) -> None:
    lesson.record(peace(lesson).key)
    show(lesson, 3.0)
    kept = numbers(lesson)
    assert kept
    lesson.pause()
    show(lesson, 3.0)
    assert (numbers(lesson), lesson.state.status.phase) == (kept, "ready")


def test_a_take_without_hands_is_done_again(lesson: Lesson) -> None:
    lesson.record(peace(lesson).key)
    show(lesson, 1.7, hand=None)
    assert lesson.state.message == "Too few hands were seen: this take does not count."
    show(lesson, 6.0)
    assert (len(numbers(lesson)), lesson.state.message) == (3, "")


def test_what_is_deleted_can_be_brought_back(lesson: Lesson) -> None:
    before = numbers(recorded(lesson))
    lesson.undo()
    lesson.delete_take(before[1])
    lesson.delete_take(999)
    assert (numbers(lesson), lesson.state.undo) == ([before[0], before[2]], "Undo: delete a take of Peace")
    lesson.record(peace(lesson).key, hold=True)
    show(lesson, 0.5)
    lesson.finish()
    lesson.delete_class(peace(lesson).key)
    assert (labels(lesson), lesson.state.undo) == ([NONE], "Undo: delete Peace")
    lesson.undo()
    assert len(numbers(lesson)) == 3
    lesson.undo()
    assert numbers(lesson)[:3] == before, "in their order"
    assert (len(numbers(lesson)), lesson.state.undo) == (4, "")


def test_a_deleted_sign_does_not_replace_one_of_the_same_name(lesson: Lesson) -> None:
    recorded(lesson)
    lesson.delete_class(peace(lesson).key)
    lesson.add_class("peace")
    lesson.undo()
    assert labels(lesson) == ["peace", NONE]
    assert "There is another sign Peace now" in lesson.state.message


def test_the_background_keeps_its_place_and_loses_only_its_takes() -> None:
    lesson = Lesson(Dataset((take("Hi", "Peace"), take(NONE, "Three"))), PLAN, FACTS)
    none = lesson.state.classes[-1]
    lesson.rename(none.key, "Three")
    lesson.enable(none.key, on=False)
    assert lesson.state.classes[-1] == none
    lesson.delete_class(none.key)
    assert (labels(lesson), lesson.state.classes[-1].takes) == (["Hi", NONE], ())
    lesson.undo()
    assert lesson.state.classes[-1] == none


def test_signs_are_renamed_and_left_out_with_their_takes(lesson: Lesson) -> None:
    key = peace(recorded(lesson)).key
    lesson.rename(key, " Victory ")
    lesson.enable(key, on=False)
    dataset = lesson.dataset()
    assert dataset.labels == ("Victory",)
    assert dataset.disabled == {"Victory"}
    assert not lesson.state.can_train
    lesson.rename(key, "Victory")
    lesson.rename(key, "victory")
    assert labels(lesson) == ["victory", NONE]


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("", "'' is not a valid name for a sign"),
        ("turn left", "Turn Left is known already: give the new sign a name of its own"),
        ("none", "NONE is known already"),
        ("background", "background is known already"),
        ("PEACE", "there is a sign Peace already"),
        ("x" * 41, "is not a valid name for a sign"),
        ("Hi\x07", "is not a valid name for a sign"),
    ],
)
def test_what_is_no_name_is_refused(lesson: Lesson, name: str, problem: str) -> None:
    with pytest.raises(DatasetError, match=problem):
        lesson.add_class(name)
    lesson.add_class("Other")
    with pytest.raises(DatasetError, match=problem):
        lesson.rename(lesson.state.classes[1].key, name)
    assert labels(lesson) == ["Peace", "Other", NONE]


def test_a_name_in_another_unicode_form_is_no_other_sign(lesson: Lesson) -> None:
    lesson.add_class("Cafe\u0301")
    with pytest.raises(DatasetError, match="there is a sign Caf\u00e9 already"):
        lesson.add_class("Caf\u00e9")
    with pytest.raises(DatasetError, match="Stop is known already"):
        lesson.add_class("\uff33\uff54\uff4f\uff50")
    assert labels(lesson) == ["Peace", "Caf\u00e9", NONE]


def test_nothing_changes_while_it_is_learnt_from(lesson: Lesson) -> None:
    assert lesson.begin_training() is None, "there is no take"
    classes = recorded(lesson).state.classes
    assert lesson.begin_training() is not None
    assert lesson.begin_training() is None
    key = peace(lesson).key
    lesson.delete_take(numbers(lesson)[0])
    lesson.delete_class(key)
    lesson.rename(key, "Other")
    lesson.enable(key, on=False)
    lesson.record(key)
    lesson.record(key, hold=True)
    lesson.undo()
    assert (lesson.state.classes, lesson.state.recorded) == (classes, None)


def test_a_result_is_fresh_until_a_take_changes(lesson: Lesson) -> None:
    lesson.learn(model(), REPORT)
    assert lesson.state.model is None, "nothing is learnt before the training"
    taught(lesson)
    assert (lesson.state.is_fresh, lesson.state.is_changed, lesson.state.report) == (True, True, REPORT)
    lesson.add_class("Empty")
    assert lesson.state.is_fresh
    lesson.mark_kept("Kept")
    lesson.begin_training()
    lesson.learn(model(), REPORT)
    assert lesson.state.is_changed, "the model is another one"
    lesson.mark_kept("Kept")
    assert (lesson.state.is_changed, lesson.state.message) == (False, "Kept")
    lesson.delete_take(numbers(lesson)[0])
    assert (lesson.state.is_fresh, lesson.state.is_changed) == (False, True)
    lesson.undo()
    assert (lesson.state.is_fresh, lesson.state.is_changed) == (True, False)


def test_a_training_that_fails_leaves_the_takes(lesson: Lesson) -> None:
    before = numbers(recorded(lesson))
    lesson.begin_training()
    lesson.advance(3, 12)
    assert lesson.state.progress == 0.25
    lesson.end_training("Peace looks like Stop")
    assert (lesson.state.is_training, lesson.state.message) == (False, "Peace looks like Stop")
    assert numbers(lesson) == before


def test_the_frame_is_shown_with_the_confidence_of_every_class(lesson: Lesson) -> None:
    show(lesson, 0.05)
    seen = lesson.state.seen
    assert seen is not None
    assert seen.confidences == {"Stop": 0.25, NONE: 0.75}
    lesson.see(None, NOTHING, {}, 0.05)
    assert (lesson.state.seen, lesson.state.hint) == (replace(seen, hand=False, confidences={}), NO_HAND)
    lesson.lose_frames()
    assert lesson.state.seen is None


def test_a_lesson_is_continued(lesson: Lesson) -> None:
    state = taught(lesson).state
    other = Lesson(Dataset(), PLAN, FACTS)
    other.restore(state)
    assert (other.state.classes, other.state.is_fresh, other.state.is_changed) == (state.classes, True, True)
    other.add_class("Call")
    recorded(other)
    keys = [one.key for one in other.state.classes]
    assert len(set(keys)) == len(keys)
    assert len(set(numbers(other))) == 4


def test_a_file_adds_its_takes_once(lesson: Lesson) -> None:
    recorded(lesson)
    file = Dataset((*lesson.dataset().takes, take("Call"), take("Stop"), take(NONE, "Three")))
    lesson.add_dataset(file, model())
    lesson.add_dataset(file, None)
    assert [(one.label, len(one.takes)) for one in lesson.state.classes] == [("Peace", 3), ("Call", 1), (NONE, 1)]
    assert lesson.state.model is None, "it was not learnt from what is here"
    assert "Stop" in lesson.dataset().labels, "an example of another hand"


def test_the_model_of_a_file_is_tried_where_nothing_else_is() -> None:
    lesson = Lesson(Dataset(), PLAN, FACTS)
    lesson.add_dataset(Dataset((take("Hi", "Peace"), take("Ho", "Call"))), model())
    assert (lesson.state.is_fresh, lesson.state.is_changed) == (True, True)
    with pytest.raises(DatasetError, match=f"more than {MOST_CLASSES} classes"):
        lesson.add_dataset(Dataset(tuple(take(f"Sign {number}", "Peace", hands=1) for number in range(20))), None)
    large = replace(take("Hi", "Peace", hands=1), hands=(HAND,) * MOST_HANDS)
    with pytest.raises(DatasetError, match=f"more than {MOST_HANDS} hands"):
        lesson.add_dataset(Dataset((large,)), None)


def test_there_is_an_end_to_takes_and_classes(lesson: Lesson) -> None:
    many = Lesson(Dataset(), TeachConfig(takes=50, take_time=0.2, countdown=0.0), FACTS)
    many.add_class("Peace")
    for _ in range(3):
        many.record(peace(many).key)
        show(many, 30.0)
    assert len(peace(many).takes) == MOST_TAKES
    for number in range(MOST_CLASSES - 2):
        lesson.add_class(f"Sign {number}")
    with pytest.raises(DatasetError, match="delete one first"):
        lesson.add_class("One more")


def test_signs_of_an_earlier_model_without_takes_would_be_lost() -> None:
    lesson = Lesson(Dataset((take("Hi", "Peace"),)), PLAN, FACTS, model())
    assert lesson.state.lost == ("Ho",)
    assert not lesson.state.is_fresh
    assert filled(lesson.state.classes) == lesson.state.classes[:1]


@pytest.mark.parametrize(
    ("hand", "guess", "expected"),
    [
        (None, NOTHING, NO_HAND),
        (show_sign("Peace", away_m=4.0), NOTHING, SMALL),
        (HAND, SignGuess("Stop", 0.9), "This looks like Stop, which is known already: show another shape."),
        (HAND, SignGuess("Peace", 0.9), STILL),
        (HAND, SignGuess("Stop", 0.6), STILL),
    ],
)
def test_hints(hand: Hand | None, guess: SignGuess, expected: str) -> None:
    assert hint(hand, guess, [HAND] * 20) == expected


def test_a_hand_that_turns_or_comes_nearer_is_not_still() -> None:
    assert hint(HAND, NOTHING, [HAND] * 5) == "", "a take has hardly begun"
    assert not is_still([show_sign("Peace", tilt=0.01 * step) for step in range(20)])
    assert not is_still([show_sign("Peace", away_m=0.6 + 0.01 * step) for step in range(20)])
    assert is_still([show_sign("Peace", tilt=0.001 * step) for step in range(20)])
