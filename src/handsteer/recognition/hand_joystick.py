"""The hand as a joystick: a closed fist holds it, and its movement is the deflection; an open hand releases it."""

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.config import JoystickConfig
from handsteer.recognition.features import KNUCKLES, PALM, WRIST
from handsteer.recognition.filters import OneEuro
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognition
from handsteer.types import GO, RELEASED, STOP, Handedness, Stick

_OPEN_S: Final = 0.15
"""The open hand must be seen for this long before it closes; a shorter glimpse may be an error."""

_CLOSING_S: Final = 1.0
"""The hand must close within this time after it was seen open."""

_CLOSED_S: Final = 0.1
"""The fist must be seen for this long to be held, as a sign to be confirmed (``signs.confirm_time``)."""

_UNSEEN_S: Final = 0.05
"""A hand that is missed for longer is lost; with one frame more, at 15 frames a second, that is 0.1 s."""

_BLURRED_S: Final = 0.2
"""A hand that is missed for longer while it closes must be opened again; fast fingers are blurred."""

_PAUSE_S: Final = 0.25
"""A held hand that may have done anything between two frames this far apart is released."""

_OTHER_S: Final = 0.05
"""A held hand that has looked like the person's other one for longer is another hand; frames in which it did not make
up for half as much, so that alternating ones count."""

_UNCLEAR_S: Final = 0.1
"""A held hand that has not been recognised as a fist for longer is released."""

_LIKELY: Final = 0.5
_CERTAIN: Final = 0.8

_EDGE: Final = 0.01
"""A palm closer than this to the picture's edge is cut off; a share of the picture's sides."""

_JUMP: Final = 0.8
"""Largest movement between two frames, in palm lengths, of one hand."""

_TREMOR: Final = 0.12
"""A held hand may be so far from where its velocity takes it, in palm lengths: the largest distance of 1,100 frames of
two people's clips is 0.10."""

_ACCELERATION: Final = 110.0
"""Largest acceleration of a held hand, in palm lengths/s²: that of a movement over the stick's range in 0.25 s."""

_CHANGE: Final = 0.45
"""Largest distance that such an acceleration explains, however far frames are apart, in palm lengths: that of a
movement over the stick's range in 0.3 s at 10 frames/s, of least jerk (Flash and Hogan 1985). At most 0.15 in these
clips."""

_RESIZE_A_FRAME: Final = 1.3
"""Largest change of the palm's length between two frames, as a ratio, of a held hand; 1.14 in these clips."""

_RESIZE: Final = 1.6
"""Largest change of the palm's length since the fist was closed, as a ratio, of one hand."""

_RANGE: Final = (255, 255, 255)
_STICK: Final = (90, 200, 90)


@dataclass(frozen=True)
class Grip:
    """The held hand.

    Attributes:
        handedness: The person's hand.
        neutral_px: (x, y) of the palm's centre where the fist was closed, in pixels.
        palm_px: Length of the palm then, in pixels.
        now_px: (x, y) of the palm's centre now, filtered.
    """

    handedness: Handedness
    neutral_px: tuple[float, float]
    palm_px: float
    now_px: tuple[float, float]


class HandJoystick:
    """Turns the active hand into a joystick.

    An open hand (``Stop``) that closes to a fist (``Go``) holds the joystick, with neutral where the palm is then.
    Up in the picture is forward, the person's own left is left. Opening the hand releases it at once. So does a hand
    that is lost, at the picture's edge, or replaced by another; the hand must then be opened and closed again.

    Args:
        config: Dead zone, deflection and filter.

    Attributes:
        stick: The state after the last frame.
        grip: The held hand; None while it is not held.
    """

    def __init__(self, config: JoystickConfig | None = None) -> None:
        self._config = config or JoystickConfig()
        self.reset()

    def reset(self) -> None:
        """Release it."""
        self.stick = RELEASED
        self.grip: Grip | None = None
        self._last: _Seen | None = None
        self._speed = (0.0, 0.0)
        self._open_s = self._closed_s = self._unseen_s = self._unclear_s = self._other_s = 0.0
        self._since_open_s = math.inf
        self._closing: deque[_Seen] = deque(maxlen=30)

    def reconfigure(self, config: JoystickConfig) -> None:
        """Change the parameters; if they differ, a held hand is released: its deflection would change at once."""
        if config != self._config:
            self.reset()
        self._config = config

    def step(self, recognition: Recognition, dt_s: float) -> Stick:
        """Process the next frame.

        Args:
            recognition: Of that frame.
            dt_s: Seconds since the last one, >= 0.
        """
        hand = recognition.hand
        if hand is None:
            self._miss(dt_s)
            return self.stick
        if self.grip is not None and dt_s > _PAUSE_S:
            self.reset()
        seen = _Seen.of(hand)
        if self._last is not None:
            self._compare(seen, self._last, dt_s + self._unseen_s)
        self._last, self._unseen_s = seen, 0.0
        is_open = recognition.seen == STOP or recognition.likelihoods.get(STOP, 0.0) >= _LIKELY
        fist = recognition.likelihoods.get(GO, float(recognition.seen == GO))
        if seen.is_cut_off:
            self.reset()
        elif self.grip is None:
            self._close(seen, dt_s, is_open=is_open, is_closed=fist >= _CERTAIN)
        else:
            self._move(self.grip, seen, dt_s, is_open=is_open, is_fist=fist >= _LIKELY)
        return self.stick

    def draw(self, picture: NDArray[np.uint8]) -> None:
        """Draw it into a mirrored ``picture``, (height, width, 3) uint8, BGR: its range, dead zone and the hand."""
        if self.grip is None:
            return
        height, width = picture.shape[:2]

        def place(point: tuple[float, float]) -> tuple[int, int]:
            return round(width - 1 - point[0]), round(point[1])

        thickness = max(1, height // 240)
        neutral, now = place(self.grip.neutral_px), place(self.grip.now_px)
        for length in (self._config.dead_zone, self._config.full_deflection):
            cv2.circle(picture, neutral, round(length * self.grip.palm_px), _RANGE, thickness, cv2.LINE_AA)
        cv2.line(picture, neutral, now, _STICK, 3 * thickness, cv2.LINE_AA)
        cv2.circle(picture, now, 6 * thickness, _STICK, -1, cv2.LINE_AA)

    def _compare(self, seen: "_Seen", last: "_Seen", dt_s: float) -> None:
        """Release it if ``seen`` cannot be the hand of ``last``, ``dt_s`` seconds before; else note its speed."""
        if not seen.is_same_hand(last, self.grip) or (self.grip and not seen.continues(last, self._speed, dt_s)):
            self.reset()
        elif dt_s > 0.0:
            self._speed = (seen.x - last.x) / dt_s, (seen.y - last.y) / dt_s

    def _miss(self, dt_s: float) -> None:
        self._unseen_s += dt_s
        if self._unseen_s > (_UNSEEN_S if self.grip else _BLURRED_S):
            self.reset()

    def _close(self, seen: "_Seen", dt_s: float, *, is_open: bool, is_closed: bool) -> None:
        """Process a frame with a hand that is not held."""
        self._open_s = self._open_s + dt_s if is_open else 0.0
        self._since_open_s = 0.0 if self._open_s >= _OPEN_S else self._since_open_s + dt_s
        if not is_closed or self._since_open_s > _CLOSING_S + _CLOSED_S:
            self._closed_s = 0.0
            self._closing.clear()
            return
        self._closed_s += dt_s if self._closing else 0.0
        self._closing.append(seen)
        if self._closed_s < _CLOSED_S - 1e-9:
            return
        x, y, palm_px = (
            sum(each) / len(self._closing)
            for each in zip(*((hand.x, hand.y, hand.palm_px) for hand in self._closing), strict=True)
        )
        self.grip = Grip(seen.handedness, (x, y), palm_px, (x, y))
        self.stick = Stick(True)
        self._filter = OneEuro(np.zeros(2))
        self._unclear_s = self._other_s = 0.0
        self._since_open_s = math.inf

    def _move(self, grip: Grip, seen: "_Seen", dt_s: float, *, is_open: bool, is_fist: bool) -> None:
        """Process a frame with the held hand."""
        self._unclear_s = 0.0 if is_fist else self._unclear_s + dt_s
        is_other = seen.handedness != grip.handedness
        self._other_s = self._other_s + dt_s if is_other else max(0.0, self._other_s - 0.5 * dt_s)
        if is_open or self._unclear_s > _UNCLEAR_S or self._other_s > _OTHER_S:
            self.reset()
            self._last = seen
            return
        if not is_fist:
            return  # the palm's place is uncertain while the fingers move: the deflection stays
        x0, y0 = grip.neutral_px
        moved = np.array([seen.x - x0, seen.y - y0]) / grip.palm_px
        right, down = self._filter.step(moved, dt_s, self._config.min_cutoff, self._config.beta).tolist()
        self.grip = replace(grip, now_px=(x0 + right * grip.palm_px, y0 + down * grip.palm_px))
        # The frame is not mirrored: its right is the person's left.
        self.stick = Stick(True, deflection(-down, self._config), deflection(right, self._config))


def deflection(moved: float, config: JoystickConfig) -> float:
    """Return the deflection, -1 to 1, of a hand that ``moved`` so many palm lengths along an axis.

    It is :func:`response` with the dead zone and the full deflection of ``config``.
    """
    return response(moved, config.dead_zone, config.full_deflection, config.expo)


def response(value: float, dead_zone: float, full: float, expo: float) -> float:
    """Return the deflection, -1 to 1, for ``value``: 0 within the dead zone, 1 from ``full`` on.

    Between them it rises as ``(1 - expo) u + expo u**3``, the "expo" of radio controls.
    """
    share = min(1.0, max(0.0, abs(value) - dead_zone) / (full - dead_zone))
    return math.copysign((1.0 - expo) * share + expo * share**3, value) if share else 0.0


@dataclass(frozen=True)
class _Seen:
    """A hand in one frame: the palm's centre and length in pixels, and whether it is cut off."""

    x: float
    y: float
    palm_px: float
    handedness: Handedness
    is_cut_off: bool

    @classmethod
    def of(cls, hand: Hand) -> "_Seen":
        pixels = hand.pixels[:, :2].astype(np.float64)
        world = hand.world.astype(np.float64)
        x, y = pixels[PALM].mean(axis=0).tolist()
        # A palm that points to the camera looks short, so its length is that of the model at the scale of all points.
        scale = np.linalg.norm(np.ptp(pixels, axis=0)) / max(float(np.linalg.norm(np.ptp(world[:, :2], axis=0))), 1e-6)
        palm_m = float(np.linalg.norm(world[KNUCKLES, :] - world[WRIST], axis=1).mean())
        width, height = hand.image_size
        shares = pixels[PALM] / [width, height]
        is_cut_off = bool((shares < _EDGE).any() or (shares > 1.0 - _EDGE).any())
        return cls(x, y, max(1.0, float(scale) * palm_m), hand.handedness, is_cut_off)

    def is_same_hand(self, last: "_Seen", grip: Grip | None) -> bool:
        """Return whether this can be the hand of the ``last`` frame, held by ``grip`` if it was."""
        is_near = math.hypot(self.x - last.x, self.y - last.y) <= _JUMP * max(self.palm_px, last.palm_px)
        ratio = self.palm_px / (grip or last).palm_px
        return is_near and 1 / _RESIZE <= ratio <= _RESIZE

    def continues(self, last: "_Seen", speed: tuple[float, float], dt_s: float) -> bool:
        """Return whether this continues the movement of a hand that was ``last`` at ``speed``, in pixels/s."""
        off = math.hypot(self.x - last.x - speed[0] * dt_s, self.y - last.y - speed[1] * dt_s)
        ratio = self.palm_px / last.palm_px
        is_near = off <= (_TREMOR + min(_CHANGE, _ACCELERATION * dt_s**2)) * max(self.palm_px, last.palm_px)
        return is_near and 1 / _RESIZE_A_FRAME <= ratio <= _RESIZE_A_FRAME
