"""The cards of a lesson: one for each class of hands, with its takes and a live bar."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from nicegui import ui

from handsteer.plugins.page.elements import box, button, sentence, switch, tag, text
from handsteer.plugins.page.lesson import MOST_TAKES, Lesson
from handsteer.plugins.page.lesson_panels import ViewerLesson, set_words
from handsteer.plugins.page.lesson_state import Collected, LessonState, Seen, SignClass, counted
from handsteer.plugins.page.sign_pictures import DRAWN, draw_hand
from handsteer.plugins.teach.dataset import typical_hand
from handsteer.plugins.teach.effects import effect_words
from handsteer.types import NONE, Action

_SHOWN: Final = 8
_MOST_SHOWN: Final = 60
_STEP: Final = 2
"""Bars move in steps of as many percent, to send less."""

_BIN: Final = (
    '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" '
    'aria-hidden="true"><path d="M6 6l12 12M18 6L6 18"/></svg>'
)


class ClassCards:
    """All classes side by side: own signs, a form for another, hands that mean nothing, and the shipped signs."""

    def __init__(self, lesson: ViewerLesson) -> None:
        self._lesson = lesson
        self._cards: dict[int, _ClassCard] = {}
        with box("classes") as self._box, ui.element("section").classes("card class new") as self._new:
            tag("h2", "", "New sign")
            self._name = ui.input("Name of the sign", placeholder="Peace").props("outlined dense maxlength=40")
            self._name.on("keydown.enter", self._add)
            button("Add", self._add, "Add the sign")
        with box("classes examples"):
            self._examples = {sign: _Example(sign) for sign in DRAWN}

    def actions(self) -> Mapping[str, str]:
        """Return the action of each sign for which one is selected."""
        return {card.label: card.action for card in self._cards.values() if card.action}

    def clear(self) -> None:
        """Remove the cards of a lesson: the classes of another one may have the same keys."""
        for card in self._cards.values():
            card.element.delete()
        self._cards.clear()

    def update(self, state: LessonState) -> None:
        """Show ``state``, of the same lesson as before or after :meth:`clear`."""
        for key in [key for key in self._cards if state.of(key) is None]:
            self._cards.pop(key).element.delete()
        for place, one in enumerate(state.classes):
            if one.key not in self._cards:
                with self._box:
                    self._cards[one.key] = _ClassCard(self._lesson, one)
                # The form for another sign follows the own ones, and precedes NONE.
                self._cards[one.key].element.move(target_index=place + (one.label == NONE))
            self._cards[one.key].update(one, state)
        least = round(100 * self._lesson.lessons.signs.min_confidence)
        for example in self._examples.values():
            example.bar.update(state.seen, least)

    def _add(self) -> None:
        name = str(self._name.value or "")
        # Next to the field, too: the lesson's messages may be out of sight.
        self._name.error = self._lesson.do(lambda lesson: lesson.add_class(name)) or None
        if not self._name.error:
            self._name.set_value("")


class _Bar:
    """How much the hand in the newest frame is of one class, and from where on it counts."""

    def __init__(self, label: str, words: str) -> None:
        self._label = label
        with box("bar"):
            with box("meter live").props('role="meter"') as self._meter:
                self._fill = box("")
                self._line = ui.element("i")
            self._percent = text("percent", "")
        self.name(words)
        self._shown = (-1, -1, False)

    def name(self, words: str) -> None:
        """Set the name of the bar."""
        self._meter.props["aria-label"] = words
        self._meter.update()

    def update(self, seen: Seen | None, least: int) -> None:
        """Show ``seen``; from ``least`` percent on, a sign counts."""
        share = seen.confidences.get(self._label, 0.0) if seen is not None else 0.0
        percent = round(100 * share / _STEP) * _STEP
        counts = 100 * share >= least and self._label != NONE
        if (percent, least, counts) == self._shown:
            return
        self._shown = (percent, least, counts)
        self._fill.style(f"width: {percent}%")
        self._meter.props(f"aria-valuenow={percent}")
        switch(self._meter, "counts", on=counts)
        self._percent.set_text(f"{percent} %")
        self._line.style(f"left: {least}%")
        switch(self._line, "hidden", on=self._label == NONE)

    def rename(self, label: str) -> None:
        """Show another class."""
        self._label = label
        self.name(label)


class _Example:
    """A shipped sign, which cannot be changed."""

    def __init__(self, sign: str) -> None:
        pose, drawing = DRAWN[sign]
        with ui.element("section").classes("card class example"):
            ui.html(drawing, sanitize=False)
            with box("words"):
                tag("h2", "", sign)
                text("faint", pose)
                self.bar = _Bar(sign, sign)


class _ActionChoice:
    """What the robot does at a sign, one of ``actions``; its ``value`` is empty until one is chosen."""

    def __init__(self, actions: Sequence[Action], chosen: Action | None) -> None:
        self.value: str = ""
        with box("does").props('role="group" aria-label="What the robot does"'):
            self._words = text("faint", "Choose what the robot does:")
            with box("actions"):
                self._buttons = {
                    action: button(action.replace("_", " "), partial(self._choose, action)) for action in actions
                }
        for each in self._buttons.values():
            each.props("aria-pressed=false")
        if chosen is not None:
            self._choose(chosen)

    def _choose(self, action: Action) -> None:
        self.value = action
        for name, each in self._buttons.items():
            each.props(f"aria-pressed={'true' if name == action else 'false'}")
        self._words.set_text(sentence(effect_words(action, None)))


class _ClassCard:
    """A class of the lesson, which can be changed; its ``label`` is the sign, or ``NONE``."""

    def __init__(self, lesson: ViewerLesson, one: SignClass) -> None:
        self._lesson = lesson
        self.label = one.label
        self._key = one.key
        self._shown: object = None
        self._is_open = False
        with ui.element("section").classes("card class own") as self.element:
            with box("class-head"):
                self._picture = ui.html("", sanitize=False).classes("picture")
                with box("title"):
                    self._head(one)
            self._bar = _Bar(one.label, _named(one.label))
            with box("buttons"):
                self._hold = button("Hold to record").props(f"data-hold={one.key}").classes("hold")
                self._timed = button("", lambda: lesson.do(lambda of: of.record(one.key)))
                self._stop = button("Stop recording", lambda: lesson.do(Lesson.pause))
            self._count = text("faint count", "")
            self._takes = ui.element("ul").classes("takes")
            self._more = button("", self._toggle).classes("more")
            if one.label != NONE:
                self._foot(lesson, one)

    @property
    def action(self) -> str:
        """The selected action; empty if none is yet."""
        return self._action.value if self.label != NONE else ""

    def update(self, one: SignClass, state: LessonState) -> None:
        """Show ``one``."""
        least = round(100 * self._lesson.lessons.signs.min_confidence)
        self._bar.update(state.seen, least)
        mine = state.recorded == one.key
        busy = state.is_training or state.recorded is not None
        timed = mine and not state.is_held
        shown = (one, mine, busy, timed, self._is_open)
        if shown == self._shown:
            return
        self._shown = shown
        switch(self.element, "recording", on=mine)
        switch(self.element, "off", on=not one.is_enabled)
        full = len(one.takes) >= MOST_TAKES
        switch(self._timed, "hidden", on=busy or full)
        switch(self._hold, "hidden", on=(busy and not mine) or timed or full)
        switch(self._stop, "hidden", on=not timed)
        missing = max(1, self._lesson.lessons.takes_wanted - len(one.takes))
        set_words(self._timed, "1 timed take" if missing == 1 else f"{missing} timed takes")
        self._count.set_text(counted(one))
        if one.label != self.label:
            self.label = one.label
            self._bar.rename(one.label)
            self._title.set_text(one.label)
        self._show_takes(one)
        if one.label != NONE:
            self._name.set_value(one.label)
            self._enabled.set_value(one.is_enabled)

    def _head(self, one: SignClass) -> None:
        if one.label == NONE:
            tag("h2", "", "Background")
            text("faint", "hands that mean nothing")
            return
        self._title = tag("h2", "spoken", one.label)
        self._name = ui.input(value=one.label).props('dense borderless maxlength=40 aria-label="Name"')
        for event in ("blur", "keydown.enter"):
            self._name.on(event, self._rename)

    def _foot(self, lesson: ViewerLesson, one: SignClass) -> None:
        node = lesson.node
        known = lesson.lessons.chosen_action(one.label, node.state) if node is not None else None
        self._action = _ActionChoice(lesson.lessons.actions(), known)
        with box("class-foot"):
            self._enabled = ui.switch("Learn it", value=one.is_enabled, on_change=self._enable)
            button("Delete", lambda: lesson.do(lambda of: of.delete_class(one.key)), "Delete the sign")

    def _show_takes(self, one: SignClass) -> None:
        hands = [each.take.hands[len(each.take.hands) // 2] for each in one.takes if each.take.hands]
        typical = draw_hand(hands[typical_hand(hands)].pixels) if hands else ""
        self._picture.set_content(typical or DRAWN["Stop"][1])
        switch(self._picture, "none", on=not typical)
        count = _MOST_SHOWN if self._is_open else _SHOWN
        shown = one.takes[-count:]
        self._takes.clear()
        with self._takes:
            for each in shown:
                self._take(each)
        self._takes.props["aria-label"] = f"Takes of {_named(one.label)}"
        switch(self._takes, "hidden", on=not shown)
        switch(self._more, "hidden", on=len(one.takes) <= _SHOWN)
        some = f"Show all {len(one.takes)} takes" if len(one.takes) <= _MOST_SHOWN else f"Show {_MOST_SHOWN} takes"
        set_words(self._more, "Show fewer takes" if self._is_open else some)

    def _take(self, each: Collected) -> None:
        hands = each.take.hands
        with ui.element("li").classes("take"):
            ui.html(draw_hand(hands[len(hands) // 2].pixels) if hands else "", sanitize=False)
            delete = ui.element("button").classes("delete").props('type="button"')
            delete.props["aria-label"] = f"Delete a take of {len(hands)} hands"
            delete.props["title"] = f"{each.take.person}, {len(hands)} hands: delete"
            with delete.on("click", partial(self._lesson.do, lambda of: of.delete_take(each.number))):
                ui.html(_BIN, sanitize=False)

    def _toggle(self) -> None:
        self._is_open = not self._is_open

    def _rename(self) -> None:
        name = str(self._name.value or "")
        self._lesson.do(lambda of: of.rename(self._key, name))
        self._shown = None

    def _enable(self) -> None:
        on = bool(self._enabled.value)
        self._lesson.do(lambda of: of.enable(self._key, on=on))


def _named(label: str) -> str:
    return "Background" if label == NONE else label
