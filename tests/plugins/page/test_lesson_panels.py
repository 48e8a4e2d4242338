"""What the page to teach on says, in words; and what it says where nothing can be taught."""

from typing import Any

import pytest
from nicegui import Client, events, ui

from handsteer.config import TeachConfig
from handsteer.errors import install_command
from handsteer.plugins.page import lesson_panels
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lesson_page import mistake_words
from handsteer.plugins.page.lesson_state import (
    ROWS_PER_S,
    UNDECIDED,
    Collected,
    LessonState,
    Seen,
    SignClass,
    counted,
    instruction,
    outcome,
    training_words,
)
from handsteer.plugins.teach.collect import Facts, Status
from handsteer.plugins.teach.dataset import Dataset
from handsteer.plugins.teach.effects import EFFECTS
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.report import Mistake
from handsteer.types import NONE, Action
from tests.plugins.page.served import Site
from tests.plugins.teach.takes import take


def does(sign: str) -> Action:
    return "turbo" if sign == "Peace" else "stop"


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (None, ("No picture", "no picture comes from the camera")),
        (Seen(hand=False), ("No hand", "the robot would stop: no hand is in view")),
        (Seen(hand=True), ("No sign", "the robot would stop: the hand shows none of the signs")),
        (Seen(True, "Peace", 0.79), ("No sign", "the robot would stop: the hand shows none of the signs")),
        (Seen(True, "Peace", 0.934), ("Peace, 93%", f"would mean: {EFFECTS['turbo']}")),
        (Seen(True, "Stop", 1.0), ("Stop, 100%", "would mean: stops")),
    ],
)
def test_what_a_hand_would_do(seen: Seen | None, expected: tuple[str, str]) -> None:
    assert outcome(seen, 0.8, does) == expected


def test_what_a_sign_without_an_action_does_is_asked() -> None:
    assert outcome(Seen(True, "Peace", 0.934), 0.8, lambda _: None) == ("Peace, 93%", UNDECIDED)


def test_takes_are_counted() -> None:
    def peace(count: int) -> SignClass:
        takes = tuple(take("Peace", hands=7, seed=number) for number in range(count))
        return Lesson(Dataset(takes), TeachConfig(), Facts(NONE, "me", "today", "page")).state.classes[0]

    assert [counted(peace(count)) for count in (0, 1, 3)] == ["No takes yet", "1 take, 7 hands", "3 takes, 21 hands"]


def test_the_large_letters_say_what_to_do_now() -> None:
    classes = (SignClass(1, "Peace"), SignClass(2, NONE))

    def state(key: int, status: Status) -> LessonState:
        return LessonState(classes, classes, recorded=key, status=status)

    assert instruction(state(1, Status("countdown", 2.1, 0))) == ("3", "then show Peace")
    assert instruction(state(1, Status("recording", 1.0, 34))) == ("34", "hands: show Peace")
    assert instruction(state(2, Status("recording", 1.0, 34))) == ("34", "hands: show anything else")


def test_a_mistake_is_described() -> None:
    assert mistake_words(Mistake(0, 0, "Peace", NONE, Share(3, 60)), 2, 1.23) == (
        "Peace, take 2: 3 of 60 hands were not recognised, such as this one, 1.2 s after its start"
    )
    assert "were recognised as Call, such" in mistake_words(Mistake(0, 0, "Peace", "Call", Share(3, 60)), 1, 0.0)


def test_training_tells_how_long_it_takes_and_how_far_it_is() -> None:
    taught = tuple(SignClass(key, f"Sign {key}", (Collected(key, take("Peace", hands=3)),)) for key in range(4))

    def words(count: int, **facts: Any) -> str:
        return training_words(LessonState((*taught[:count], SignClass(9, NONE)), (), **facts))

    assert words(0) == "", "there is nothing to learn from"
    assert (words(1), words(4)) == ("Training takes about 15 s here.", "Training takes about 20 s here.")
    assert words(1, rows_per_s=ROWS_PER_S / 4) == "Training takes about 50 s here.", "as the last one took"
    assert words(1, progress=0.0) == "Making hands of every shape"
    assert words(1, progress=0.34, left_s=7.2) == "Learning: 34%, about 8 s left"


def test_where_the_graph_is_elsewhere_the_page_says_so(site: Site) -> None:
    answer = site.get("/teach")
    assert answer.status == 200
    assert b"handsteer signs collect" in answer.read()
    for name in ("signs.npz", "takes.csv", "signs.onnx"):
        assert site.get(f"/lesson/{name}?viewer=x").status == 404


@pytest.mark.parametrize("is_installed", [True, False])
def test_without_its_package_the_export_as_onnx_says_what_to_install(
    is_installed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lesson_panels, "CAN_EXPORT", is_installed)
    said: list[str] = []
    with Client(ui.page("/lesson-of-tests")):
        shown = lesson_panels._onnx("viewer=x", said.append)
    assert shown.props.get("href", "").endswith("signs.onnx?viewer=x") == is_installed
    assert (shown.props.get("aria-disabled") == "true") == (not is_installed)
    for listener in shown._event_listeners.values():
        events.handle_event(
            listener.handler, events.GenericEventArguments(sender=shown, client=shown.client, args=None)
        )
    words = f"For ONNX, run {install_command('onnx')} and start handsteer again"
    assert said == ([] if is_installed else [words])
    assert shown.props.get("title", "") == ("" if is_installed else words)
