"""Driving with the hand in front of a camera: by signs, or as a joystick."""

import copy
import math
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from handsteer.config import Config, ControlConfig, JoystickConfig
from handsteer.control.pointing import IN_A_CURVE
from handsteer.control.sign_control import SignControl
from handsteer.plugins.bench.hand_view import HandView
from handsteer.plugins.bench.hands import OperatorsHand, Slips
from handsteer.plugins.bench.interfaces import REFRACTORY_S, TICK_S
from handsteer.plugins.bench.operator import DECISION_S, Skill
from handsteer.plugins.virtual_hand.kinematics import BONE_LENGTHS_M
from handsteer.plugins.virtual_hand.poses import sign_pose
from handsteer.recognition.hand_joystick import deflection
from handsteer.recognition.pointing import SLOWEST, height_deflection, tilt_deflection
from handsteer.types import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT, ZERO, Velocity

HAND_S = 0.06
"""Delay from the hand to the robot: a webcam's exposure and transfer (50 ms), recognition and control (10 ms)."""

CHOICES = (FORWARD, BACKWARD, TURN_LEFT, TURN_RIGHT, GO, STOP)

_STEP_S, _STEPS = 0.1, 10
_DURATIONS = (1, 3, _STEPS)
_PATIENCE_S = 0.3
_LINEAR_MPS, _ANGULAR_RADPS = 0.15, 0.5

_LOOKS_S, _LEARNS, _TRIM_RAD = 0.4, 0.1, 0.2
_TURNS_MPS = 0.05
# Below, the palm is shown: it takes 0.2 s to be shown and confirmed.
_ENDS_MPS = 0.24
_FRAME_M = 0.46

_OPEN_S = 0.45
PALM_M = float(BONE_LENGTHS_M[[4, 8, 12, 16]].mean())
"""Length of the operator's palm."""


class SignChoice:
    """Chooses the sign to show: the one whose effect in the next second is nearest to what is wanted.

    A practised operator knows the rule of the control, that a sign takes 0.2 s to be shown and confirmed, and that
    between two signs the robot is stopped unless one of them is the fist, to which fingers close without another shape
    between (measured in pictures). So plans are: keep the sign, or change to another one, directly or through the fist;
    each for 0.1, 0.3 or 1 s, and then ``Go``.

    Args:
        config: Rule of the control.
        fps: Signs per second.
        reluctance: By how much a change must be better than to continue, relative.
    """

    def __init__(self, config: ControlConfig, fps: float, reluctance: float) -> None:
        if config.ramp == "per_message":
            config = config.model_copy(
                update={
                    "ramp": "per_second",
                    "linear_acceleration": config.linear_step * fps,
                    "angular_acceleration": config.angular_step * fps,
                }
            )
        self._rule = SignControl(config)
        self._reluctance = reluctance

    def note(self, sign: str, dt_s: float) -> None:
        """Take the sign that counted in the last ``dt_s`` seconds, so that the effect of the next ones is known."""
        self._rule.step(sign, dt_s)

    def hold_back(self, velocity: Velocity) -> None:
        """Take the velocity that the robot got instead."""
        self._rule.hold_back(velocity)

    def best(self, shown: str, wanted: Velocity) -> str:
        """Return the sign to show.

        Args:
            shown: The sign that is shown.
            wanted: The velocity that is wanted.
        """
        if wanted.is_zero:
            return STOP
        stay = min(self._cost(_plan(shown, shown, steps), wanted) for steps in _DURATIONS[1:])
        best, least = shown, stay * (1.0 - 0.5 * self._reluctance) - 0.1 * self._reluctance
        for sign in CHOICES:
            if sign == shown:
                continue
            for first in (sign, GO) if GO not in (shown, sign) else (sign,):
                for steps in _DURATIONS:
                    cost = self._cost(_plan(shown, sign, steps, first), wanted, least)
                    if cost < least:
                        best, least = first, cost
        return best

    def _cost(self, plan: Sequence[str], wanted: Velocity, most: float = math.inf) -> float:
        """Return the mean difference from what is wanted; infinity if it is above ``most``."""
        rule, cost = copy.copy(self._rule), 0.0
        for sign in plan:
            after = rule.step(sign, _STEP_S) or ZERO
            cost += ((after.linear_mps - wanted.linear_mps) / _LINEAR_MPS) ** 2
            cost += ((after.angular_radps - wanted.angular_radps) / _ANGULAR_RADPS) ** 2
            if cost > most * len(plan):
                return math.inf
        return cost / len(plan)


@cache
def _plan(shown: str, sign: str, steps: int, first: str | None = None) -> tuple[str, ...]:
    """Return the sign that counts in each step: ``sign`` for so many steps, through ``first``, and then ``Go``."""
    plan: list[str] = []
    before = shown
    for target in (*(() if first in (None, sign) else (str(first),)), sign):
        if target != before:
            plan += [before, GO if GO in (before, target) else NONE]
            before = target
    plan += [sign] * steps
    if len(plan) < _STEPS and sign != GO:
        plan += [sign if sign == STOP else GO] * (_STEPS - len(plan))
    return tuple((plan + [plan[-1]] * _STEPS)[:_STEPS])


class ByHand:
    """What interfaces with a hand in front of the camera share.

    Args:
        view: The hand as it is seen.
        slips: How often the operator errs.
        random: Source of times, slips and tremor.

    Attributes:
        hand: The operator's hand.
    """

    def __init__(self, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        self.delay_s = HAND_S
        self.hand = OperatorsHand(random, slips, CHOICES)
        self._view = view
        self._moves = 0

    @property
    def changes(self) -> int:
        """How often the sign, or the aim of the hand, has changed."""
        return self.hand.changes + self._moves

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``."""
        self._view.teleop.hold_back(velocity)


class Signs(ByHand):
    """Hand signs with one of the control's rules.

    Args:
        config: All parameters.
        skill: Of the operator.
        view: The hand as it is seen.
        slips: How often the operator errs.
        random: Source of times, slips and tremor.
    """

    def __init__(self, config: Config, skill: Skill, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        super().__init__(view, slips, random)
        self._choice = SignChoice(config.control, config.camera.fps, skill.reluctance)
        self._shown_s = 0.0
        self._calls = 0

    def want(self, wanted: Velocity) -> None:
        """Choose a sign, ten times a second; a sign that has just been begun is shown first, unless it is to stop."""
        self._calls += 1
        if self._calls % 2:
            return
        sign = self._choice.best(self.hand.intended, wanted)
        if sign != self.hand.intended and (self._shown_s >= _PATIENCE_S or sign == STOP):
            self.hand.show(sign)
            self._shown_s = 0.0

    def step(self) -> Velocity | None:
        """Advance time by one tick; return the command of a new frame."""
        self._shown_s += TICK_S
        self.hand.step(TICK_S)
        velocity = self._view.step(self.hand)
        if velocity is not None:
            self._choice.note(self._view.sign, self._view.since_s)
        return velocity

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, as the operator sees."""
        super().hold_back(velocity)
        self._choice.hold_back(velocity)


class Joystick(ByHand):
    """The hand as a joystick: a fist that moves from where it was closed; arguments as for :class:`Signs`.

    The operator opens the hand and closes it to hold the joystick, and again whenever it was lost; a stop is neutral.
    """

    def __init__(self, config: Config, skill: Skill, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        super().__init__(view, slips, random)
        self._limits = config.control.max_linear, config.control.max_angular
        self._config = config.joystick
        self._least = 0.1 * skill.reluctance
        self._aim = (0.0, 0.0)
        self._since_s = self._shown_s = 0.0
        self._was_held = False

    def want(self, wanted: Velocity) -> None:
        """Move the fist, if it is held and the change is worth it; else hold it first."""
        self._since_s += DECISION_S
        self._shown_s += DECISION_S
        is_held, self._was_held = self._view.teleop.stick.held, self._was_held or self._view.teleop.stick.held
        if not is_held:
            self._grab()
            return
        shares = wanted.linear_mps / self._limits[0], wanted.angular_radps / self._limits[1]
        aim = max(-1.0, min(1.0, shares[0])), max(-1.0, min(1.0, shares[1]))
        is_small = math.dist(aim, self._aim) < self._least and not wanted.is_zero
        if self._since_s < REFRACTORY_S - 1e-9 or aim == self._aim or is_small:
            return
        self._aim, self._since_s = aim, 0.0
        self._moves += 1
        forward, left = (moved_for(share, self._config) * PALM_M for share in aim)
        # The camera is in front of the person: the person's left is the image's right.
        self.hand.reach(np.array([left, -forward]))

    def step(self) -> Velocity | None:
        """Advance time by one tick; return the command of a new frame."""
        self.hand.step(TICK_S)
        return self._view.step(self.hand)

    def _grab(self) -> None:
        """Open the hand, back at its place, and then close it; and again if it is not held a second later."""
        self._aim = (0.0, 0.0)
        if self.hand.intended == STOP:
            if self._shown_s >= _OPEN_S:
                self.hand.show(GO)
                self._shown_s = 0.0
        elif self.hand.intended == NONE or self._shown_s >= 1.0 or self._was_held:
            self.hand.reach(np.zeros(2))
            self.hand.show(STOP)
            self._shown_s = 0.0
        self._was_held = False


class Point(ByHand):
    """The index finger points where to go (``control.rule: point``); arguments as for :class:`Signs`.

    The top speed is set once, to the operator's pace, as with the pad.
    """

    def __init__(self, config: Config, skill: Skill, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        super().__init__(view, slips, random)
        self._control, self._sticks = config.control, config.joystick
        self._least = 0.1 * skill.reluctance
        self._now, self._fast = ZERO, 0.0
        self._before_mps = 0.0
        self._aim = self._trim_rad = 0.0
        self._since_s = self._shown_s = math.inf

    def want(self, wanted: Velocity) -> None:
        """Point along the arc, if the change is worth it."""
        self._since_s += DECISION_S
        self._shown_s += DECISION_S
        sign = self._sign_for(wanted)
        if sign != self.hand.intended and (self._shown_s >= _PATIENCE_S or sign == STOP):
            self.hand.show(sign)
            self._shown_s, self._fast = 0.0, math.inf
        self._learn()
        if self.hand.intended not in (FORWARD, BACKWARD) or sign != self.hand.intended:
            self._aim = 0.0
            self.hand.turn(0.0)
            return
        share = self._share_for(wanted)
        full = self._control.max_linear * (1.0 - IN_A_CURVE * abs(share))
        fast = min(1.0, max(SLOWEST, abs(wanted.linear_mps) / full))
        is_small = math.dist((share, fast), (self._aim, self._fast)) < self._least
        if is_small or self._since_s < REFRACTORY_S - 1e-9:
            return
        self._aim, self._fast, self._since_s = share, fast, 0.0
        self._moves += 1
        # The finger's left is the image's right, and clockwise turns it there from up, and away from it from down.
        self.hand.turn(math.radians(tilt_for(share, self._sticks)) + self._trim_rad)
        sticks = self._sticks
        y = height_for(fast, sticks)
        self.hand.reach(np.array([0.0, (y - 0.5) * _FRAME_M - sign_pose(sign).view.position[1]]))

    def _learn(self) -> None:
        """Correct the finger by the arc that the page draws: its direction differs from the hand's by some degrees."""
        stick = self._view.teleop.stick
        if not (stick.forward and stick.left) or self._since_s < _LOOKS_S or self._shown_s < 2 * _LOOKS_S:
            return
        shown = tilt_for(stick.left, self._sticks)
        off = tilt_for(self._aim, self._sticks) - shown
        self._trim_rad = max(-_TRIM_RAD, min(self._trim_rad + _LEARNS * math.radians(off), _TRIM_RAD))

    def step(self) -> Velocity | None:
        """Advance time by one tick; return the command of a new frame."""
        self.hand.step(TICK_S)
        velocity = self._view.step(self.hand)
        if velocity is not None:
            self._now = velocity
        return velocity

    def _sign_for(self, wanted: Velocity) -> str:
        """Return the sign after which the robot's speed is soon nearest to what is wanted."""
        linear, angular = wanted.linear_mps, wanted.angular_radps
        if wanted.is_zero:
            return STOP
        if abs(linear) < _TURNS_MPS:
            return TURN_LEFT if angular > 0.0 else TURN_RIGHT if angular < 0.0 else STOP
        way, now = (FORWARD if linear > 0.0 else BACKWARD), self._now.linear_mps
        slows, self._before_mps = abs(linear) < abs(self._before_mps), linear
        is_ending = slows and abs(linear) < _ENDS_MPS and way == self.hand.intended
        return STOP if now * linear < 0.0 or is_ending else way

    def _share_for(self, wanted: Velocity) -> float:
        """Return the deflection to the left for the arc of ``wanted``, -1 to 1, as the finger is tilted."""
        fastest = self._control.max_linear
        arc = wanted.angular_radps / max(abs(wanted.linear_mps), 1e-6) * fastest / self._control.point_turn
        share = arc / (1.0 + IN_A_CURVE * abs(arc))
        return max(-1.0, min(1.0, share))


def height_for(share: float, config: JoystickConfig) -> float:
    """Return the height of the palm, 0 (top) to 1 of the picture, whose deflection is ``share``, above 0 to 1."""
    return _found(lambda y: height_deflection(y, config), config.slow_at, config.fast_at, share)


def tilt_for(share: float, config: JoystickConfig) -> float:
    """Return the tilt in degrees whose deflection is ``share``, -1 to 1."""
    tilt = _found(lambda deg: tilt_deflection(deg, config), config.tilt_dead_zone, config.full_tilt, abs(share))
    return math.copysign(tilt, share) if share else 0.0


def moved_for(share: float, config: JoystickConfig) -> float:
    """Return the movement, in palm lengths, whose deflection is ``share``, -1 to 1."""
    moved = _found(lambda way: deflection(way, config), config.dead_zone, config.full_deflection, abs(share))
    return math.copysign(moved, share) if share else 0.0


def _found(deflection_of: Callable[[float], float], least: float, most: float, share: float) -> float:
    """Return the value between those of the least and the most deflection at which it is ``share``, by bisection."""
    for _ in range(20):
        middle = (least + most) / 2
        least, most = (middle, most) if deflection_of(middle) < share else (least, middle)
    return most
