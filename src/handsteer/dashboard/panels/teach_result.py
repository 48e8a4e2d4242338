"""The last steps of a lesson: the result of the training, and what to do with it."""

from collections.abc import Callable, Sequence
from typing import Any

from nicegui import ui

from handsteer.dashboard.panels.elements import box, button, switch, tag, text
from handsteer.dashboard.teaching.lesson import View
from handsteer.dashboard.teaching.teaching import Kept
from handsteer.recognition.recognizer import Recognition
from handsteer.training.custom.report import TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.types import EFFECTS, NONE, Action


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
