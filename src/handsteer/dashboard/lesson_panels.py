"""The steps of a lesson on the page: the sign's name, its takes, the training, the result, and what was learnt."""

import asyncio
import base64
from collections.abc import Callable, Sequence
from typing import TypeVar

from nicegui import ui

from handsteer.dashboard.lesson import LessonState, counted, outcome
from handsteer.dashboard.lesson_node import LessonNode
from handsteer.dashboard.lessons import LearntSign, Lessons
from handsteer.dashboard.page import Page, box, button, switch, tag, text
from handsteer.errors import HandsteerError
from handsteer.training.custom.dataset import Dataset, summarise
from handsteer.training.custom.report import TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.types import EFFECTS, NONE, Action

T = TypeVar("T")

_DISCARDED = "The lesson is over, and nothing of it was kept. The robot stands until you press Reset."
_LONGEST = 200
_DISCARD = "Discard: end the lesson and keep nothing"


class ViewerLesson:
    """The lesson of a page's viewer.

    Attributes:
        lessons: Run it.
        message: An error, or what has happened; empty if nothing.
        learnt: The sign that was taught and saved last, until the next lesson.
    """

    def __init__(self, page: Page, lessons: Lessons) -> None:
        self.lessons = lessons
        self.message = ""
        self.learnt: LearntSign | None = None
        self._page = page
        self._viewer = page.client.id
        self._is_over = False

    @property
    def node(self) -> LessonNode | None:
        """The lesson, if there is one."""
        return self.lessons.node(self._viewer)

    def do(self, action: Callable[[LessonNode], object]) -> None:
        """Call ``action`` with the lesson, if there is one."""
        self.message = ""
        if node := self.node:
            action(node)

    async def begin(self, name: str, person: str) -> None:
        """Stop the robot, and begin a lesson if the viewer drives."""
        node = self._page.node
        if node is None or not self._page.drives():
            self.message = "Another viewer drives: ask to drive first, then teach."
            return
        node.halt()
        await self._run(self.lessons.begin, self._viewer, name, person)
        if self._is_over:  # the viewer has left the page
            self.lessons.end(self._viewer)

    async def save(self, action: str) -> None:
        """Save what was learnt, with this action."""
        self.learnt = await self._run(self.lessons.save, self._viewer, action)

    async def known(self) -> Dataset:
        """Return the takes of earlier lessons; none if they cannot be read."""
        return await self._run(self.lessons.known) or Dataset()

    def discard(self) -> None:
        """End the lesson without saving anything."""
        self.end(_DISCARDED)

    def end(self, why: str) -> None:
        """End the lesson without saving anything, and show ``why``."""
        self.lessons.end(self._viewer)
        self.message = why

    def leave(self) -> None:
        """End the lesson, because the page is left."""
        self._is_over = True
        self.lessons.end(self._viewer)

    async def _run(self, action: Callable[..., T], *arguments: object) -> T | None:
        """Return the result of ``action``, which reads or writes files; show an error instead."""
        self.message = ""
        try:
            return await asyncio.to_thread(action, *arguments)
        except HandsteerError as error:
            self.message = f"{error}."
            return None


class NamePanel:
    """Name a new sign, or select one that was taught before."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        with box("step name") as self.element:
            ui.label("Show a sign of your own to the camera a few times, and say what the robot does when it sees it.")
            with box("fields"):
                self._name = ui.input("Name of the sign", placeholder="Peace").props("outlined dense maxlength=40")
                self._person = ui.input("Who shows it", value="me").props("outlined dense maxlength=40")
            self._known = box("picks")
            self._name.on("keydown.enter", self._begin)
            with box("buttons"):
                button("Begin", self._begin).classes("primary")
            text("faint", "The robot is stopped while you teach. Pictures are not stored, only the hand's landmarks.")

    async def fill(self) -> None:
        """Offer the signs of earlier lessons for selection."""
        takes = {each.label: each.takes for each in summarise(await self._lesson.known())}
        self._known.clear()
        with self._known:
            for label, count in takes.items():
                if label != NONE:
                    self._pick(label, f"{label} ({count} takes)")
            if takes:
                self._pick(NONE, "No sign: hands that must not count")

    def _pick(self, label: str, words: str) -> None:
        button(words, lambda: self._name.set_value(label))

    async def _begin(self) -> None:
        await self._lesson.begin(*(str(each.value or "")[:_LONGEST] for each in (self._name, self._person)))


class CollectPanel:
    """Record takes, view them, delete some, and start the training."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        self._shown: tuple[int, ...] = ()
        with box("step collect hidden") as self.element:
            self._count = text("count", "").props('role="status"')
            self._hint = text("hint", "").props('role="status"')
            with box("buttons"):
                self._record = button("Record", lambda: lesson.do(LessonNode.record)).classes("primary")
                self._pause = button("Pause", lambda: lesson.do(LessonNode.pause))
                self._train = button("Train", lambda: lesson.do(LessonNode.train))
                button("Discard", lesson.discard, _DISCARD)
            self._takes = ui.element("ul").classes("takes").props('aria-label="Takes"')
            text(
                "faint",
                "Show the sign as you will when you drive: nearer and farther, tilted, turned. Hands that are"
                " of no use, as the camera saw something else, are deleted with their take.",
            )

    def update(self, state: LessonState) -> None:
        """Show ``state``."""
        self._count.set_text(counted(state))
        self._hint.set_text(state.hint)
        switch(self._record, "hidden", on=state.recording)
        switch(self._pause, "hidden", on=not state.recording)
        self._train.props(remove="disabled") if state.can_train else self._train.props("disabled")
        enough = len(state.takes) >= state.wanted
        switch(self._record, "primary", on=not enough)
        switch(self._train, "primary", on=enough)
        numbers = tuple(each.number for each in state.takes)
        if numbers != self._shown:
            self._shown = numbers
            self._takes.clear()
            with self._takes:
                for each in state.takes:
                    self._tile(each.number, each.picture, len(each.take.hands))

    def _tile(self, number: int, picture: bytes, hands: int) -> None:
        data = base64.b64encode(picture).decode()
        with ui.element("li").classes("take"):
            ui.element("img").props(f'src="data:image/jpeg;base64,{data}" alt="A frame of take {number}"')
            text("faint", f"{number}: {hands} hands")
            button("Delete", lambda: self._lesson.do(lambda node: node.delete(number)), f"Delete take {number}")


class TrainPanel:
    """The progress of the training, and a button that returns to the takes."""

    def __init__(self, lesson: ViewerLesson) -> None:
        with box("step train hidden") as self.element:
            self._words = text("count", "Learning").props('role="status"')
            with box("meter progress").props('role="progressbar" aria-label="Training"') as self._meter:
                self._fill = box("")
            with box("buttons"):
                button("Cancel", lambda: lesson.do(LessonNode.go_back), "Cancel the training")

    def update(self, state: LessonState) -> None:
        """Show ``state``."""
        percent = round(100 * state.progress)
        learning = f"Learning what all takes have in common: {percent} %"
        self._words.set_text(learning if percent else "Making hands of every shape, to tell the sign from")
        self._fill.style(f"width: {percent}%")
        self._meter.props(f"aria-valuenow={percent}")


class ResultPanel:
    """How well the sign was learnt; try it, assign an action, and save or discard it."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lessons = lesson.lessons
        actions = {action: f"{action.replace('_', ' ')}: {EFFECTS[action]}" for action in self._lessons.actions()}
        with box("step result hidden") as self.element:
            tag("h3", "", "Try it")
            with box("opinion").props('role="status"'):
                self._sign = text("sign", "")
                self._effect = text("faint", "")
            self._action = ui.select(actions, label="What it does", value="go").props("outlined dense")
            with box("buttons"):
                button("Keep", lambda: lesson.save(str(self._action.value))).classes("primary")
                button("More takes", lambda: lesson.do(LessonNode.go_back))
                button("Discard", lesson.discard, _DISCARD)
            self._lost = text("trouble", "")
            tag("h3", "", "How well it was learnt")
            self._report = box("figures")

    def fill(self, state: LessonState) -> None:
        """Show the report of ``state``, the sign's current action, and the signs that would be lost."""
        lost = ", ".join(self._lessons.lost())
        self._action.set_value(self._lessons.action_of(state.label))
        switch(self._action, "hidden", on=state.label == NONE)
        self._lost.set_text(
            f"There are no takes of {lost}: what was learnt before of it would be lost." if lost else ""
        )
        self._report.clear()
        if state.report is not None:
            with self._report:
                _show_report(state.report)

    def update(self, state: LessonState) -> None:
        """Show ``state``."""

        def action_of(sign: str) -> Action:
            action: Action = self._action.value if sign == state.label else self._lessons.action_of(sign)
            return action

        sign, effect = outcome(state.seen, state.label, action_of)
        self._sign.set_text(sign)
        self._effect.set_text(effect)


class LearntPanel:
    """The saved sign, and how to make it permanent; calls ``again`` to teach another sign."""

    def __init__(self, again: Callable[[], object]) -> None:
        with box("step kept hidden") as self.element:
            self._words = text("count", "").props('role="status"')
            text(
                "",
                "It is in use already. The robot stands until you press Reset above, and moves once you have shown"
                " Stop, or no hand.",
            )
            text("", "To have it at the next start too, put this into your configuration file:")
            self._yaml = tag("pre", "lines", "").props("tabindex=0")
            self._files = text("faint", "")
            with box("buttons"):
                button("Teach another sign", again).classes("primary")
                ui.link("Drive", "/").classes("text-button")

    def fill(self, learnt: LearntSign) -> None:
        """Show the saved sign."""
        if learnt.action is None:
            self._words.set_text("The hands that must not count are learnt")
        else:
            self._words.set_text(f"{learnt.label} is learnt, and means: {EFFECTS[learnt.action]}")
        self._yaml.set_text(learnt.yaml)
        self._files.set_text(f"The takes are in {learnt.dataset}, what was learnt from them in {learnt.model}.")


def _show_report(report: TrainingReport) -> None:
    labels, counts = report.confusion.labels, report.confusion.counts
    with box("scroll").props('tabindex=0 role="region" aria-label="Confusion matrix"'), ui.element("table"):
        tag("caption", "", "A row for each sign that was shown, a column for each that came out, in hands")
        with ui.element("thead"), ui.element("tr"):
            _heads("col", ["shown", *(_named(label) for label in labels), "right"])
        with ui.element("tbody"):
            for row, label in enumerate(labels):
                if any(counts[row]):
                    _row(label, counts[row], row)
    for words in (*mistakes(report), f"{how_it_was_tried(report)}.", false_hands(report)):
        text("", words)


def _row(label: str, counts: Sequence[int], own: int) -> None:
    with ui.element("tr"):
        _heads("row", [_named(label)])
        for column, count in enumerate(counts):
            kind = "right" if column == own else "wrong" if count else ""
            tag("td", kind, str(count))
        tag("td", "", f"{counts[own] / sum(counts):.1%}")


def _heads(scope: str, names: Sequence[str]) -> None:
    for name in names:
        tag("th", "", name).props(f"scope={scope}")


def _named(label: str) -> str:
    return "no sign" if label == NONE else label
