"""Compares the hand as a joystick with a rival that takes the fist's tilt instead of its movement.

Prints a table of laps for each: python benchmarks/tilt.py. Both have the same grip, response, operator and skill; the
rival's range is what a wrist does comfortably.
"""

import math
from dataclasses import replace
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

from handsteer.config import Config, JoystickConfig
from handsteer.plugins.bench.courses import open_course
from handsteer.plugins.bench.hand_interfaces import CHOICES, PALM_M, Joystick
from handsteer.plugins.bench.hand_view import HandView
from handsteer.plugins.bench.hands import Limb, OperatorsHand, Slips
from handsteer.plugins.bench.laps import KINDS, run_lap
from handsteer.plugins.bench.operator import Skill
from handsteer.plugins.virtual_hand.poses import HandPose, View
from handsteer.recognition.hand_joystick import HandJoystick, deflection
from handsteer.recognition.recognizer import Recognition
from handsteer.types import Stick

COURSES = ("slalom", "stop-line", "parking")
SEEDS = range(20)
FULL_ROLL, FULL_PITCH = math.radians(30), math.radians(30)
RESPONSE = JoystickConfig()
_ROTATION_S = 0.25


class TiltJoystick(HandJoystick):
    """Deflects by the tilt of the fist since it was closed: sideways turns, knuckles to the camera drive forward."""

    def step(self, recognition: Recognition, dt_s: float) -> Stick:
        was_held = self.stick.held
        super().step(recognition, dt_s)
        if not self.stick.held or recognition.hand is None:
            return self.stick
        pixels, world = recognition.hand.pixels[:, :2], recognition.hand.world
        across, up = (pixels[9] - pixels[0]).tolist()
        x, y, z = (world[9] - world[0]).tolist()
        tilt = np.array([math.atan2(across, -up), math.atan2(-z, math.hypot(x, y))])
        if not was_held:
            self._neutral = self._tilt = tilt
        self._tilt = self._tilt + 0.7 * (tilt - self._tilt)
        roll, pitch = (self._tilt - self._neutral).tolist()
        full = RESPONSE.full_deflection
        forward, left = (deflection(full * share, RESPONSE) for share in (pitch / FULL_PITCH, roll / FULL_ROLL))
        self.stick = Stick(True, forward, left)
        return self.stick


class TiltingHand(OperatorsHand):
    """Tilts where others move."""

    def __init__(self, random: np.random.Generator, slips: Slips, choices: tuple[str, ...]) -> None:
        super().__init__(random, slips, choices)
        self._tilt = Limb(2, _ROTATION_S, random)

    def reach(self, offset_m: NDArray[np.float64]) -> None:
        self._tilt.aim(offset_m / (PALM_M * RESPONSE.full_deflection) * np.array([FULL_ROLL, FULL_PITCH]))

    def step(self, dt_s: float) -> None:
        super().step(dt_s)
        self._tilt.step(dt_s)

    def pose(self) -> HandPose:
        pose, (roll, pitch) = super().pose(), self._tilt.place().tolist()
        view = pose.view
        return HandPose(pose.angles, View(view.yaw, view.pitch + pitch, view.roll + roll, view.position))


class Tilt(Joystick):
    """The interface of the rival."""

    def __init__(self, config: Config, skill: Skill, view: HandView, slips: Slips, random: np.random.Generator) -> None:
        super().__init__(config, skill, view, slips, random)
        self.hand = TiltingHand(random, slips, CHOICES)
        view.teleop._pipeline.joystick = TiltJoystick()


def main() -> None:
    KINDS["tilt"] = replace(KINDS["joystick"], make=Tilt)
    print(f"{'course':10} {'by':9} {'time, s':>8} {'bumps':>6} {'missed':>7} {'over, cm':>9} {'timed out':>10}")
    for course in map(open_course, COURSES):
        for interface in ("joystick", "tilt"):
            laps = [run_lap(course, interface, seed) for seed in SEEDS]
            over_m = median(lap.overshoot_m or 0.0 for lap in laps)
            print(
                f"{course.name:10} {interface:9} {median(lap.time_s for lap in laps):8.1f} "
                f"{fmean(lap.bumps for lap in laps):6.2f} {fmean(lap.missed for lap in laps):7.2f} {100 * over_m:9.1f} "
                f"{sum(not lap.finished for lap in laps):10}"
            )


if __name__ == "__main__":
    main()
