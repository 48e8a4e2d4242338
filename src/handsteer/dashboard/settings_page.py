"""The page ``/settings``: every parameter, its meaning, and its value."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import Page, PageContext, box, button, card, switch, tag, text
from handsteer.dashboard.settings import Settings
from handsteer.dashboard.settings_fields import FORM, Field
from handsteer.dashboard.state import PageState
from handsteer.errors import ConfigError, HandsteerError
from handsteer.parameters import section_model

_NONE = "none"
_LONGEST_SEARCH = 100
_STYLE = "outlined dense hide-bottom-space no-error-icon"
_ELSEWHERE = (
    "Here are no settings: this process only serves the page. Each node has its own, where it runs; `ros2 param list` "
    "and `ros2 param set` show and set them in ROS 2, `handsteer NODE --config FILE` reads them at its start."
)


class SettingsPage(Page):
    """Sets all parameters; viewers who do not drive can read them."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/settings", "settings.css")
        self._panel: SettingsPanel | None = None
        if context.settings is None:
            with ui.element("section").classes("card panel"):
                text("elsewhere", _ELSEWHERE)
        else:
            self._panel = SettingsPanel(context.settings, self.drives)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        if self._panel is not None:
            role = self.lease(node).role
            self._panel.update(to_driver=role == "driver", editable=role != "watcher")


class SettingsPanel:
    """All parameters, with a search, and buttons to load and save the file.

    Args:
        settings: The parameters.
        drives: Returns whether this viewer may change anything, after giving it the lease if that is free.
    """

    def __init__(self, settings: Settings, drives: Callable[[], bool]) -> None:
        self._settings = settings
        self._drives = drives
        self._shown: tuple[object, ...] = ()
        self._rows: list[_Row] = []
        self._cards: dict[str, ui.element] = {}
        self._toolbar()
        with box("sections"):
            for section, fields in FORM.items():
                with box("") as self._cards[section], card(section, "panel section"):
                    text("meaning", (section_model(section).__doc__ or "").partition("\n")[0])
                    self._rows += [_Row(field, settings, self._change) for field in fields]
            self._nothing = text("nothing hidden", "No parameter has this in its name or description.")

    def update(self, *, to_driver: bool, editable: bool) -> None:
        """Show the values; they are ``editable`` if this viewer drives (``to_driver``) or the lease is free."""
        settings = self._settings
        settings.follow()
        shown = (settings.revision, to_driver, editable)
        for row in self._rows:
            if shown != self._shown or row.is_due:
                row.update(to_driver=to_driver, editable=editable)
        if shown == self._shown:
            return
        self._shown = shown
        path = settings.file.path if to_driver else settings.file.path.name
        self._place.set_text(f"The file is {path}; the next start reads it by: handsteer run --config {path}")
        saved = "as in the file" if settings.file.is_read else "all is as by default"
        self._state.set_text(saved if settings.is_saved else "not saved yet")
        for each in (self._save, self._load, self._reset):
            switch(each, "hidden", on=not editable)
        self._filter()

    def _toolbar(self) -> None:
        with ui.dialog() as dialog, box("card panel question"):
            text("", "Set all parameters to their defaults? The file stays as it is until you save.")
            with box("row"):
                button("Set all to default", dialog.close).on("click", self._reset_all)
                button("Keep", dialog.close)
        with ui.element("section").classes("card panel tools"):
            with box("row"):
                self._search = ui.input(placeholder="Search", on_change=self._filter).classes("search")
                self._search.props('outlined dense clearable type="search" aria-label="Search the parameters"')
                self._only = ui.switch("changed only", on_change=self._filter)
                self._state = text("state", "")
                self._save = button("Save", self._save_file).classes("save")
                self._load = button("Load", self._load_file, "Load what the file says")
                self._reset = button("Reset all", dialog.open, "Set all parameters to their defaults")
            self._place = text("place", "")
            self._message = text("said", "").props('role="status"')

    def _change(self, change: Callable[[], object], done: str = "") -> str | None:
        """Make a change if this viewer may, and show ``done`` or the error message; return the latter, if any."""
        error = None
        if not self._drives():
            error = "only the driver can change settings: ask to drive first"
        else:
            try:
                change()
            except HandsteerError as problem:
                error = str(problem)
        self._message.set_text(error or done)
        switch(self._message, "wrong", on=error is not None)
        return error

    def _save_file(self) -> None:
        done: list[str] = []
        if self._change(lambda: done.append(self._settings.save())) is None:
            self._message.set_text(done[0])

    def _load_file(self) -> None:
        self._change(self._settings.load, f"loaded {self._settings.file.path.name}")

    def _reset_all(self) -> None:
        self._change(
            lambda: self._settings.reset(*(row.field for row in self._rows)), "all is as by default; not saved"
        )

    def _filter(self) -> None:
        words = self._search.value[:_LONGEST_SEARCH] if isinstance(self._search.value, str) else ""
        found: set[str] = set()
        for row in self._rows:
            is_wanted = row.field.matches(words) and (not self._only.value or self._settings.is_changed(row.field))
            switch(row.element, "hidden", on=not is_wanted)
            if is_wanted:
                found.add(row.field.section)
        for section, element in self._cards.items():
            switch(element, "hidden", on=section not in found)
        switch(self._nothing, "hidden", on=bool(found))


class _Row:
    """One parameter: its meaning, its value, and a reset to its default."""

    def __init__(self, field: Field, settings: Settings, change: Callable[[Callable[[], object]], str | None]) -> None:
        self.field = field
        self._settings = settings
        self._change = change
        self._is_edited = False
        self._is_updating = False
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
                self._reset = button("Default", self._to_default, f"Set {field.path} to its default")

    @property
    def is_due(self) -> bool:
        """Whether the value needs to be shown again."""
        return not self._shown

    def update(self, *, to_driver: bool, editable: bool) -> None:
        """Show the value, unless it is being edited."""
        field, settings = self.field, self._settings
        value, default = field.show(field.value_in(settings.wanted), to_driver=to_driver), settings.default(field)
        is_changed, waits = settings.is_changed(field), settings.waits(field)
        shown = (value, default, is_changed, waits, editable)
        if shown == self._shown:
            return
        self._shown = shown
        if not self._is_edited:
            self._is_updating = True  # not a change by the viewer
            if isinstance(self._input, ui.switch):
                self._input.set_value(value == "true")
            else:
                self._input.set_value(value)
            self._is_updating = False
        self._facts.set_text(_facts(field, default))
        switch(self._changed, "hidden", on=not is_changed)
        switch(self._waits, "hidden", on=not waits)
        switch(self._reset, "hidden", on=not (is_changed and editable))
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
            return select.props(f"{_STYLE} options-dense {label}")
        keyboard = 'inputmode="decimal"' if field.kind == "number" else ""
        line = ui.input(validation=self._check).props(f"{_STYLE} {keyboard} {label}")
        line.on("blur", self._take).on("keydown.enter", self._take).on("keydown.escape", self._give_up)
        return line

    @property
    def _text(self) -> str:
        value = self._input.value
        return str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else ""

    @property
    def _is_current(self) -> bool:
        return bool(self._shown) and self._text == self._shown[0]

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

    def _take(self) -> None:
        if self._is_updating:
            return
        if self._is_current:
            self._give_up()
            return
        entered = self._text
        error = self._change(lambda: self._settings.set(self.field, entered))
        self._give_up(error)
        # Invalid text stays to be corrected; an invalid choice returns to the value that is set.
        self._is_edited = error is not None and isinstance(self._input, ui.input)

    def _to_default(self) -> None:
        self._give_up(self._change(lambda: self._settings.reset(self.field)))

    def _give_up(self, error: str | None = None) -> None:
        """End the edit, show ``error``, and then the value that is set."""
        self._is_edited = False
        self._shown = ()
        if not isinstance(self._input, ui.switch):
            self._input.error = error and self._without_name(error)

    def _without_name(self, error: str) -> str:
        return error.removeprefix(self.field.path).removeprefix(": ")


def _facts(field: Field, default: object) -> str:
    allowed = "" if field.kind == "choice" or not field.allowed else f"{field.allowed} {field.unit}".strip()
    when = "takes effect at once" if field.live else "read at the start"
    return " · ".join(part for part in (allowed, f"default {field.show(default) or _NONE}", when) if part)
