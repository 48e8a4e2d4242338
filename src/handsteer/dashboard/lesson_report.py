"""The report of a training: the recall of each sign, what was confused, and what was left out."""

from collections.abc import Sequence
from functools import partial
from typing import Final

from nicegui import ui

from handsteer.dashboard.elements import box, button, switch, tag, text
from handsteer.dashboard.lesson_panels import ViewerLesson
from handsteer.dashboard.lesson_state import LessonState, SignClass
from handsteer.dashboard.sign_pictures import draw_hand
from handsteer.training.custom.report import (
    CustomSignFigures,
    Mistake,
    TrainingReport,
    false_hands,
    how_it_was_tried,
    lookalike_words,
)
from handsteer.types import NONE

_MOST_MISTAKES: Final = 12
_LOW_RECALL: Final = 0.9


class ReportPanel:
    """How well the signs were learnt."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        self._shown: tuple[TrainingReport | None, tuple[SignClass, ...]] = (None, ())
        with ui.element("section").classes("card panel report hidden") as self.element:
            tag("h2", "", "How well it was learnt")
            self._content = box("figures")

    def update(self, state: LessonState) -> None:
        """Show the report of ``state``, if there is one."""
        switch(self.element, "hidden", on=state.report is None)
        if (state.report, state.classes) == self._shown:
            return
        self._shown = state.report, state.classes
        self._content.clear()
        if state.report is not None:
            with self._content:
                self._fill(state.report, state)

    def _fill(self, report: TrainingReport, state: LessonState) -> None:
        if not state.is_fresh:
            text("hint", "The takes have changed since: train again.")
        for left in report.left_out:
            text("hint", f"Left out: {left.why}.")
        with ui.element("ul").classes("recalls"):
            for sign in report.signs:
                _recall(sign)
        mistakes = [each for each in report.mistakes if self._hand(each, state)]
        if mistakes:
            tag("h3", "", "Hands that were not recognised")
            with ui.element("ul").classes("mistakes"):
                for each in mistakes[:_MOST_MISTAKES]:
                    self._mistake(each, state)
        for words in (*lookalike_words(report), f"{how_it_was_tried(report)}.", false_hands(report)):
            text("faint", words)
        with ui.element("details"):
            tag("summary", "", "Confusion matrix")
            _table(report)

    def _hand(self, mistake: Mistake, state: LessonState) -> str:
        """Return the drawing of a hand that was not recognised; empty if its take has been deleted."""
        number = state.take_numbers[mistake.take] if mistake.take < len(state.take_numbers) else 0
        takes = [each.take for one in state.classes for each in one.takes if each.number == number]
        return draw_hand(takes[0].hands[mistake.hand].pixels) if takes else ""

    def _mistake(self, mistake: Mistake, state: LessonState) -> None:
        number = state.take_numbers[mistake.take]
        with ui.element("li"):
            ui.html(self._hand(mistake, state), sanitize=False)
            text("", mistake_words(mistake))
            button(
                "Delete",
                partial(self._lesson.do, lambda of: of.delete_take(number)),
                f"Delete the take of {mistake.shown}",
            )


def mistake_words(mistake: Mistake) -> str:
    """Return what the hands of a take were mistaken for, in words."""
    counts = f"{mistake.hands.count} of {mistake.hands.of} hands"
    if mistake.seen == NONE:
        return f"{mistake.shown}: in this take, {counts} were not recognised"
    return f"{mistake.shown}: in this take, {counts} were recognised as {mistake.seen}"


def _recall(sign: CustomSignFigures) -> None:
    rate = sign.recall.rate if sign.recall is not None else None
    with ui.element("li"):
        tag("b", "", sign.summary.label)
        if rate is None or sign.recall is None:
            text("faint", "was not held out: only one person showed it")
            return
        with box("meter").props(f'role="meter" aria-valuenow={100 * rate:.0f}') as meter:
            box("low" if rate < _LOW_RECALL else "good").style(f"width: {100 * rate:.0f}%")
        meter.props["aria-label"] = f"Recall of {sign.summary.label}"
        text("faint", f"{rate:.0%} of {sign.recall.of} hands")


def _table(report: TrainingReport) -> None:
    labels, counts = report.confusion.labels, report.confusion.counts
    with box("scroll").props('tabindex=0 role="region" aria-label="Confusion matrix"'), ui.element("table"):
        tag("caption", "", "A row for each sign that was shown, a column for each that came out, in hands")
        with ui.element("thead"), ui.element("tr"):
            _heads("col", ["shown", *(_named(label) for label in labels)])
        with ui.element("tbody"):
            for row, label in enumerate(labels):
                if any(counts[row]):
                    _row(label, counts[row], row)


def _row(label: str, counts: Sequence[int], own: int) -> None:
    with ui.element("tr"):
        _heads("row", [_named(label)])
        for column, count in enumerate(counts):
            tag("td", "right" if column == own else "wrong" if count else "", str(count))


def _heads(scope: str, names: Sequence[str]) -> None:
    for name in names:
        tag("th", "", name).props(f"scope={scope}")


def _named(label: str) -> str:
    return "no sign" if label == NONE else label
