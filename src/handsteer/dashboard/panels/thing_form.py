"""A form with the properties of one thing in the world."""

import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments, ValueChangeEventArguments

from handsteer.dashboard.panels.elements import box, switch
from handsteer.robots.world import Box, Cylinder, Sphere, Thing

_DEBOUNCE_MS = 600
_DIGITS = 3


@dataclass(frozen=True)
class Figure:
    """One numeric property of a thing.

    Attributes:
        name: With its unit.
        value: Current value.
        step: Increment of the input's arrows.
        fields: Returns the fields of the world file that set another value.
    """

    name: str
    value: float
    step: float
    fields: Callable[[float], dict[str, Any]]


def figures(thing: Thing) -> list[Figure]:
    """Return all editable figures of ``thing``."""
    x, y = thing.position
    found = [
        Figure("x [m]", x, 0.1, lambda value: {"position": (value, y)}),
        Figure("y [m]", y, 0.1, lambda value: {"position": (x, value)}),
    ]
    match thing:
        case Box(size=(length, width, height)):
            found += [
                Figure("length [m]", length, 0.1, lambda value: {"size": (value, width, height)}),
                Figure("width [m]", width, 0.1, lambda value: {"size": (length, value, height)}),
                Figure("height [m]", height, 0.1, lambda value: {"size": (length, width, value)}),
                Figure("turn [°]", math.degrees(thing.yaw), 15.0, lambda value: {"yaw": math.radians(value)}),
            ]
        case Cylinder():
            found += [
                Figure("radius [m]", thing.radius, 0.05, lambda value: {"radius": value}),
                Figure("height [m]", thing.height, 0.1, lambda value: {"height": value}),
            ]
        case Sphere():
            found.append(Figure("radius [m]", thing.radius, 0.05, lambda value: {"radius": value}))
    return [*found, Figure("mass [kg]", thing.mass, 0.1, lambda value: {"mass": value})]


class ThingForm:
    """Inputs for one thing; calls ``edit`` with its name and the changed fields immediately."""

    def __init__(self, edit: Callable[[str, dict[str, Any]], Awaitable[None]]) -> None:
        self._edit = edit
        self._shown: Thing | None = None
        self._numbers: list[ui.number] = []
        self._box = box("row form")

    def show(self, thing: Thing | None) -> None:
        """Show the current figures of ``thing``, replacing rejected input; nothing for None."""
        before, self._shown = self._shown, thing
        if thing is None:
            self._box.clear()
        elif before is None or (before.name, before.shape) != (thing.name, thing.shape):
            self._build(thing)
        else:  # The inputs are reused, so that the focused one keeps the focus.
            for number, figure in zip(self._numbers, figures(thing), strict=True):
                number.set_value(round(figure.value, _DIGITS))
            self._movable.set_value(thing.movable)
        if thing is not None:
            switch(self._numbers[-1], "off", on=not thing.movable)  # a fixed thing's mass has no effect

    def _build(self, thing: Thing) -> None:
        self._box.clear()
        with self._box:
            self._numbers = [self._number(index, figure) for index, figure in enumerate(figures(thing))]
            with ui.element("label").classes("field"):
                ui.label("colour")
                # An attribute, not a property, which would be set again while the viewer chooses a colour.
                colour = ui.element("input").props(f'type="color" ^value="{thing.colour}"')
                colour.on("change", self._on_colour, js_handler="(event) => emit(event.target.value)")
            self._movable = ui.checkbox("can be pushed", value=thing.movable, on_change=self._on_movable)

    def _number(self, index: int, figure: Figure) -> ui.number:
        async def on_change(event: ValueChangeEventArguments[float | None]) -> None:
            await self._on_number(index, event.value)

        number = ui.number(figure.name, value=round(figure.value, _DIGITS), step=figure.step, on_change=on_change)
        return number.props(f"outlined dense debounce={_DEBOUNCE_MS}")

    async def _on_number(self, index: int, value: float | None) -> None:
        if self._shown is None or value is None:
            return
        figure = figures(self._shown)[index]
        if round(value, _DIGITS) != round(figure.value, _DIGITS):
            await self._edit(self._shown.name, figure.fields(value))

    async def _on_colour(self, event: GenericEventArguments) -> None:
        if self._shown is not None:
            await self._edit(self._shown.name, {"colour": event.args})

    async def _on_movable(self, event: ValueChangeEventArguments[bool | None]) -> None:
        if self._shown is not None and bool(event.value) != self._shown.movable:
            await self._edit(self._shown.name, {"movable": bool(event.value)})
