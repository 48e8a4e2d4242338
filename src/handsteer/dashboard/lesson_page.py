"""The page ``/teach``: teach a new sign, and let the running robot use it."""

import asyncio
from collections.abc import Callable
from typing import Final

from nicegui import ui

from handsteer.dashboard.camera_panel import CameraPanel
from handsteer.dashboard.elements import box, card, switch, text
from handsteer.dashboard.lesson import View
from handsteer.dashboard.lesson_node import LessonNode
from handsteer.dashboard.lesson_panels import CollectPanel, Countdown, KeptPanel, NamePanel, ResultPanel, TrainPanel
from handsteer.dashboard.lessons import Teaching
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import ASSETS_PATH, PICTURE_PATH, Page, PageContext
from handsteer.dashboard.state import PageState
from handsteer.errors import HandsteerError

_ELSEWHERE: Final = (
    "Signs are taught where the camera, the recognition and the page run together: handsteer run. "
    "Elsewhere use handsteer signs collect and handsteer signs train, then set signs.model of the recognition."
)
_STANDS: Final = "The robot stands until the lesson is over: keep the sign, or discard it, then press Reset."
_STEPS: Final = {"name": "Name", "collect": "Collect", "train": "Train", "try": "Try", "kept": "Keep"}


class TeachPage(Page):
    """Teaches a sign, if the graph can be accessed."""

    def __init__(self, served: PageContext) -> None:
        super().__init__(served, "/teach")
        ui.add_head_html(
            "".join(f'<link rel="stylesheet" href="{ASSETS_PATH}/{name}.css">' for name in ("drive", "teach"))
            + f'<script src="{ASSETS_PATH}/webcam.js" defer></script>'
        )
        self._lesson: _LessonCard | None = None
        if served.local.teaching is None:
            with card("Teach a sign", "lesson panel"):
                ui.label(_ELSEWHERE)
            return
        self._teaching = served.local.teaching
        self._camera = CameraPanel(PICTURE_PATH, served.local.cameras, self.client.id, self.use_own_camera)
        self._lesson = _LessonCard(self, self._teaching)
        self._countdown = Countdown(self._camera.stage)
        self.client.on_disconnect(self._pause)
        self.client.on_delete(self._lesson.end)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        if self._lesson is not None:
            self._camera.update(state)
            self._lesson.update()
            self._countdown.update(self._teaching.view(self.client.id))

    def _reset(self) -> None:
        if self._lesson is not None and self._teaching.lesson(self.client.id):
            self._lesson.say(_STANDS)
        else:
            super()._reset()

    def _pause(self) -> None:
        if lesson := self._teaching.lesson(self.client.id):
            lesson.pause()


class _LessonCard:
    """The lesson, step by step."""

    def __init__(self, page: Page, teaching: Teaching) -> None:
        self._page = page
        self._viewer = page.client.id
        self._teaching = teaching
        self._step = ""
        self._is_over = False
        self._kept = False
        with card("Teach a sign", "lesson panel"):
            with ui.element("ol").classes("steps"):
                self._marks = {step: _mark(name) for step, name in _STEPS.items()}
            self._title = text("title", "")
            self._trouble = text("trouble", "").props('role="alert"')
            self._name = NamePanel(self._begin)
            self._collect = CollectPanel(
                record=self._do(LessonNode.record),
                pause=self._do(LessonNode.pause),
                train=self._do(LessonNode.train),
                discard=self._discard,
                delete=self._delete,
            )
            self._train = TrainPanel(self._do(LessonNode.go_back))
            self._result = ResultPanel(
                teaching.actions(),
                action_of=teaching.action_of,
                keep=self._keep,
                more=self._do(LessonNode.go_back),
                discard=self._discard,
            )
            self._kept_panel = KeptPanel(self._again)
        self._said = ""
        ui.timer(0, self._load_known, once=True)

    def say(self, words: str) -> None:
        """Show an error message, or clear it."""
        self._said = words

    def update(self) -> None:
        """Show changes; ends the lesson if its viewer no longer drives."""
        lesson = self._teaching.lesson(self._viewer)
        if lesson is not None and not self._page.drives():
            self._teaching.end(self._viewer)
            self.say("Somebody else drives now: the lesson is over, and nothing of it was kept.")
            lesson = None
        if lesson is not None:
            lesson.attend()
        view = lesson.view if lesson is not None else None
        self._show_step(view)
        self._trouble.set_text(self._said or (view.trouble if view else "") or self._others(view))
        if view is None:
            return
        if view.step == "collect":
            self._collect.update(view)
        elif view.step == "train":
            self._train.update(view)
        else:
            self._result.update(view)

    def end(self) -> None:
        """End the lesson, because the page is left."""
        self._is_over = True
        self._teaching.end(self._viewer)

    def _show_step(self, view: View | None) -> None:
        step = view.step if view else "kept" if self._kept else "name"
        if step == self._step:
            return
        self._step = step
        elements = {
            "name": self._name.element,
            "collect": self._collect.element,
            "train": self._train.element,
            "try": self._result.element,
            "kept": self._kept_panel.element,
        }
        for name, element in elements.items():
            switch(element, "hidden", on=name != step)
            mark = self._marks[name]
            mark.props('aria-current="step"') if name == step else mark.props(remove="aria-current")
        self._title.set_text(view.label if view else "")
        if view is not None and view.step == "try":
            self._result.fill(view, self._teaching.lost())

    def _others(self, view: View | None) -> str:
        label = self._teaching.label
        return f"Somebody teaches {label} now." if view is None and label is not None else ""

    def _do(self, what: Callable[[LessonNode], None]) -> Callable[[], None]:
        """Return a handler that calls ``what`` with the lesson, if it is this viewer's."""

        def done() -> None:
            self.say("")
            if lesson := self._teaching.lesson(self._viewer):
                what(lesson)

        return done

    def _delete(self, number: int) -> None:
        self._do(lambda lesson: lesson.delete(number))()

    async def _begin(self, name: str, person: str) -> None:
        node = self._page.joined
        if node is None or not self._page.drives():
            self.say("Somebody else drives: ask to drive first, then teach.")
            return
        node.halt()
        self.say("")
        try:
            await asyncio.to_thread(self._teaching.begin, self._viewer, name, person)
        except HandsteerError as error:
            self.say(f"{error}.")
        if self._is_over:  # the page was left meanwhile
            self._teaching.end(self._viewer)

    async def _keep(self, action: str) -> None:
        self.say("")
        try:
            kept = await asyncio.to_thread(self._teaching.keep, self._viewer, action)
        except HandsteerError as error:
            self.say(f"{error}.")
            return
        if kept is not None:
            self._kept = True
            self._kept_panel.fill(kept)

    def _discard(self) -> None:
        self._teaching.end(self._viewer)
        self.say("The lesson is over, and nothing of it was kept. The robot stands until you press Reset.")

    async def _again(self) -> None:
        self._kept = False
        await self._load_known()

    async def _load_known(self) -> None:
        try:
            self._name.show_known(await asyncio.to_thread(self._teaching.known))
        except HandsteerError as error:
            self.say(f"{error}.")


def _mark(name: str) -> ui.element:
    with ui.element("li") as mark, box(""):
        ui.label(name)
    return mark
