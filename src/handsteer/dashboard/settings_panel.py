"""A form of all parameters: one row each, in sections."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.elements import box, button, card, switch, tag, text
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import Page, PageContext
from handsteer.dashboard.settings_form import FormField
from handsteer.dashboard.settings_store import FORM, Settings
from handsteer.dashboard.state import PageState
from handsteer.errors import ConfigError, HandsteerError
from handsteer.parameters import section_model

_NONE = "none"
_LONGEST_SEARCH = 100
_KEYBOARDS = {"number": 'inputmode="decimal"', "text": "", "list": "", "table": ""}


class SettingRow:
    """One parameter: its meaning, its value, and a reset to its default.

    Args:
        field: The parameter.
        settings: Stores its value.
        commit: Called with a change to make; returns an error message if it is refused.
    """

    def __init__(
        self, field: FormField, settings: Settings, commit: Callable[[Callable[[], object]], str | None]
    ) -> None:
        self.field = field
        self._settings = settings
        self._commit = commit
        self._is_edited = False
        self._is_being_put = False
        self._shown: tuple[object, ...] = ()
        with box("setting") as self.element:
            with box("about"):
                with box("title"):
                    tag("h3", "name", field.name)
                    self._changed = text("mark", "changed")
                    self._waits = text("mark waits", "waits for the next start")
                text("doc", f"{field.text}.")
                self._facts = text("facts", "")
            with box("value"):
                self._input = self._make_input()
                if field.unit:
                    text("unit", field.unit)
                self._reset = button("Default", f'aria-label="Set {field.path} to its default"')
                self._reset.on("click", self._to_default)

    @property
    def is_due(self) -> bool:
        """Whether the value needs to be shown again."""
        return not self._shown

    def update(self, *, to_driver: bool, editable: bool) -> None:
        """Show the value, unless it is being edited."""
        field, settings = self.field, self._settings
        value = field.show(field.value_in(settings.wanted), to_driver=to_driver)
        state = (value, settings.default(field), settings.is_changed(field), settings.waits(field), editable)
        if state == self._shown:
            return
        self._shown = state
        if not self._is_edited:
            self._put(value)
        self._facts.set_text(_facts(field, settings.default(field)))
        switch(self._changed, "hidden", on=not settings.is_changed(field))
        switch(self._waits, "hidden", on=not settings.waits(field))
        switch(self._reset, "hidden", on=not (settings.is_changed(field) and editable))
        if isinstance(self._input, ui.switch):
            self._input.set_enabled(editable)
        else:
            self._input.props["readonly"] = not editable

    def _make_input(self) -> ui.input | ui.select | ui.switch:
        field = self.field
        label = f'aria-label="{field.path}"'
        if field.kind == "switch":
            return ui.switch(on_change=self._take).props(label)
        if field.kind == "choice":
            options = {**({"": _NONE} if field.optional else {}), **{choice: choice for choice in field.choices}}
            select = ui.select(options, on_change=self._take).without_auto_validation()
            return select.props(f"outlined dense options-dense hide-bottom-space no-error-icon {label}")
        line = ui.input(validation=self._check)
        line.props(f"outlined dense hide-bottom-space no-error-icon {_KEYBOARDS[field.kind]} {label}")
        line.on("blur", self._take).on("keydown.enter", self._take).on("keydown.escape", self._give_up)
        return line

    @property
    def _text(self) -> str:
        value = self._input.value
        return str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else ""

    def _put(self, value: str) -> None:
        self._is_being_put = True  # not a change by the viewer
        if isinstance(self._input, ui.switch):
            self._input.set_value(value == "true")
        else:
            self._input.set_value(value)
        self._is_being_put = False

    def _check(self, _value: object) -> str | None:
        """Validate the text at each key; return an error message, or None."""
        if self._is_current:
            return None
        self._is_edited = True
        try:
            self.field.parse(self._text, self.field.value_in(self._settings.wanted))
        except ConfigError as error:
            return self._without_name(str(error))
        return None

    @property
    def _is_current(self) -> bool:
        return bool(self._shown) and self._text == self._shown[0]

    def _take(self) -> None:
        if self._is_being_put:
            return
        if self._is_current:
            self._give_up()
            return
        typed = self._text
        problem = self._commit(lambda: self._settings.set(self.field, typed))
        self._shown = ()
        self._refuse(problem)
        # Invalid text stays to be corrected; an invalid choice returns to the value that is set.
        self._is_edited = problem is not None and isinstance(self._input, ui.input)

    def _give_up(self) -> None:
        """Discard the edit and show the value that is set."""
        self._is_edited = False
        self._shown = ()
        self._refuse(None)

    def _to_default(self) -> None:
        problem = self._commit(lambda: self._settings.reset(self.field))
        self._give_up()
        self._refuse(problem)

    def _refuse(self, problem: str | None) -> None:
        if not isinstance(self._input, ui.switch):
            self._input.error = problem and self._without_name(problem)

    def _without_name(self, problem: str) -> str:
        return problem.removeprefix(self.field.path).removeprefix(": ")


class SettingsPanel:
    """All parameters, with a search, and buttons to load and save the file.

    Args:
        settings: The parameters.
        drives: Returns whether this viewer may change anything, after giving it the lease if that is free.
    """

    def __init__(self, settings: Settings, drives: Callable[[], bool]) -> None:
        self._settings = settings
        self._drives = drives
        self._seen: tuple[object, ...] = ()
        self._rows: list[SettingRow] = []
        self._cards: dict[str, ui.element] = {}
        self._toolbar()
        with box("sections"):
            for section, fields in FORM.items():
                with box("") as self._cards[section], card(section, "panel section"):
                    text("meaning", (section_model(section).__doc__ or "").partition("\n")[0])
                    self._rows += [SettingRow(field, settings, self._commit) for field in fields]
            self._nothing = text("nothing hidden", "No parameter is called so, or says so.")

    def update(self, *, to_driver: bool, editable: bool) -> None:
        """Show the values; they are ``editable`` if this viewer drives (``to_driver``) or the lease is free."""
        settings = self._settings
        settings.follow()
        seen = (settings.revision, to_driver, editable)
        for row in self._rows:
            if seen != self._seen or row.is_due:
                row.update(to_driver=to_driver, editable=editable)
        if seen == self._seen:
            return
        self._seen = seen
        path = settings.file.path if to_driver else settings.file.path.name
        self._place.set_text(f"The file is {path}; the next start reads it by: handsteer run --config {path}")
        state = "as in the file" if settings.is_saved else "not saved yet"
        if settings.is_saved and not settings.file.is_read:
            state = "all is as by default"
        self._state.set_text(state)
        for each in (self._save, self._load, self._reset_all):
            switch(each, "hidden", on=not editable)
        self._filter()

    def _toolbar(self) -> None:
        with ui.element("section").classes("card panel tools"):
            with box("row"):
                self._search = ui.input(placeholder="Search", on_change=self._filter).classes("search")
                self._search.props('outlined dense clearable type="search" aria-label="Search the parameters"')
                self._only = ui.switch("changed only", on_change=self._filter)
                self._state = text("state", "")
                self._save = button("Save", "").classes("save").on("click", self._save_all)
                self._load = button("Load", 'aria-label="Load what the file says"').on("click", self._load_file)
                self._reset_all = button("Reset all", 'aria-label="Set all parameters to their defaults"')
            self._place = text("place", "")
            self._said = text("said", "").props('role="status"')
        with ui.dialog() as dialog, box("card panel question"):
            text("", "Set all parameters to their defaults? The file stays as it is until you save.")
            with box("row"):
                button("Set all to default", "").on("click", dialog.close).on("click", self._to_defaults)
                button("Keep", "").on("click", dialog.close)
        self._reset_all.on("click", dialog.open)

    def _commit(self, change: Callable[[], object]) -> str | None:
        """Make a change if this viewer may; show and return the error message, if any."""
        problem = None
        if not self._drives():
            problem = "only who drives may change settings: ask to drive first"
        else:
            try:
                change()
            except HandsteerError as error:
                problem = str(error)
        self._say(problem or "", wrong=problem is not None)
        return problem

    def _save_all(self) -> None:
        said: list[str] = []
        if self._commit(lambda: said.append(self._settings.save())) is None:
            self._say(said[0])

    def _load_file(self) -> None:
        if self._commit(self._settings.load) is None:
            self._say(f"loaded {self._settings.file.path.name}")

    def _to_defaults(self) -> None:
        if self._commit(lambda: self._settings.reset(*(row.field for row in self._rows))) is None:
            self._say("all is as by default; not saved")

    def _say(self, words: str, *, wrong: bool = False) -> None:
        self._said.set_text(words)
        switch(self._said, "wrong", on=wrong)

    def _filter(self) -> None:
        words = self._search.value[:_LONGEST_SEARCH] if isinstance(self._search.value, str) else ""
        wanted = [
            row
            for row in self._rows
            if row.field.matches(words) and not (self._only.value and not self._settings.is_changed(row.field))
        ]
        for row in self._rows:
            switch(row.element, "hidden", on=row not in wanted)
        found = {row.field.section for row in wanted}
        for section, element in self._cards.items():
            switch(element, "hidden", on=section not in found)
        switch(self._nothing, "hidden", on=bool(found))


def _facts(field: FormField, default: object) -> str:
    allowed = "" if field.kind == "choice" else f"{field.allowed} {field.unit}".strip() if field.allowed else ""
    shown = field.show(default) or _NONE
    when = "takes effect at once" if field.live else "read at the start"
    return " · ".join(part for part in (allowed, f"default {shown}", when) if part)


_ELSEWHERE = (
    "Here are no settings: this process only serves the page. Each node has its own, where it runs; `ros2 param list` "
    "and `ros2 param set` show and set them in ROS 2, `handsteer NODE --config FILE` reads them at its start."
)


class SettingsPage(Page):
    """Sets all parameters; viewers who do not drive can read them."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/settings", "settings.css")
        self._panel: SettingsPanel | None = None
        if context.access is None:
            with ui.element("section").classes("card panel"):
                text("elsewhere", _ELSEWHERE)
        else:
            self._panel = SettingsPanel(context.access.settings, self.drives)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        if self._panel is not None:
            role = self.lease(node).role
            self._panel.update(to_driver=role == "driver", editable=role != "watcher")
