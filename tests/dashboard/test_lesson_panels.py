"""What the page to teach on says, in words; and what it says where nothing can be taught."""

import dataclasses

import pytest

from handsteer.config import TeachConfig
from handsteer.dashboard.lesson import Collected, Lesson, LessonState, counted, instruction, outcome
from handsteer.recognition.recognizer import Recognition
from handsteer.training.custom.collect import Facts, Status
from handsteer.types import EFFECTS, NONE, Action
from tests.dashboard.served import Site
from tests.recognition.hands import show_sign
from tests.training.custom.takes import take

HAND = show_sign("Peace")


def does(sign: str) -> Action:
    return "turbo" if sign == "Peace" else "stop"


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (None, ("No picture", "")),
        (Recognition(NONE, NONE, 0.0, 0.0, None), ("No hand", "no hand is in view")),
        (Recognition(NONE, NONE, 0.0, 0.0, HAND), ("No sign", "show Peace")),
        (Recognition(NONE, "Peace", 0.934, 0.2, HAND), ("Peace, 93%", f"would mean: {EFFECTS['turbo']}")),
        (Recognition("Stop", "Stop", 1.0, 0.0, HAND), ("Stop, 100%", "would mean: stops")),
    ],
)
def test_what_a_hand_would_do(seen: Recognition | None, expected: tuple[str, str]) -> None:
    assert outcome(seen, "Peace", does) == expected


def state(takes: int, status: Status) -> LessonState:
    lesson = Lesson(Facts("Peace", "me", "today", "page"), TeachConfig(takes=2))
    for number in range(takes):
        lesson.add(take("Peace", hands=7, seed=number), b"")
    return dataclasses.replace(lesson.state, status=status)


def test_takes_are_counted() -> None:
    ready = Status("ready", 0.0, 0)
    assert [counted(state(takes, ready)) for takes in (0, 2, 3)] == [
        "0 of 2 takes, 0 hands",
        "2 of 2 takes, 14 hands",
        "3 takes, 21 hands",
    ]
    assert isinstance(state(1, ready).takes[0], Collected)


def test_the_large_letters_say_what_to_do_now() -> None:
    assert instruction(state(0, Status("countdown", 2.1, 0))) == ("3", "then show Peace")
    assert instruction(state(0, Status("recording", 1.0, 34))) == ("34", "hands: show Peace")


def test_where_the_graph_is_elsewhere_the_page_says_so(site: Site) -> None:
    answer = site.get("/teach")
    assert answer.status == 200
    assert b"handsteer signs collect" in answer.read()
