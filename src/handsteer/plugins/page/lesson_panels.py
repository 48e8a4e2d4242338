"""The panels of the page ``/teach`` in addition to its cards: the start, the tools, and what happens at every start."""

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, TypeVar

from nicegui import ui

from handsteer.errors import HandsteerError, install_command
from handsteer.plugins.page.elements import box, button, card, sentence, set_property, switch, text
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lesson_files import CAN_EXPORT, LESSON_PATH
from handsteer.plugins.page.lesson_node import LessonNode
from handsteer.plugins.page.lesson_state import LessonState, outcome, training_words
from handsteer.plugins.page.lessons import Lessons, person_named
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import FIELDS
from handsteer.plugins.page.sign_pictures import DRAWN, taught_drawings
from handsteer.recognition.custom_signs import load_custom_model
from handsteer.types import SIGNS, Action, find_sign

T = TypeVar("T")

_NOT_DRIVING: Final = "Another viewer drives: ask to drive first, then teach."
_UNKEPT: Final = "The lesson is over. What was not kept is still here, until the next lesson begins or handsteer ends."
_OVER: Final = "The lesson is over. Press Reset to drive."
_LONGEST: Final = 200


class ViewerLesson:
    """The lesson of a page's viewer.

    While there is none, ``message`` is an error, or what has happened; empty if nothing.
    """

    def __init__(self, page: Page, lessons: Lessons) -> None:
        self.lessons = lessons
        self.viewer = page.client.id
        self.message = ""
        self._page = page
        self._is_over = False

    @property
    def node(self) -> LessonNode | None:
        """The lesson, if there is one."""
        return self.lessons.node(self.viewer)

    def do(self, action: Callable[[Lesson], object]) -> str:
        """Call ``action`` with the lesson, if there is one; show and return an error message, empty if none."""
        node = self.node
        if node is None:
            return ""
        try:
            node.do(action)
        except HandsteerError as error:
            words = f"{error}."
            node.do(lambda lesson: lesson.say(words))
            return words
        return ""

    def hold(self, sent: object) -> None:
        """Record a take while a button is held, as the browser reports."""
        key = sent.get("key") if isinstance(sent, dict) else None
        if not isinstance(sent, dict) or not isinstance(key, int):
            return
        if sent.get("held") is True:
            self.do(lambda lesson: lesson.record(key, hold=True))
        else:
            self.do(Lesson.finish)

    async def begin(self, person: str, *, restore: bool) -> None:
        """Stop the robot, and begin a lesson if the viewer drives."""
        node = self._page.node
        if node is None or not self.may_change():
            return
        if await self.run(lambda: person_named(person)):
            return
        node.halt(self.viewer, "the lesson")
        await self.run(lambda: self.lessons.begin(self.viewer, person, restore=restore))
        if self._is_over:  # the viewer has left the page
            self.lessons.end(self.viewer)

    async def save(self, actions: Mapping[str, str]) -> bool:
        """Keep the takes and the model, with these actions; return whether they are kept."""
        error = await self.run(lambda: self.lessons.save(self.viewer, actions))
        if error:
            self.do(lambda lesson: lesson.say(sentence(error)))
        return not error

    async def drive_with(self, actions: Mapping[str, str]) -> None:
        """Keep the takes and the model, end the lesson, and show the page that the robot is driven on."""
        if await self.save(actions):
            self.end()
            ui.navigate.to("/")

    def may_change(self) -> bool:
        """Return whether the viewer drives; show why not."""
        drives = self._page.drives()
        self.message = "" if drives else _NOT_DRIVING
        return drives

    def end(self, why: str = "") -> None:
        """End the lesson, and show ``why``."""
        self.lessons.end(self.viewer)
        self.message = why or (_OVER if self.lessons.draft is None else _UNKEPT)

    def leave(self) -> None:
        """End the lesson, because the page is left."""
        self._is_over = True
        self.lessons.end(self.viewer)

    async def run(self, action: Callable[[], object]) -> str:
        """Call ``action``, which reads or writes files; show and return an error message, empty if none."""
        try:
            await asyncio.to_thread(action)
        except HandsteerError as error:
            self.message = f"{error}."
        else:
            self.message = ""
        return self.message


class StartPanel:
    """Begins a lesson; shows the signs that have been taught."""

    def __init__(self, lesson: ViewerLesson, settings: Settings | None) -> None:
        self._lesson = lesson
        self._shown: object = None
        with card("Teach your own signs", "panel start") as self.element:
            text(
                "lead",
                "Show a sign to the camera a few times, train on these takes, and choose what the robot does.",
            )
            self._taught = box("taught")
            self._message = text("trouble", "").props('role="alert"')
            self._person = ui.input("Who shows the signs", value="me").props("outlined dense maxlength=40")
            with box("buttons"):
                button("Start a lesson", lambda: self._begin(restore=False)).classes("primary")
                self._restore = button("Continue the last lesson", lambda: self._begin(restore=True))
            text("faint", "The robot is stopped during a lesson. Only landmarks are recorded, no pictures.")
            self._always = AlwaysPanel(lesson, settings) if settings is not None else None

    def update(self) -> None:
        """Show changes."""
        lessons = self._lesson.lessons
        others = "Another viewer teaches now." if lessons.is_running else ""
        self._message.set_text(self._lesson.message or others)
        switch(self._restore, "hidden", on=lessons.draft is None)
        if self._always is not None:
            self._always.update()
        shown = lessons.signs.model, lessons.is_running
        if shown != self._shown:
            self._shown = shown
            self._taught.clear()
            with self._taught:
                shipped = {sign: drawing for sign, (_, drawing) in DRAWN.items()}
                for sign, drawing in (shipped | dict(taught_drawings(lessons.signs))).items():
                    with box("tile"):
                        ui.html(drawing, sanitize=False)
                        text("name", sign)

    async def _begin(self, *, restore: bool) -> None:
        await self._lesson.begin(str(self._person.value or "")[:_LONGEST], restore=restore)


_MODEL, _ACTIONS = FIELDS["signs.model"], FIELDS["control.actions"]


class AlwaysPanel:
    """Writes the taught signs in use to the configuration file, or removes them from it."""

    def __init__(self, lesson: ViewerLesson, settings: Settings) -> None:
        self._lesson, self._settings = lesson, settings
        self._shown: object = None
        with box("always") as self._box:
            self._words = text("", "").props('role="status"')
            self._use = button("Use at every start", lambda: self._change(self._keep))
            self._drop = button("No longer use at every start", lambda: self._change(self._remove))

    def update(self) -> None:
        """Show whether the next start uses the signs, if any are in use."""
        running = self._settings.running
        shown = running.signs.model, running.control.actions, self._settings.revision
        if shown != self._shown:
            self._shown = shown
            self._show(running.signs.model, running.control.actions)

    def _show(self, running: Path | None, actions: Mapping[str, Action]) -> None:
        file = self._settings.file
        try:
            kept, kept_actions = self._settings.in_file(_MODEL), self._settings.in_file(_ACTIONS)
        except HandsteerError as error:
            kept, kept_actions = None, {}
            self._lesson.message = f"{error}."
        names = kept is not None and (running is None or _full(kept) == _full(running))
        is_kept = running is not None and names and kept_actions == actions
        if is_kept:
            words = f"These signs are in {file.path}. Use them at every start by: {file.start_command}"
        elif running is None:
            words = f"{file.path} names taught signs that are not in use: {kept}"
        elif names:
            words = f"{file.path} has other actions for these signs, or other names."
        else:
            words = "These signs are in use until handsteer ends."
        self._words.set_text(words)
        switch(self._box, "hidden", on=running is None and not names)
        switch(self._use, "hidden", on=running is None or is_kept)
        switch(self._drop, "hidden", on=not names)

    async def _change(self, change: Callable[[], object]) -> None:
        if self._lesson.may_change():
            await self._lesson.run(change)
            self._shown = None

    def _keep(self) -> None:
        running = self._settings.running
        if running.signs.model is not None:
            self._settings.keep({_MODEL: _full(running.signs.model), _ACTIONS: running.control.actions})

    def _remove(self) -> None:
        model = self._settings.running.signs.model
        taught = load_custom_model(model.expanduser()).labels if model is not None else ()
        actions: Mapping[str, Action] = self._settings.in_file(_ACTIONS)
        others = {sign: action for sign, action in actions.items() if find_sign(sign, taught) is None}
        self._settings.keep({_MODEL: None, _ACTIONS: others})


def _full(path: Path) -> Path:
    return path.expanduser().absolute()


class LessonPanel:
    """What the hand is recognised as, and the tools: train, keep, undo, files, the end.

    ``actions`` returns the action that is selected for each sign.
    """

    def __init__(self, lesson: ViewerLesson, actions: Callable[[], Mapping[str, str]]) -> None:
        self._lesson, self._actions = lesson, actions
        with ui.element("section").classes("card panel tools") as self.element:
            with box("opinion"):
                self._sign = text("sign", "")
                self._effect = text("effect", "")
            with box("buttons"):
                self._train = button("Train", self._begin_training).classes("primary")
                self._keep = button("Keep", lambda: lesson.save(actions()))
                self._drive = button("Keep and drive", lambda: lesson.drive_with(actions()))
                self._undo = button("Undo", lambda: lesson.do(Lesson.undo))
                with box("files"):
                    viewer = f"viewer={lesson.viewer}"
                    _download("Download", f"{LESSON_PATH}/signs.npz?{viewer}", "Download takes and model as one file")
                    _download("CSV", f"{LESSON_PATH}/takes.csv?{viewer}", "Download the takes as a table, CSV")
                    self._onnx = _onnx(viewer, lambda words: lesson.do(lambda of: of.say(words)))
                    button("Upload", label="Upload a file of taught signs").props("data-choose")
                    file = ui.element("input").props(
                        f'type=file accept=".npz" data-upload="{LESSON_PATH}/signs?{viewer}"'
                    )
                    file.classes("hidden").props('aria-label="File of taught signs"')
                button("End the lesson", lesson.end).classes("end")
            with box("training hidden") as self._training:
                with box("meter progress").props('role="progressbar" aria-label="Training"') as self._meter:
                    self._fill = box("")
                button("Cancel", self._cancel, "Cancel the training")
            self._effort = text("faint", "").props('role="status"')
            self._hint = text("hint", "").props('role="status"')
            self._message = text("message", "").props('role="alert"')
            self._lost = text("trouble", "")

    def update(self, state: LessonState) -> None:
        """Show ``state``."""
        sign, effect = outcome(state.seen, self._lesson.lessons.signs.min_confidence, self._action_of)
        self._sign.set_text(sign)
        self._effect.set_text(effect)
        is_idle = state.recorded is None and not state.is_training
        set_property(self._train, "disabled", not state.can_train)
        set_property(self._keep, "disabled", not is_idle)
        to_keep = state.is_fresh and state.is_changed
        switch(self._train, "primary", on=not to_keep)
        switch(self._drive, "primary", on=to_keep)
        switch(self._drive, "hidden", on=not to_keep)
        set_property(self._drive, "disabled", not is_idle)
        switch(self._onnx, "hidden", on=state.model is None)
        set_words(self._undo, state.undo)
        switch(self._undo, "hidden", on=not state.undo or not is_idle)
        self._hint.set_text("" if state.is_training else state.hint)
        self._message.set_text(state.message)
        lost = ", ".join(state.lost)
        self._lost.set_text(f"There are no takes of {lost}: training would lose what was learnt of it." if lost else "")
        switch(self._training, "hidden", on=not state.is_training)
        percent = round(100 * (state.progress or 0.0))
        self._effort.set_text(training_words(state))
        self._fill.style(f"width: {percent}%")
        self._meter.props(f"aria-valuenow={percent}")

    def _action_of(self, sign: str) -> Action | None:
        """Return the action of a shipped sign, or that which is selected for a sign of this lesson."""
        if sign in SIGNS:
            return self._lesson.lessons.action_of(sign)
        chosen = self._actions().get(sign)
        return next((each for each in self._lesson.lessons.actions() if each == chosen), None)

    def _begin_training(self) -> None:
        if node := self._lesson.node:
            node.train()

    def _cancel(self) -> None:
        if node := self._lesson.node:
            node.cancel()


def set_words(element: ui.element, words: str) -> None:
    """Set the words of a button."""
    label = element.default_slot.children[0]
    if isinstance(label, ui.label):
        label.set_text(words)


def _onnx(viewer: str, say: Callable[[str], object]) -> ui.element:
    """Return the download as ONNX; a button that only says what to install, by ``say``, if its package is missing."""
    if CAN_EXPORT:
        return _download("ONNX", f"{LESSON_PATH}/signs.onnx?{viewer}", "Download the model as ONNX")
    words = f"For ONNX, run {install_command('onnx')} and start handsteer again"
    # Not disabled, which would hide the words from those who touch, or use the keyboard.
    missing = button("ONNX", lambda: say(words)).props("aria-disabled=true")
    missing.props["title"] = words
    return missing


def _download(words: str, address: str, label: str) -> ui.element:
    with ui.element("a").classes("text-button").props(f'href="{address}" download aria-label="{label}"') as link:
        ui.label(words).style("display: inline")
    return link
