"""What the world editor is used by: the plan of the world from above, and the inputs of the chosen thing or gate."""

import math
from collections.abc import Awaitable, Callable
from typing import Any, Literal, get_args

from nicegui import ui

from handsteer.plugins.page.editing import Place, Section, heading, numeric_properties, place
from handsteer.plugins.page.elements import STATIC, box, switch
from handsteer.robots.world import Gate, Thing, World
from handsteer.types import Pose2D

Tool = Literal["move", "wall", "gate"]
"""What a press on the plan begins: moving a thing or the plan, or drawing."""

Bounds = tuple[float, float, float, float]
"""x and y of the corner with the smallest coordinates, and the extent along x and y, in metres."""

_MARGIN_M = 0.8
_SMALLEST_M = 5.0


class WorldPlan(ui.element, component=STATIC / "plan.js"):
    """Shows a world from above, +y up; emits ``pick``, ``drop``, ``draw`` and ``key``."""

    def __init__(self) -> None:
        super().__init__()
        self._props["label"] = "The world from above"
        self._pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self.choose(None)
        self.use("move")
        self.snap(on=True)
        self.show(World(), fit=True)

    def show(self, world: World, *, fit: bool = False) -> None:
        """Draw ``world``; what is in view grows to contain it, and with ``fit`` also shrinks."""
        around = bounds(world)
        self._props["things"] = [_thing(each) for each in world.obstacles]
        self._props["gates"] = [_gate(each) for each in world.gates]
        self._props["bounds"] = list(around if fit else union(tuple(self._props["bounds"]), around))
        self.update()

    def choose(self, chosen: tuple[Section, int] | None) -> None:
        """Mark a thing or gate by its index, or none."""
        self._props["chosen"] = list(chosen) if chosen else None
        self.update()

    def use(self, tool: Tool) -> None:
        """Let the next press begin what ``tool`` does."""
        self._props["tool"] = tool
        self.update()

    def snap(self, *, on: bool) -> None:
        """Snap to 0.1 m and 15 degrees, or not."""
        self._props["snap"] = on
        self.update()

    def go(self, robot: Pose2D) -> None:
        """Show the robot at this pose."""
        pose = round(robot.x, 2), round(robot.y, 2), round(math.degrees(robot.yaw), 0)
        if pose != self._pose:
            self._pose = pose
            self.run_method("go", *pose)


def bounds(world: World) -> Bounds:
    """Return what contains all things and gates of ``world`` and the robot's start, with a margin."""
    boxes = [(thing.position, _half(thing)) for thing in world.obstacles]
    boxes += [(point, (0.0, 0.0)) for gate in world.gates for point in (gate.left, gate.right)]
    boxes.append(((0.0, 0.0), (0.4, 0.4)))
    low_x, low_y = (min(at[axis] - half[axis] for at, half in boxes) - _MARGIN_M for axis in (0, 1))
    high_x, high_y = (max(at[axis] + half[axis] for at, half in boxes) + _MARGIN_M for axis in (0, 1))
    more_x, more_y = max(0.0, _SMALLEST_M - high_x + low_x), max(0.0, _SMALLEST_M - high_y + low_y)
    return low_x - more_x / 2, low_y - more_y / 2, high_x - low_x + more_x, high_y - low_y + more_y


def union(one: Bounds, other: Bounds) -> Bounds:
    """Return what contains both."""
    low_x, low_y = min(one[0], other[0]), min(one[1], other[1])
    high_x, high_y = max(one[0] + one[2], other[0] + other[2]), max(one[1] + one[3], other[1] + other[3])
    return low_x, low_y, high_x - low_x, high_y - low_y


def read_tool(sent: object) -> Tool | None:
    """Return the tool that a browser sent; None if there is no such."""
    return next((tool for tool in get_args(Tool) if tool == sent), None)


def _half(thing: Thing) -> Place:
    """Return half of the extent of ``thing`` along x and y, in metres."""
    length, width, _ = thing.extent
    if thing.shape != "box":
        return length / 2, length / 2
    cosine, sine = abs(math.cos(thing.yaw)), abs(math.sin(thing.yaw))
    return (cosine * length + sine * width) / 2, (sine * length + cosine * width) / 2


def _thing(thing: Thing) -> dict[str, Any]:
    length, width, _ = thing.extent
    (x, y), turn = thing.position, round(math.degrees(thing.yaw), 2)
    shown = {"name": thing.name, "shape": thing.shape, "colour": thing.colour, "x": x, "y": y, "turn": turn}
    return {**shown, "length": length, "width": width}


def _gate(gate: Gate) -> dict[str, Any]:
    x, y = place(gate)
    turn, width = math.degrees(heading(gate)), math.dist(gate.left, gate.right)
    return {"x": x, "y": y, "turn": round(turn, 2), "width": width}


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
            switch(self._numbers[-1], "hidden", on=not thing.movable)  # a fixed thing's mass has no effect

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
            self._movable.on_value_change(lambda event: self._on_field("movable", event.value))

    async def _on_number(self, index: int, value: float | None) -> None:
        if self._shown is None or value is None or not math.isfinite(value):
            return
        each = numeric_properties(self._shown)[index]
        if round(value, _DIGITS) != round(each.value, _DIGITS):
            await self._edit(self._shown.name, each.fields(value))

    async def _on_field(self, name: str, value: object) -> None:
        now = getattr(self._shown, name, None)  # a gate has neither field
        if self._shown is not None and now is not None and isinstance(value, type(now)) and value != now:
            await self._edit(self._shown.name, {name: value})


_EMIT_VALUE = "(event) => emit(event.target.value)"
