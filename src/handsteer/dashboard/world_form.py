"""The inputs of one thing or gate in the world editor."""

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

from handsteer.dashboard.elements import box, switch
from handsteer.robots.editing import numeric_properties
from handsteer.robots.world import Gate, Thing

_DEBOUNCE_MS = 600
_DIGITS = 3


class ThingForm:
    """Inputs for one thing; calls ``edit`` with its name and the changed fields immediately."""

    def __init__(self, edit: Callable[[str, dict[str, Any]], Awaitable[None]]) -> None:
        self._edit = edit
        self._shown: Thing | Gate | None = None
        self._numbers: list[ui.number] = []
        self._box = box("form")

    def show(self, thing: Thing | Gate | None) -> None:
        """Show the current values of ``thing``, replacing rejected input; nothing for None."""
        before, self._shown = self._shown, thing
        if thing is None:
            self._box.clear()
            return
        if before is None or type(before) is not type(thing) or before.name != thing.name:
            self._build(thing)
        else:  # The inputs are reused, so that the focused one keeps the focus.
            for number, each in zip(self._numbers, numeric_properties(thing), strict=True):
                number.set_value(round(each.value, _DIGITS))
            if not isinstance(thing, Gate):
                self._movable.set_value(thing.movable)
        if not isinstance(thing, Gate):
            switch(self._numbers[-1], "off", on=not thing.movable)  # a fixed thing's mass has no effect

    def _build(self, thing: Thing | Gate) -> None:
        self._box.clear()
        with self._box:
            self._numbers = []
            for index, each in enumerate(numeric_properties(thing)):
                number = ui.number(each.name, value=round(each.value, _DIGITS), step=each.step)
                number.on_value_change(lambda event, index=index: self._on_number(index, event.value))
                self._numbers.append(number.props(f"outlined dense debounce={_DEBOUNCE_MS}"))
            if isinstance(thing, Gate):
                return
            with ui.element("label").classes("field"):
                ui.label("colour")
                # An attribute, not a property, which would be set again while the viewer chooses a colour.
                colour = ui.element("input").props(f'type="color" ^value="{thing.colour}"')
                colour.on("change", lambda event: self._on_field("colour", event.args), js_handler=_EMIT_VALUE)
            self._movable = ui.checkbox("can be pushed", value=thing.movable)
            self._movable.on_value_change(lambda event: self._on_field("movable", bool(event.value)))

    async def _on_number(self, index: int, value: float | None) -> None:
        if self._shown is None or value is None:
            return
        each = numeric_properties(self._shown)[index]
        if round(value, _DIGITS) != round(each.value, _DIGITS):
            await self._edit(self._shown.name, each.fields(value))

    async def _on_field(self, name: str, value: object) -> None:
        if self._shown is not None and value != getattr(self._shown, name):
            await self._edit(self._shown.name, {name: value})


_EMIT_VALUE = "(event) => emit(event.target.value)"
