"""Where the hand points, as a stick: the index finger's direction is the robot's, thumbs turn it in place."""

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.config import JoystickConfig
from handsteer.recognition.features import PALM, directions
from handsteer.recognition.filters import OneEuro
from handsteer.recognition.hand import Hand
from handsteer.recognition.hand_joystick import response
from handsteer.recognition.recognizer import Recognition
from handsteer.types import BACKWARD, FORWARD, GO, RELEASED, TURN_LEFT, TURN_RIGHT, Stick

_CUTOFF_HZ: Final = 5.0
_BETA: Final = 4.0
"""Of the One-Euro filter for the finger's direction, a unit vector; chosen, not measured."""

SLOWEST: Final = 0.08
"""Deflection of a low hand: a finger that points always drives."""

_GAUGE: Final = (255, 255, 255)
_ARC: Final = (255, 190, 60)

_FADES_S: Final = 0.15
"""Time in which it slows to the least when the finger is no longer seen to point: the hand may be opening to stop."""

_STICKS: Final = {GO: Stick(True), TURN_LEFT: Stick(True, 0.0, 1.0), TURN_RIGHT: Stick(True, 0.0, -1.0)}


class Pointing:
    """Turns the active hand into a stick that says where to go, by the signs that are confirmed.

    ``Forward`` and ``Backward`` deflect it forward or back, and to the left or right by the tilt of the index finger
    in the picture; the turns deflect it to their side; ``Go`` holds it in the middle. It is released without a sign,
    and by any other. Pointing down and to a side swings the robot's tail to that side.

    Args:
        config: Dead zone and full deflection of the tilt.

    Attributes:
        stick: The state after the last frame.
        tilt_deg: The filtered tilt of the finger towards the person's left, in degrees; None if no finger points.
    """

    def __init__(self, config: JoystickConfig | None = None) -> None:
        self._config = config or JoystickConfig()
        self.reset()

    def reset(self) -> None:
        """Release it."""
        self.stick = RELEASED
        self.tilt_deg: float | None = None
        self._filter: OneEuro | None = None
        self._palm: tuple[float, float] | None = None
        self._sign, self._share, self._unseen_s = "", 0.0, 0.0

    def reconfigure(self, config: JoystickConfig) -> None:
        """Change the parameters; if they differ, it is released."""
        if config != self._config:
            self.reset()
        self._config = config

    def step(self, recognition: Recognition, dt_s: float) -> Stick:
        """Process the next frame.

        Args:
            recognition: Of that frame.
            dt_s: Seconds since the last one, >= 0.
        """
        sign = recognition.sign
        if sign not in (FORWARD, BACKWARD):
            self.reset()
            self.stick = _STICKS.get(sign, RELEASED)
            return self.stick
        if sign != self._sign:
            self.reset()
            self._sign = sign
        # A hand that is missed for a frame, or changes to another sign, still points where it did, ever more slowly.
        if recognition.hand is not None and recognition.seen == sign:
            self.tilt_deg = self._filtered(recognition.hand, dt_s, up=1.0 if sign == FORWARD else -1.0)
            self._share = height_deflection(float(recognition.hand.points[PALM, 1].mean()), self._config)
            x, y = recognition.hand.pixels[PALM, :2].mean(axis=0).tolist()
            self._palm = x, y
        if recognition.seen in (sign, GO):
            self._unseen_s = 0.0  # a fist that is not confirmed yet is to keep the speed
        if self.tilt_deg is not None:
            left = tilt_deflection(self.tilt_deg, self._config)
            share = max(SLOWEST, self._share * max(0.0, 1.0 - self._unseen_s / _FADES_S))
            self.stick = Stick(True, share, left) if sign == FORWARD else Stick(True, -share, -left)
        self._unseen_s += dt_s
        return self.stick

    def draw(self, picture: NDArray[np.uint8]) -> None:
        """Draw it into a mirrored ``picture``, (height, width, 3) uint8, BGR: the arc, and the heights for speeds."""
        height, width = picture.shape[:2]
        thickness = max(1, height // 240)
        for y in (self._config.slow_at, self._config.fast_at):
            row = round(y * height)
            cv2.line(picture, (0, row), (width // 20, row), _GAUGE, thickness, cv2.LINE_AA)
        if self._palm is None or self.tilt_deg is None:
            return
        x, y = width - 1 - self._palm[0], self._palm[1]
        length = (0.1 + 0.4 * abs(self.stick.forward)) * height
        way = -1 if self.stick.forward > 0.0 else 1
        # From the palm on, the arc turns by twice the angle of its chord.
        turn = math.radians(self.tilt_deg) if self.stick.left else 0.0
        shares = np.linspace(0.0, 1.0, 12)
        points = np.stack(
            [x - length * shares * np.sin(turn * shares), y + way * length * shares * np.cos(turn * shares)]
        )
        cv2.polylines(picture, [points.T.round().astype(np.int32)], False, _ARC, 3 * thickness, cv2.LINE_AA)

    def _filtered(self, hand: Hand, dt_s: float, up: float) -> float:
        """Return the tilt of the finger that points up, or down for ``up`` -1, towards the person's left, degrees."""
        right, down = directions(hand.pixels[None, :, :2].astype(np.float64))[0][0].tolist()
        length = max(1e-9, math.hypot(right, down))
        # The frame is not mirrored: its right is the person's left.
        raw = np.array([right, -up * down]) / length
        self._filter = self._filter or OneEuro(raw)
        left, along = self._filter.step(raw, dt_s, _CUTOFF_HZ, _BETA).tolist()
        return math.degrees(math.atan2(left, along))


def height_deflection(y: float, config: JoystickConfig) -> float:
    """Return the deflection forward, above 0 to 1, of a hand whose palm is at ``y``, 0 (top) to 1 of the picture."""
    raised = max(0.0, config.slow_at - y)
    return SLOWEST + (1.0 - SLOWEST) * response(raised, 0.0, config.slow_at - config.fast_at, config.expo)


def tilt_deflection(tilt_deg: float, config: JoystickConfig) -> float:
    """Return the deflection to the left, -1 to 1, of a finger that is tilted to the left by ``tilt_deg`` degrees."""
    return response(tilt_deg, config.tilt_dead_zone, config.full_tilt, config.expo)
