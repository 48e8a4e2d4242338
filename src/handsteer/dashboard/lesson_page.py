"""The page ``/teach``: teach a new sign, and let the running robot use it."""

from typing import Final

from nicegui import ui

from handsteer.dashboard.camera import CameraPanel
from handsteer.dashboard.lesson import LessonState, instruction
from handsteer.dashboard.lesson_panels import (
    CollectPanel,
    LearntPanel,
    NamePanel,
    ResultPanel,
    TrainPanel,
    ViewerLesson,
)
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import Page, PageContext, box, card, switch, text
from handsteer.dashboard.state import PageState

_ELSEWHERE: Final = (
    "Signs are taught where the camera, the recognition and the page run together: handsteer run. "
    "Elsewhere use handsteer signs collect and handsteer signs train, then set signs.model of the recognition."
)
_STANDS: Final = "The robot stands until the lesson is over: keep the sign, or discard it, then press Reset."
_LOST: Final = "Another viewer drives now: the lesson has ended, and nothing was saved."
_STEPS: Final = {"name": "Name", "collect": "Collect", "train": "Train", "try": "Try", "kept": "Keep"}


class LessonPage(Page):
    """Teaches a sign, if the graph can be accessed."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/teach", "drive.css", "teach.css", "webcam.js")
        self._lesson: ViewerLesson | None = None
        if context.lessons is None:
            with card("Teach a sign", "lesson panel"):
                ui.label(_ELSEWHERE)
            return
        self._lesson = lesson = ViewerLesson(self, context.lessons)
        self._camera = CameraPanel(self, context.graph)
        self._card = _LessonCard(lesson)
        self._countdown = _Countdown(self._camera.stage)
        self.client.on_disconnect(self._pause)
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
        self._card.update()
        self._countdown.update(lesson.node.state if lesson.node else None)

    def _reset(self) -> None:
        if self._lesson is not None and self._lesson.node is not None:
            self._lesson.message = _STANDS
        else:
            super()._reset()

    def _pause(self) -> None:
        if self._lesson is not None and (node := self._lesson.node):
            node.pause()


class _LessonCard:
    """The lesson, step by step."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        self._step = ""
        with card("Teach a sign", "lesson panel"):
            with ui.element("ol").classes("steps"):
                self._marks = {step: _mark(name) for step, name in _STEPS.items()}
            self._title = text("title", "")
            self._message = text("trouble", "").props('role="alert"')
            self._name = NamePanel(lesson)
            self._collect = CollectPanel(lesson)
            self._train = TrainPanel(lesson)
            self._result = ResultPanel(lesson)
            self._learnt = LearntPanel(self._again)
        self._elements = {
            "name": self._name.element,
            "collect": self._collect.element,
            "train": self._train.element,
            "try": self._result.element,
            "kept": self._learnt.element,
        }
        ui.timer(0, self._name.fill, once=True)

    def update(self) -> None:
        """Show changes."""
        node = self._lesson.node
        if node is not None:
            node.attend()
        state = node.state if node is not None else None
        step = state.step if state else "kept" if self._lesson.learnt else "name"
        if step != self._step:
            self._show_step(step)
            self._title.set_text(state.label if state else "")
            if state is not None and step == "try":
                self._result.fill(state)
        self._message.set_text(self._lesson.message or (state.error if state else self._others()))
        if state is None:
            return
        if state.step == "collect":
            self._collect.update(state)
        elif state.step == "train":
            self._train.update(state)
        else:
            self._result.update(state)

    def _show_step(self, step: str) -> None:
        self._step = step
        for name, element in self._elements.items():
            switch(element, "hidden", on=name != step)
            self._marks[name].props(
                'aria-current="step"' if name == step else "", remove="aria-current" if name != step else ""
            )
        if step == "kept" and self._lesson.learnt is not None:
            self._learnt.fill(self._lesson.learnt)

    def _others(self) -> str:
        label = self._lesson.lessons.label
        return f"Somebody teaches {label} now." if label is not None else ""

    async def _again(self) -> None:
        self._lesson.learnt = None
        await self._name.fill()


class _Countdown:
    """The current instruction in large letters on the camera's picture, readable from a distance."""

    def __init__(self, stage: ui.element) -> None:
        self._stage = stage
        with stage, box("countdown hidden") as self._box:
            self._number = text("number", "")
            self._words = text("words", "")

    def update(self, state: LessonState | None) -> None:
        """Show ``state``."""
        switch(self._box, "hidden", on=state is None or not state.recording)
        switch(self._stage, "recording", on=state is not None and state.status.phase == "recording")
        if state is not None and state.recording:
            number, words = instruction(state)
            self._number.set_text(number)
            self._words.set_text(words)


def _mark(name: str) -> ui.element:
    with ui.element("li") as mark, box(""):
        ui.label(name)
    return mark
