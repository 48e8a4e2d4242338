"""The page ``/teach``: teach new signs, and let the running robot use them."""

from typing import Final

from nicegui import ui

from handsteer.dashboard.camera import CameraPanel
from handsteer.dashboard.elements import box, card, switch, text
from handsteer.dashboard.lesson import Lesson
from handsteer.dashboard.lesson_cards import ClassCards
from handsteer.dashboard.lesson_panels import LessonPanel, StartPanel, ViewerLesson
from handsteer.dashboard.lesson_report import ReportPanel
from handsteer.dashboard.lesson_state import LessonState, instruction
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import Page, PageContext
from handsteer.dashboard.state import PageState

_ELSEWHERE: Final = (
    "Signs are taught where the camera, the recognition and the page run together: handsteer run. "
    "Elsewhere use handsteer signs collect and handsteer signs train, then set signs.model of the recognition."
)
_STANDS: Final = "The robot stands until the lesson is over: end it, then press Reset."
_LOST: Final = "Another viewer drives now: the lesson has ended. You can continue it when you drive again."


class LessonPage(Page):
    """Teaches signs, if the graph can be accessed."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/teach", "drive.css", "teach.css", "webcam.js", "teach.js")
        self._lesson: ViewerLesson | None = None
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
            with box("hidden workspace") as self._workspace:
                self._cards = ClassCards(lesson)
                self._panel = LessonPanel(lesson, self._cards.actions)
                self._panel.element.move(target_index=0)
                self._report = ReportPanel(lesson)
                self._report.element.move(target_index=1)
        ui.on("record", lambda event: lesson.hold(event.args))
        self.client.on_disconnect(lambda: lesson.do(Lesson.pause))
        self.client.on_delete(lesson.leave)

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
        switch(self._start.element, "hidden", on=taught is not None)
        self._countdown.update(taught.state if taught is not None else None)
        if taught is None:
            self._start.update()
            return
        taught.attend()
        for panel in (self._panel, self._cards, self._report):
            panel.update(taught.state)

    def _reset(self) -> None:
        if self._lesson is not None and self._lesson.node is not None:
            self._lesson.do(lambda lesson: lesson.say(_STANDS))
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
