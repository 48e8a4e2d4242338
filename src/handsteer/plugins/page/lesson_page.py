"""The page ``/teach``: teach new signs, see how well they were learnt, and let the running robot use them."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Final

from nicegui import ui

from handsteer.plugins.page.calibration_panel import CalibrationPanel
from handsteer.plugins.page.camera import CameraPanel
from handsteer.plugins.page.elements import box, button, card, switch, tag, text
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lesson_cards import ClassCards
from handsteer.plugins.page.lesson_panels import LessonPanel, StartPanel, ViewerLesson
from handsteer.plugins.page.lesson_state import LessonState, SignClass, instruction
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page, PageContext
from handsteer.plugins.page.sign_pictures import draw_joints
from handsteer.plugins.page.state import PageState
from handsteer.plugins.teach.dataset import Take
from handsteer.plugins.teach.report import (
    CustomSignFigures,
    Mistake,
    TrainingReport,
    false_hands,
    how_it_was_tried,
    lookalike_words,
)
from handsteer.types import NONE

_ELSEWHERE: Final = (
    "Signs are taught where the camera, the recognition and the page run together: handsteer run. "
    "Elsewhere use handsteer signs collect and handsteer signs train, then set signs.model of the recognition."
)
_STANDS: Final = "The robot stands until the lesson is over: end it, then press Reset."
_LOST: Final = "Another viewer drives now: the lesson has ended. You can continue it when you drive again."
_LOST_CALIBRATION: Final = "Another viewer drives now: the calibration has ended."


class LessonPage(Page):
    """Teaches signs, if the graph can be accessed."""

    title = "Teach"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/teach", "drive.css", "teach.css", "teach.js")
        self._lesson: ViewerLesson | None = None
        self._shown: object = None
        self._calibration: CalibrationPanel | None = None
        if context.lessons is None:
            with card("Teach", "lesson panel"):
                ui.label(_ELSEWHERE)
            return
        self._lesson = lesson = ViewerLesson(self, context.lessons)
        with box("watch"):
            self._camera = CameraPanel(self, context.graph)
        self._countdown = _Countdown(self._camera.stage)
        with box("lesson"):
            self._start = StartPanel(lesson, context.settings)
            self._calibration = CalibrationPanel(self, context.calibrations) if context.calibrations else None
            with box("hidden workspace") as self._workspace:
                self._cards = ClassCards(lesson)
                self._panel = LessonPanel(lesson, self._cards.actions)
                self._panel.element.move(target_index=0)
                self._report = ReportPanel(lesson)
                self._report.element.move(target_index=1)
        ui.on("record", lambda event: lesson.hold(event.args))
        self.client.on_disconnect(lambda: lesson.do(Lesson.pause))
        self.client.on_delete(lesson.leave)
        if self._calibration is not None:
            self.client.on_delete(self._calibration.leave)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes; ends the lesson if its viewer no longer drives."""
        super().show(node, state)
        lesson = self._lesson
        if lesson is None:
            return
        self._camera.update(state)
        if lesson.node is not None and not self.drives():
            lesson.end(_LOST)
        taught = lesson.node
        switch(self._workspace, "hidden", on=taught is None)
        is_calibrating = self._calibrate(is_teaching=taught is not None)
        switch(self._start.element, "hidden", on=taught is not None or is_calibrating)
        self._countdown.update(taught.state if taught is not None else None)
        if taught is None:
            self._start.update()
            return
        taught.attend()
        if taught is not self._shown:
            self._cards.clear()
            self._shown = taught
        for panel in (self._panel, self._cards, self._report):
            panel.update(taught.state)

    def _calibrate(self, *, is_teaching: bool) -> bool:
        """Show the calibration, unless a sign is taught; return whether one is running. It ends with the lease."""
        panel = self._calibration
        if panel is None:
            return False
        if panel.node is not None and not self.drives():
            panel.end(_LOST_CALIBRATION)
        switch(panel.element, "hidden", on=is_teaching)
        panel.update()
        return panel.node is not None

    def _reset(self) -> None:
        if self._lesson is not None and self._lesson.node is not None:
            self._lesson.do(lambda lesson: lesson.say(_STANDS))
        elif self._calibration is not None and self._calibration.node is not None:
            self._calibration.node.say(_STANDS)
        else:
            super()._reset()


class _Countdown:
    """The current instruction in large letters on the camera's picture, readable from a distance."""

    def __init__(self, stage: ui.element) -> None:
        self._stage = stage
        with stage, box("countdown hidden") as self._box:
            self._number = text("number", "")
            self._words = text("words", "")

    def update(self, state: LessonState | None) -> None:
        """Show ``state``."""
        switch(self._box, "hidden", on=state is None or state.recorded is None)
        switch(self._stage, "recording", on=state is not None and state.status.phase == "recording")
        if state is not None and state.recorded is not None:
            number, words = instruction(state)
            self._number.set_text(number)
            self._words.set_text(words)


_MOST_MISTAKES: Final = 12
_STRIP: Final = 6
"""Maximum number of hands by which a take is shown."""
_LOW_RECALL: Final = 0.9
_CAPTION: Final = (
    "A row for each sign that was shown, a column for each that came out. A hand counts twice, as it is and mirrored, "
    "unless its sign points to a side."
)


class ReportPanel:
    """How well the signs were learnt."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        self._shown: tuple[TrainingReport | None, tuple[SignClass, ...]] = (None, ())
        with card("How well it was learnt", "panel report hidden") as self.element:
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
        mistakes = [(each, *found) for each in report.mistakes if (found := _take_of(each, state))]
        if mistakes:
            tag("h3", "", "Hands that were not recognised")
            text("faint", "Large: such a hand, as you see it in a mirror. Small: the whole take, from start to end.")
            with ui.element("ul").classes("mistakes"):
                for mistake in mistakes[:_MOST_MISTAKES]:
                    self._mistake(*mistake)
        for words in (*lookalike_words(report), f"{how_it_was_tried(report)}.", false_hands(report)):
            text("faint", words)
        with ui.element("details"):
            tag("summary", "", "Confusion matrix")
            _table(report)

    def _mistake(self, mistake: Mistake, number: int, place: int, take: Take) -> None:
        with ui.element("li"):
            with box("shown"):
                ui.html(draw_joints(take.hands[mistake.hand].pixels), sanitize=False)
                with box("strip"):
                    for hand in take.hands[:: math.ceil(len(take.hands) / _STRIP)]:
                        ui.html(draw_joints(hand.pixels), sanitize=False)
            text("", mistake_words(mistake, place, take.times_s[mistake.hand] - take.times_s[0]))
            button(
                "Delete",
                partial(self._lesson.do, lambda of: of.delete_take(number)),
                f"Delete the take of {mistake.shown}",
            )


def _take_of(mistake: Mistake, state: LessonState) -> tuple[int, int, Take] | None:
    """Return the number, place in its class from 1, and take of a mistake; None if it has been deleted."""
    number = state.take_numbers[mistake.take] if mistake.take < len(state.take_numbers) else 0
    found = (
        (number, place, each.take)
        for one in state.classes
        for place, each in enumerate(one.takes, 1)
        if each.number == number
    )
    return next(found, None)


def mistake_words(mistake: Mistake, place: int, at_s: float) -> str:
    """Return what the hands of the take at ``place`` were mistaken for, such as the hand ``at_s`` from its start."""
    counts = f"{mistake.hands.count} of {mistake.hands.of} hands"
    seen = "not recognised" if mistake.seen == NONE else f"recognised as {mistake.seen}"
    return f"{mistake.shown}, take {place}: {counts} were {seen}, such as this one, {at_s:.1f} s after its start"


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
        text("faint", f"{rate:.0%} of {sign.hands_tried} hands")


def _table(report: TrainingReport) -> None:
    labels, counts = report.confusion.labels, report.confusion.counts
    with box("scroll").props('tabindex=0 role="region" aria-label="Confusion matrix"'), ui.element("table"):
        tag("caption", "", _CAPTION)
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
