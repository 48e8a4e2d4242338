"""What operators drive with: the page's pad, keys and sliders, a gamepad, and the base of all interfaces.

Each turns the velocity that an operator wants into acts, and acts into commands, as the product does: the page sends
ten times a second while pad, keys or sliders are in use, and the control applies its limits and timeouts.
"""

import math
from typing import Protocol

import numpy as np

from handsteer.config import ControlConfig
from handsteer.control import Control
from handsteer.plugins.bench.hands import Limb
from handsteer.plugins.bench.operator import DECISION_S, Skill
from handsteer.types import ZERO, Velocity

TICK_S = 0.01
"""Time of one step of an interface, and of the physics."""

PAGE_S = 0.02
"""Delay from the browser to the robot, without a network between: event, server, control."""

_PAGE_PERIOD_S = 0.1
_TURN_PER_SPEED = 2.0
_SLOWEST_TOP_MPS, _FASTEST_TOP_MPS = 0.3, 1.0
_REST = 0.03

REFRACTORY_S = 0.2
"""People begin no further correction of a movement for this long (P. Gawthrop et al., Biol. Cybern. 104, 2011)."""


class Interface(Protocol):
    """Turns the velocity that an operator wants into commands.

    Attributes:
        delay_s: Time from an act to the command at the robot, in seconds.
    """

    delay_s: float

    @property
    def changes(self) -> int:
        """How often the operator has changed the act so far."""
        ...

    def want(self, wanted: Velocity) -> None:
        """Take the velocity that the operator wants.

        It is called every :data:`~handsteer.plugins.bench.operator.DECISION_S`.
        """
        ...

    def step(self) -> Velocity | None:
        """Advance time by :data:`TICK_S`; return the velocity that is commanded now, None if there is no new one."""
        ...

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, which an assist lets through."""
        ...


class _Page:
    """Sends a velocity at the page's rate while in use, and lets the control process it; see :class:`Interface`."""

    period_s = _PAGE_PERIOD_S

    def __init__(self, config: ControlConfig) -> None:
        self.changes = 0
        self.delay_s = PAGE_S
        self._control = Control(config, arming=False)
        self._next_s = 0.0
        self._is_held = False

    def step(self) -> Velocity | None:
        """Advance time by one tick; return the command, if there is a new one."""
        velocity = self._move()
        self._next_s -= TICK_S
        is_pressed, self._is_held = velocity is not None and not self._is_held, velocity is not None
        if velocity is None:
            # Releasing is sent at once, as a zero; afterwards nothing is.
            released, self._next_s = self._next_s > -math.inf, -math.inf
            return self._control.step(TICK_S, steering=ZERO if released else None)
        if is_pressed or self._next_s <= 1e-9:
            self._next_s = self.period_s
            return self._control.step(TICK_S, steering=velocity)
        return self._control.step(TICK_S)

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``."""
        self._control.hold_back(velocity)

    def _move(self) -> Velocity | None:
        """Advance the hand by one tick; return the velocity it holds, None if it holds none."""
        raise NotImplementedError


class Pad(_Page):
    """The page's drive pad, dragged with a mouse or a finger; its top speed is set once, to the operator's pace."""

    movement_s = 0.22

    def __init__(self, config: ControlConfig, skill: Skill, random: np.random.Generator) -> None:
        super().__init__(config)
        self._top_mps = top_speed(skill)
        self._least = 0.1 * skill.reluctance
        self._thumb = Limb(2, self.movement_s, random)
        self._aim = np.zeros(2)
        self._is_in_use = False
        self._since_s = math.inf

    def want(self, wanted: Velocity) -> None:
        """Move the knob, if the change is worth it."""
        aim = np.array([wanted.linear_mps, wanted.angular_radps / _TURN_PER_SPEED]) / self._top_mps
        aim /= max(1.0, float(np.hypot(*aim)))
        is_in_use = not wanted.is_zero
        self._since_s += DECISION_S
        if self._since_s < REFRACTORY_S - 1e-9:
            return
        if is_in_use == self._is_in_use and float(np.hypot(*(aim - self._aim))) < self._least:
            return
        self.changes += 1
        self._since_s = 0.0
        self._aim, self._is_in_use = aim, is_in_use
        self._thumb.aim(aim)

    def _move(self) -> Velocity | None:
        self._thumb.step(TICK_S)
        place = self._thumb.place()
        place = place / max(1.0, float(np.hypot(*place)))
        if not self._is_in_use and float(np.hypot(*place)) < _REST:
            return None
        forward, left = place.tolist()
        return Velocity(forward * self._top_mps, left * self._top_mps * _TURN_PER_SPEED)


class Gamepad(Pad):
    """A stick under the thumb: the pad's scale, quicker to move, and sent twenty times a second."""

    period_s = 0.05
    movement_s = 0.16


class Keys(_Page):
    """The keys W, A, S and D, or the arrows: pressed for as long as it takes to make up for what is missing."""

    _PRESS_S, _LEAST_S = 0.08, 0.1

    def __init__(self, config: ControlConfig, skill: Skill, random: np.random.Generator) -> None:
        super().__init__(config)
        self._top_mps = top_speed(skill)
        self._random = random
        self._owed = [0.0, 0.0]
        self._least = (0.12 * skill.reluctance, 0.3 * skill.reluctance)
        self._pressed, self._next = [0, 0], [0, 0]
        self._due_s = [math.inf, math.inf]
        self._held_s = [0.0, 0.0]

    def want(self, wanted: Velocity) -> None:
        """Decide which keys to press."""
        x, y = self._deflection()
        does = (x * self._top_mps, y * self._top_mps * _TURN_PER_SPEED)
        for axis, value in enumerate((wanted.linear_mps, wanted.angular_radps)):
            least = self._least[axis]
            if wanted.is_zero:
                self._owed[axis] = 0.0
            owed = self._owed[axis] + (value - does[axis]) * DECISION_S
            self._owed[axis] = max(-2 * least, min(2 * least, owed))
            key = self._next[axis]
            if key == 0 and abs(owed) > least:
                self._press(axis, int(math.copysign(1, owed)))
            elif key != 0 and owed * key <= 0.0 and self._held_s[axis] >= self._LEAST_S:
                self._press(axis, 0)

    def _press(self, axis: int, key: int) -> None:
        self.changes += 1
        self._next[axis] = key
        self._due_s[axis] = self._PRESS_S * (1 + 0.2 * float(self._random.standard_normal()))

    def _deflection(self) -> tuple[float, float]:
        length = max(1.0, math.hypot(*self._pressed))
        return self._pressed[0] / length, self._pressed[1] / length

    def _move(self) -> Velocity | None:
        for axis in range(2):
            self._due_s[axis] -= TICK_S
            self._held_s[axis] += TICK_S
            if self._due_s[axis] <= 0.0:
                self._due_s[axis], self._held_s[axis] = math.inf, 0.0
                self._pressed[axis] = self._next[axis]
        if not any(self._pressed):
            return None
        forward, left = self._deflection()
        return Velocity(forward * self._top_mps, left * self._top_mps * _TURN_PER_SPEED)


class Sliders(_Page):
    """The page's two sliders, which stay where they are set; one mouse moves one of them at a time."""

    _STEP = 0.05
    _LIMITS = (0.5, 1.0)
    _REACH_S, _BUTTON_S = (0.45, 0.75), 0.35

    def __init__(self, config: ControlConfig, skill: Skill, random: np.random.Generator) -> None:
        super().__init__(config)
        self._random = random
        self._values = [0.0, 0.0]
        self._least = (0.08 * skill.reluctance, 0.25 * skill.reluctance)
        self._moves: tuple[int, float] | None = None
        self._due_s = 0.0
        self._wanted = [0.0, 0.0]

    def want(self, wanted: Velocity) -> None:
        """Begin to move the slider that is further off, if one is and no other is being moved."""
        given = (wanted.linear_mps, wanted.angular_radps)
        self._wanted = [max(-most, min(most, value)) for value, most in zip(given, self._LIMITS, strict=True)]
        if self._moves is not None:
            return
        if wanted.is_zero and any(self._values):
            self._begin(2, self._BUTTON_S)  # the button "Both to 0"
            return
        gaps = [
            abs(value - now) / least for value, now, least in zip(self._wanted, self._values, self._least, strict=True)
        ]
        if max(gaps) > 1.0:
            self._begin(int(np.argmax(gaps)), float(self._random.uniform(*self._REACH_S)))

    def _begin(self, slider: int, time_s: float) -> None:
        self.changes += 1
        self._moves, self._due_s = (slider, 0.0), time_s

    def _move(self) -> Velocity | None:
        self._due_s -= TICK_S
        if self._moves is not None and self._due_s <= 0.0:
            slider = self._moves[0]
            if slider == 2:
                self._values = [0.0, 0.0]
            else:
                spread = 0.5 * self._STEP * float(self._random.standard_normal())
                self._values[slider] = round((self._wanted[slider] + spread) / self._STEP) * self._STEP
            self._moves = None
        return Velocity(*self._values) if any(self._values) else None


def top_speed(skill: Skill) -> float:
    """Return the top speed to set on the page, in its steps of 0.1 m/s."""
    return min(_FASTEST_TOP_MPS, max(_SLOWEST_TOP_MPS, math.ceil(10 * skill.pace_mps - 1e-9) / 10))
