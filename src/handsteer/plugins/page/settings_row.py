"""A row of the settings page: one parameter."""

from collections.abc import Callable

from nicegui import ui

from handsteer.errors import ConfigError
from handsteer.plugins.page.elements import box, button, identifier, switch, tag, text
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import Field
from handsteer.recognition.profile import profile_names

_NONE = "none"
_STYLE = "outlined dense hide-bottom-space no-error-icon"


class Row:
    """One parameter: its meaning, its value, and a reset to its default.

    Attributes:
        is_found: Whether the search finds it.

    Args:
        change: Makes a change if this viewer may; returns an error message, or an empty text.
    """

    def __init__(self, field: Field, settings: Settings, change: Callable[[Callable[[], object]], str]) -> None:
        self.field = field
        self.is_found = True
        self._settings = settings
        self._change = change
        self._is_edited = False
        self._is_updating = False
        self._shown: tuple[object, ...] = ()
        with box("setting") as self.element:
            with box("about"):
                with box("title"):
                    tag("h3", "name", field.title)
                    identifier("raw", field.path)
                    self._changed = text("mark", "changed")
                    self._waits = text("mark waits", "waits for the next start")
                with box("doc"):
                    tag("span", "", f"{field.text}.")
                    self._facts = tag("span", "facts", "")
            with box("value"):
                self._input = self._make_input()
                self._reset = button("Reset", self._to_default, f"Set {field.path} to its default")

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
        self._facts.set_text(_facts(field, default, is_changed=is_changed))
        switch(self.element, "changed", on=is_changed)
        switch(self._changed, "hidden", on=not is_changed)
        switch(self._waits, "hidden", on=not waits)
        switch(self._reset, "hidden", on=not (is_changed and editable))
        if isinstance(self._input, ui.switch):
            self._input.set_enabled(editable)
        else:
            self._input.props["readonly"] = not editable

    def take(self) -> str:
        """Apply what was entered and is not applied yet; return an error message, or an empty text."""
        return self._take() if self._is_edited else ""

    def drop(self) -> None:
        """Forget what was entered and is not applied yet."""
        if self._is_edited:
            self._give_up()

    def _make_input(self) -> ui.input | ui.select | ui.switch:
        field = self.field
        # Given here, because each value that is set later is a message, for which the browser draws all rows again.
        value = field.show(field.value_in(self._settings.wanted), to_driver=False)
        label = f'aria-label="{field.path}"'
        unit = f'suffix="{field.unit}"' if field.unit else ""
        if field.kind == "switch":
            return ui.switch(value=value == "true", on_change=self._take).props(label)
        if field.kind == "choice":
            options = {**({"": _NONE} if field.optional else {}), **{choice: choice for choice in field.choices}}
            select = ui.select(options, value=value, on_change=self._take).without_auto_validation()
            return select.props(f"{_STYLE} options-dense popup-content-class=identifiers {label}")
        keyboard = 'inputmode="decimal"' if field.kind == "number" else ""
        known = profile_names() if field.path == "signs.profile" else None
        line = ui.input(value=value, validation=self._check, autocomplete=known).props(
            f"{_STYLE} {keyboard} {unit} {label}"
        )
        line.on("blur", self.take).on("keydown.enter", self.take).on("keydown.escape", self._give_up)
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

    def _take(self) -> str:
        if self._is_updating:
            return ""
        if self._is_current:
            self._give_up()
            return ""
        entered = self._text
        error = self._change(lambda: self._settings.set(self.field, entered))
        self._give_up(error)
        # Invalid text stays to be corrected; an invalid choice returns to the value that is set.
        self._is_edited = bool(error) and isinstance(self._input, ui.input)
        return error

    def _to_default(self) -> None:
        self._give_up(self._change(lambda: self._settings.reset(self.field)))

    def _give_up(self, error: str = "") -> None:
        """End the edit, show ``error``, and then the value that is set."""
        self._is_edited = False
        self._shown = ()
        if not isinstance(self._input, ui.switch):
            self._input.error = self._without_name(error) if error else None

    def _without_name(self, error: str) -> str:
        return error.removeprefix(self.field.path).removeprefix(": ").removeprefix(".")


def _facts(field: Field, default: object, *, is_changed: bool) -> str:
    allowed = "" if field.kind == "choice" or not field.allowed else f"{field.allowed} {field.unit}".strip()
    usual = f"default {field.show(default) or _NONE}" if is_changed else ""
    return " · ".join(part for part in (allowed, usual, "" if field.live else "read at the start") if part)
