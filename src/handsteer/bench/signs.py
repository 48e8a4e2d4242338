"""Driving by hand signs: which sign a practised operator shows, and the hand, recognition and control behind it."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from handsteer.bench.hands import HandCamera, HandLandmarker, LandmarkErrors, OperatorsHand, Slips, blank_picture
from handsteer.bench.interfaces import TICK_S
from handsteer.bench.operator import Skill
from handsteer.config import Config, ControlConfig
from handsteer.control.sign_control import SignControl
from handsteer.hand.poses import Pinhole
from handsteer.recognition.recognizer import Recognizer
from handsteer.teleop import Teleop
from handsteer.types import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT, ZERO, Velocity

Through = Literal["landmarks", "pictures"]
"""Whether the hand's landmarks are given with errors, or found by the landmark models in rendered pictures."""

HAND_S = 0.06
"""Delay from the hand to the robot: a webcam's exposure and transfer (50 ms), recognition and control (10 ms)."""

CHOICES = (FORWARD, BACKWARD, TURN_LEFT, TURN_RIGHT, GO, STOP)

_STEP_S, _STEPS = 0.1, 10
_DURATIONS = (1, 3, _STEPS)
_CHANGE_STEPS = 2
_PATIENCE_S = 0.3
_LINEAR_MPS, _ANGULAR_RADPS = 0.15, 0.5


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

    def best(self, shown: str, now: Velocity, wanted: Velocity) -> str:
        """Return the sign to show.

        Args:
            shown: The sign that is shown.
            now: The velocity that is commanded.
            wanted: The velocity that is wanted.
        """
        if wanted.is_zero:
            return STOP
        stay = min(self._cost(self._plan(shown, shown, steps), now, wanted) for steps in _DURATIONS[1:])
        best, least = shown, stay * (1.0 - 0.5 * self._reluctance) - 0.1 * self._reluctance
        for sign in CHOICES:
            if sign == shown:
                continue
            for first in (sign, GO) if GO not in (shown, sign) else (sign,):
                for steps in _DURATIONS:
                    cost = self._cost(self._plan(shown, sign, steps, first), now, wanted, least)
                    if cost < least:
                        best, least = first, cost
        return best

    def _plan(self, shown: str, sign: str, steps: int, first: str | None = None) -> list[str]:
        """Return the sign that counts in each step: ``sign`` for so many steps, through ``first``, and then ``Go``."""
        plan: list[str] = []
        before = shown
        for target in ([] if first in (None, sign) else [first or sign]) + [sign]:
            if target != before:
                plan += [before, GO if GO in (before, target) else NONE][:_CHANGE_STEPS]
                before = target
        plan += [sign] * steps
        if len(plan) < _STEPS and sign != GO:
            plan += [sign if sign == STOP else GO] * (_STEPS - len(plan))
        return (plan + [plan[-1]] * _STEPS)[:_STEPS]

    def _cost(self, plan: Sequence[str], now: Velocity, wanted: Velocity, most: float = math.inf) -> float:
        """Return the mean difference from what is wanted; infinity if it is above ``most``."""
        rule, cost = self._rule, 0.0
        rule.step(GO, 0.0)
        rule.velocity = now
        for sign in plan:
            after = rule.step(sign, _STEP_S) or ZERO
            cost += ((after.linear_mps - wanted.linear_mps) / _LINEAR_MPS) ** 2
            cost += ((after.angular_radps - wanted.angular_radps) / _ANGULAR_RADPS) ** 2
            if cost > most * len(plan):
                return math.inf
        return cost / len(plan)


class HandView:
    """The operator's hand in front of the camera, and what recognition and control make of it.

    Args:
        config: All parameters; ``camera`` has size and frame rate.
        through: How the hand is seen.
        errors: Errors of landmarks, unless through pictures.
        seed: Of background, noise and errors.
    """

    def __init__(self, config: Config, through: Through, errors: LandmarkErrors, seed: int) -> None:
        camera = Pinhole.webcam(config.camera.width, config.camera.height)
        self._landmarker = HandLandmarker(camera, errors, np.random.default_rng([seed, 2]))
        self._pictures = HandCamera(camera, seed) if through == "pictures" else None
        self.teleop = Teleop(config, Recognizer(config, landmarker=None if self._pictures else self._landmarker))
        self._period_s = 1.0 / config.camera.fps
        self._frames = 0
        self._ticks, self._last = 0, 0

    def step(self, hand: OperatorsHand) -> Velocity | None:
        """Advance time by one tick; return the velocity of a new frame, None if none is due."""
        self._ticks += 1
        if self._ticks * TICK_S + 1e-9 < self._frames * self._period_s:
            return None
        since_s, self._last = (self._ticks - self._last) * TICK_S, self._ticks
        self._frames += 1
        pose = self._landmarker.pose = hand.pose()
        pictures = self._pictures
        image = pictures.picture(pose, self._ticks * TICK_S) if pictures else blank_picture(self._frames)
        return self.teleop.step(image, since_s)


class Signs:
    """Hand signs with one of the control's rules.

    Args:
        config: All parameters.
        skill: Of the operator.
        view: The hand as it is seen.
        slips: How often the operator errs.
        random: Source of times, slips and tremor.
    """

    def __init__(self, config: Config, skill: Skill, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        self.delay_s = HAND_S
        self._hand = OperatorsHand(random, slips, CHOICES)
        self._view = view
        self._choice = SignChoice(config.control, config.camera.fps, skill.reluctance)
        self._commanded = ZERO
        self._shown_s = 0.0
        self._calls = 0

    @property
    def changes(self) -> int:
        """How often the sign has changed."""
        return self._hand.changes

    def want(self, wanted: Velocity) -> None:
        """Choose a sign, ten times a second; a sign that has just been begun is shown first, unless it is to stop."""
        self._calls += 1
        if self._calls % 2:
            return
        sign = self._choice.best(self._hand.intended, self._commanded, wanted)
        if sign != self._hand.intended and (self._shown_s >= _PATIENCE_S or sign == STOP):
            self._hand.show(sign)
            self._shown_s = 0.0

    def step(self) -> Velocity | None:
        """Advance time by one tick; return the command of a new frame."""
        self._shown_s += TICK_S
        self._hand.step(TICK_S)
        velocity = self._view.step(self._hand)
        if velocity is not None:
            self._commanded = velocity
        return velocity
