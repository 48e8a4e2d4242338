"""The first steps of a lesson: the sign's name, its takes, and the training."""

import base64
import math
from collections.abc import Callable, Sequence
from typing import Any

from nicegui import ui

from handsteer.dashboard.elements import box, button, switch, tag, text
from handsteer.dashboard.lesson import Collected, View, hands_in
from handsteer.dashboard.lessons import Kept
from handsteer.recognition.recognizer import Recognition
from handsteer.training.custom.dataset import Dataset, summarise
from handsteer.training.custom.report import TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.types import EFFECTS, NONE, Action

_LONGEST = 200


class NamePanel:
    """Name a new sign, or select one that was taught before; calls ``begin`` with the name and the person."""

    def __init__(self, begin: Callable[[str, str], Any]) -> None:
        with box("step name") as self.element:
            ui.label("Show a sign of your own to the camera a few times, and say what the robot does when it sees it.")
            with box("fields"):
                self._name = ui.input("Name of the sign", placeholder="Peace").props("outlined dense maxlength=40")
                self._person = ui.input("Who shows it", value="me").props("outlined dense maxlength=40")
            self._known = box("picks")
            self._name.on("keydown.enter", lambda: begin(*self._said))
            with box("buttons"):
                button("Begin", "").classes("primary").on("click", lambda: begin(*self._said))
            text("faint", "The robot is stopped while you teach. Pictures are not stored, only the hand's landmarks.")

    def show_known(self, known: Dataset) -> None:
        """Offer the signs of ``known`` for selection."""
        self._known.clear()
        takes = {each.label: each.takes for each in summarise(known)}
        with self._known:
            for label, count in takes.items():
                if label != NONE:
                    self._pick(label, f"{label} ({count} takes)")
            if takes:
                self._pick(NONE, "No sign: what shall not count")

    @property
    def _said(self) -> tuple[str, str]:
        return str(self._name.value or "")[:_LONGEST], str(self._person.value or "")[:_LONGEST]

    def _pick(self, label: str, words: str) -> None:
        button(words, "").on("click", lambda: self._name.set_value(label))


class Countdown:
    """The current instruction in large letters on the camera's picture, readable from a distance."""

    def __init__(self, stage: ui.element) -> None:
        self._stage = stage
        with stage, box("countdown hidden") as self._box:
            self._number = text("number", "")
            self._words = text("words", "")

    def update(self, view: View | None) -> None:
        """Show ``view``."""
        is_under_way = view is not None and view.recording
        switch(self._box, "hidden", on=not is_under_way)
        switch(self._stage, "recording", on=view is not None and view.status.phase == "recording")
        if view is not None and is_under_way:
            number, words = said_now(view)
            self._number.set_text(number)
            self._words.set_text(words)


class CollectPanel:
    """Record takes, view them, delete some, and start the training.

    Args:
        record: Called to start the countdown.
        pause: Called to stop recording.
        train: Called to start the training.
        discard: Called to end the lesson.
        delete: Called with the number of a take to delete it.
    """

    def __init__(
        self,
        *,
        record: Callable[[], None],
        pause: Callable[[], None],
        train: Callable[[], None],
        discard: Callable[[], None],
        delete: Callable[[int], None],
    ) -> None:
        self._delete = delete
        self._shown: tuple[int, ...] = ()
        with box("step collect hidden") as self.element:
            self._count = text("count", "").props('role="status"')
            self._hint = text("hint", "").props('role="status"')
            with box("buttons"):
                self._record = button("Record", "").classes("primary").on("click", record)
                self._pause = button("Pause", "").on("click", pause)
                self._train = button("Train", "").on("click", train)
                button("Discard", 'aria-label="Discard: end the lesson and keep nothing"').on("click", discard)
            self._takes = ui.element("ul").classes("takes").props('aria-label="Takes"')
            text(
                "faint",
                "Show the sign as you will when you drive: nearer and farther, tilted, turned. Hands that are"
                " of no use, as the camera saw something else, are deleted with their take.",
            )

    def update(self, view: View) -> None:
        """Show ``view``."""
        self._count.set_text(counted(view))
        self._hint.set_text(view.hint)
        switch(self._record, "hidden", on=view.recording)
        switch(self._pause, "hidden", on=not view.recording)
        self._train.props(remove="disabled") if view.can_train else self._train.props("disabled")
        enough = len(view.takes) >= view.wanted
        switch(self._record, "primary", on=not enough)
        switch(self._train, "primary", on=enough)
        numbers = tuple(each.number for each in view.takes)
        if numbers != self._shown:
            self._shown = numbers
            self._takes.clear()
            with self._takes:
                for each in view.takes:
                    self._tile(each)

    def _tile(self, each: Collected) -> None:
        picture = base64.b64encode(each.picture).decode()
        with ui.element("li").classes("take"):
            ui.element("img").props(f'src="data:image/jpeg;base64,{picture}" alt="A frame of take {each.number}"')
            text("faint", f"{each.number}: {len(each.take.hands)} hands")
            button("Delete", f'aria-label="Delete take {each.number}"').on("click", lambda: self._delete(each.number))


class TrainPanel:
    """The progress of the training; calls ``cancel`` to return to the takes."""

    def __init__(self, cancel: Callable[[], None]) -> None:
        self._percent = -1
        with box("step train hidden") as self.element:
            self._words = text("count", "Learning").props('role="status"')
            with box("meter progress").props('role="progressbar" aria-label="Training"') as self._meter:
                self._fill = box("")
            with box("buttons"):
                button("Cancel", 'aria-label="Cancel the training"').on("click", cancel)

    def update(self, view: View) -> None:
        """Show ``view``."""
        percent = round(100 * view.progress)
        if percent != self._percent:
            self._percent = percent
            self._words.set_text(
                f"Learning what all takes have in common: {percent} %"
                if percent
                else "Making hands of every shape, to tell the sign from"
            )
            self._fill.style(f"width: {percent}%")
            self._meter.props(f"aria-valuenow={percent}")


def counted(view: View) -> str:
    """Return the number of takes of ``view`` in words."""
    takes = len(view.takes)
    of = f" of {view.wanted}" if takes <= view.wanted else ""
    return f"{takes}{of} takes, {hands_in(view.takes)} hands"


def said_now(view: View) -> tuple[str, str]:
    """Return the current instruction while takes are recorded: a number, and words."""
    if view.status.phase == "recording":
        return str(view.status.hands), f"hands: show {view.label}"
    return str(math.ceil(view.status.left_s)), f"then show {view.label}"


class ResultPanel:
    """How well the sign was learnt; try it, assign an action, and keep or discard it.

    Args:
        actions: The available actions.
        action_of: Returns the current action of a sign.
        keep: Called with the action.
        more: Called to collect further takes.
        discard: Called to end the lesson.
    """

    def __init__(
        self,
        actions: Sequence[Action],
        *,
        action_of: Callable[[str], Action],
        keep: Callable[[str], Any],
        more: Callable[[], None],
        discard: Callable[[], None],
    ) -> None:
        self._action_of = action_of
        with box("step result hidden") as self.element:
            tag("h3", "", "Try it")
            with box("opinion").props('role="status"'):
                self._sign = text("sign", "")
                self._would = text("faint", "")
            self._action = ui.select({action: worded(action) for action in actions}, label="What it does", value="go")
            self._action.props("outlined dense")
            with box("buttons"):
                button("Keep", "").classes("primary").on("click", lambda: keep(str(self._action.value)))
                button("More takes", "").on("click", more)
                button("Discard", 'aria-label="Discard: end the lesson and keep nothing"').on("click", discard)
            self._lost = text("trouble", "")
            tag("h3", "", "How well it was learnt")
            self._figures = box("figures")

    def update(self, view: View) -> None:
        """Show ``view``."""
        sign, would = opinion(
            view.seen, view.label, lambda sign: self._action.value if sign == view.label else self._action_of(sign)
        )
        self._sign.set_text(sign)
        self._would.set_text(would)

    def fill(self, view: View, lost: Sequence[str]) -> None:
        """Show the figures of ``view``, the sign's current action, and the signs that would be lost."""
        self._action.set_value(self._action_of(view.label))
        switch(self._action, "hidden", on=view.label == NONE)
        words = f"There are no takes of {', '.join(lost)}: what was learnt before of it would be lost." if lost else ""
        self._lost.set_text(words)
        self._figures.clear()
        if view.report is not None:
            with self._figures:
                _figures(view.report)


class KeptPanel:
    """The kept sign, and how to make it permanent; calls ``again`` to teach another sign."""

    def __init__(self, again: Callable[[], Any]) -> None:
        with box("step kept hidden") as self.element:
            self._words = text("count", "").props('role="status"')
            text(
                "",
                "It is in use already. The robot stands until you press Reset above, and moves once you have shown"
                " Stop, or no hand.",
            )
            text("", "To have it at the next start too, put this into your configuration file:")
            self._lines = tag("pre", "lines", "").props("tabindex=0")
            self._files = text("faint", "")
            with box("buttons"):
                button("Teach another sign", "").classes("primary").on("click", again)
                ui.link("Drive", "/").classes("text-button")

    def fill(self, kept: Kept) -> None:
        """Show the kept sign."""
        if kept.action is None:
            self._words.set_text("What shall not count is learnt")
        else:
            self._words.set_text(f"{kept.label} is learnt, and means: {EFFECTS[kept.action]}")
        self._lines.set_text(kept.lines)
        self._files.set_text(f"The takes are in {kept.dataset}, what was learnt from them in {kept.model}.")


def worded(action: Action) -> str:
    """Return ``action`` in words."""
    return f"{action.replace('_', ' ')}: {EFFECTS[action]}"


def opinion(seen: Recognition | None, label: str, does: Callable[[str], Action]) -> tuple[str, str]:
    """Return in words how the taught model recognises the hand, and what the robot would do.

    Args:
        seen: The recognition of the newest frame; None without a frame.
        label: The taught sign.
        does: Returns the action of a sign, current or intended.
    """
    if seen is None:
        return "No picture", ""
    if seen.hand is None:
        return "No hand", "no hand is in view"
    if seen.seen == NONE:
        return "No sign", f"show {label}" if label != NONE else "as it shall be"
    return f"{seen.seen}, {seen.confidence:.0%}", f"would mean: {EFFECTS[does(seen.seen)]}"


def _figures(report: TrainingReport) -> None:
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
