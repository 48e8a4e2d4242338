"""The lesson, from step to step, with hands that are made."""

import pytest

from handsteer.config import TeachConfig
from handsteer.dashboard.lesson import MOST_TAKES, NO_HAND, SMALL, STILL, Lesson, hint, is_still
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.recognizer import Recognition
from handsteer.training.custom.collect import Facts
from handsteer.types import NONE
from tests.dashboard.lessons import REPORT
from tests.recognition.hands import show_sign
from tests.recognition.models import model

NOTHING = SignGuess(NONE, 0.0)
HAND = show_sign("Peace")
PLAN = TeachConfig(takes=3, take_time=0.5, countdown=1.0)


@pytest.fixture
def lesson() -> Lesson:
    return Lesson(Facts("Peace", "me", "today", "page"), PLAN)


def show(lesson: Lesson, seconds: float, hand: Hand | None = HAND) -> None:
    for _ in range(round(seconds * 20)):
        status = lesson.see(hand, NOTHING, 0.05)
        if status.finished is not None:
            lesson.add(status.finished, b"jpeg")


def numbers(lesson: Lesson) -> list[int]:
    return [each.number for each in lesson.state.takes]


def taught(lesson: Lesson) -> Lesson:
    lesson.record()
    show(lesson, 6.0)
    assert lesson.begin_training()
    lesson.learn(model(), REPORT)
    return lesson


def test_takes_are_collected_one_after_the_other_each_after_a_countdown(lesson: Lesson) -> None:
    show(lesson, 2.0)
    assert (lesson.state.takes, lesson.state.recording) == ((), False), "nothing is recorded before it is asked for"
    lesson.record()
    show(lesson, 0.9)
    assert (lesson.state.status.phase, lesson.state.status.hands) == ("countdown", 0)
    show(lesson, 0.4)
    assert (lesson.state.status.phase, lesson.state.status.hands) == ("recording", 7)
    show(lesson, 6.0)
    assert (numbers(lesson), lesson.state.recording, lesson.state.can_train) == ([1, 2, 3], False, True)
    assert {len(each.take.hands) for each in lesson.state.takes} <= {10, 11}
    lesson.record()
    show(lesson, 3.0)
    assert numbers(lesson) == [1, 2, 3, 4], "further ones come singly"


def test_a_take_that_is_deleted_is_collected_again(lesson: Lesson) -> None:
    lesson.record()
    show(lesson, 1.8)
    lesson.delete(1)
    lesson.delete(7)
    show(lesson, 6.0)
    assert numbers(lesson) == [2, 3, 4]
    lesson.delete(3)
    assert numbers(lesson) == [2, 4]
    lesson.record()
    show(lesson, 3.0)
    assert numbers(lesson) == [2, 4, 5]


def test_a_pause_drops_the_take_that_is_under_way_only(lesson: Lesson) -> None:
    lesson.record()
    show(lesson, 3.0)
    kept = numbers(lesson)
    lesson.pause()
    show(lesson, 3.0)
    assert (numbers(lesson), lesson.state.status.phase) == (kept, "ready")


def test_a_take_without_hands_is_done_again(lesson: Lesson) -> None:
    lesson.record()
    show(lesson, 1.7, hand=None)
    assert lesson.state.error == "Too few hands were seen: this take is done again."
    show(lesson, 6.0)
    assert (numbers(lesson), lesson.state.error) == ([1, 2, 3], "")


def test_it_is_not_trained_from_too_little_or_while_takes_are_under_way(lesson: Lesson) -> None:
    assert not lesson.begin_training()
    lesson.record()
    show(lesson, 4.0)
    assert len(lesson.state.takes) == 2
    assert not lesson.begin_training()
    lesson.pause()
    assert lesson.begin_training()
    assert not lesson.begin_training()
    lesson.delete(1)
    lesson.record()
    show(lesson, 3.0)
    assert (len(lesson.state.takes), lesson.state.recording) == (2, False), "nothing changes while it is learnt from"


def test_what_was_learnt_is_tried_and_more_can_be_collected(lesson: Lesson) -> None:
    lesson.learn(model(), REPORT)
    assert lesson.state.step == "collect", "nothing is learnt before the training"
    taught(lesson)
    assert (lesson.state.step, lesson.state.report) == ("try", REPORT)
    lesson.try_out(Recognition("Hi", "Hi", 0.9, 1.0, HAND))
    assert lesson.state.seen is not None
    lesson.go_back()
    assert (lesson.state.step, lesson.state.model, lesson.state.report, len(lesson.state.takes)) == (
        "collect",
        None,
        None,
        3,
    )


def test_a_training_that_fails_leaves_the_takes(lesson: Lesson) -> None:
    lesson.record()
    show(lesson, 6.0)
    lesson.begin_training()
    lesson.advance(3, 12)
    assert lesson.state.progress == 0.25
    lesson.go_back("Peace looks like Stop")
    assert (lesson.state.step, lesson.state.error, numbers(lesson)) == ("collect", "Peace looks like Stop", [1, 2, 3])


def test_there_is_an_end_to_the_takes() -> None:
    lesson = Lesson(Facts("Peace", "me", "today", "page"), TeachConfig(takes=50, take_time=0.5, countdown=0.0))
    for _ in range(3):
        lesson.record()
        show(lesson, 60.0)
    assert len(lesson.state.takes) == MOST_TAKES


@pytest.mark.parametrize(
    ("hand", "guess", "expected"),
    [
        (None, NOTHING, NO_HAND),
        (show_sign("Peace", away_m=4.0), NOTHING, SMALL),
        (HAND, SignGuess("Stop", 0.9), "This looks like Stop, which is known already: show another shape."),
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
