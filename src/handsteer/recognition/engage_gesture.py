"""The gesture that engages the hand: open, close, open, as only a hand that is really there can do it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.features import KNUCKLES, PALM, WRIST
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognition
from handsteer.types import STOP

_TIPS: Final = (8, 12, 16, 20)

_OPEN: Final = 1.5
"""Openness of an open hand, at least; of 110 photos of people 1.62 to 1.79."""
_CLOSED: Final = 1.05
"""Openness of a closed one, at most; of 28 photos of people 0.78 to 0.88."""
_LESS_OPEN: Final = 0.12
"""A hand that is less open than it was by so much has begun to close."""
_FORGOTTEN_A_SECOND: Final = 0.5
"""How fast an openness that was once seen is forgotten."""
_LESS_CLOSED: Final = 0.15
"""A hand that is less closed than it was at most by so much has begun to open."""
_BETWEEN_S: Final = 0.09
"""For so long in all, and at least in one frame each way, the hand must be seen half closed. Of 570 times that the
picture of a palm was changed for one of a fist at the same place four had such a frame, of 380 back again none."""
_FRAMES_HELD: Final = 2
"""So many frames must show the hand open before, closed, and open after."""
_LONGEST_S: Final = 2.0
"""From open to open."""
_DONE_S: Final = 0.3
"""For so long it is reported, or until the hand is no longer open: of several messages, one may be lost."""
_UNSEEN_S: Final = 0.1
"""A hand that is missed for longer may be another one."""
_JUMP: Final = 0.12
_JUMP_A_SECOND: Final = 3.0
"""Largest movement of the palm between two frames, in palm lengths, and what is added per second between them."""
_RESIZE: Final = 1.35
"""Largest change of the palm's length between two frames, as a ratio."""


@dataclass(frozen=True)
class _Palm:
    """The palm's centre and length in pixels."""

    x: float
    y: float
    length_px: float

    @classmethod
    def of(cls, hand: Hand) -> "_Palm":
        pixels, world = hand.pixels[PALM, :2].astype(np.float64), hand.world.astype(np.float64)
        x, y = pixels.mean(axis=0).tolist()
        # A palm that points to the camera looks short, so its length is that of the model at the scale of the picture.
        scale = np.linalg.norm(np.ptp(pixels, axis=0)) / max(
            float(np.linalg.norm(np.ptp(world[PALM, :2], axis=0))), 1e-6
        )
        return cls(x, y, max(1.0, float(scale) * float(_from_wrist(hand, KNUCKLES).mean())))

    def continues(self, last: "_Palm", dt_s: float) -> bool:
        """Return whether this can be the ``last`` palm, ``dt_s`` seconds later."""
        longer, shorter = max(self.length_px, last.length_px), min(self.length_px, last.length_px)
        moved_px = math.hypot(self.x - last.x, self.y - last.y)
        return moved_px <= (_JUMP + _JUMP_A_SECOND * dt_s) * longer and longer <= _RESIZE * shorter


class EngageGesture:
    """Recognises that a hand opens, closes and opens again: an open palm (``Stop``), a fist, an open palm.

    A picture of a palm cannot do that, nor can pictures that are shown in turn: the hand must be seen at the same place
    and of the same size all the time, also while it is half closed.

    Attributes:
        progress: 0 without an open palm, 1/3 with one, 2/3 after the fist, 1 for a moment after the gesture.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._palm: _Palm | None = None
        self._unseen_s = 0.0
        self._begin()

    def _begin(self) -> None:
        self.progress = self._widest = self._done_s = 0.0
        self._held = 0
        self._leave_open()

    def _leave_open(self) -> None:
        self._reopened = self._closed = 0
        self._since_open_s = 0.0
        self._path: list[tuple[float, float]] = []

    def step(self, recognition: Recognition, dt_s: float) -> bool:
        """Process the next frame; return whether the gesture is complete.

        Args:
            recognition: Of that frame.
            dt_s: Seconds since the last one, >= 0.
        """
        self._unseen_s += dt_s
        if recognition.hand is None:
            if self._unseen_s > _UNSEEN_S:
                self.reset()
            return False
        last, unseen_s = self._palm, self._unseen_s
        self._palm, self._unseen_s = _Palm.of(recognition.hand), 0.0
        is_gap = unseen_s > max(_UNSEEN_S, dt_s) or dt_s > 3 * _UNSEEN_S
        if last is None or is_gap or not self._palm.continues(last, unseen_s):
            self._begin()
        if self.progress == 1.0:
            return self._is_still_done(dt_s, shows_stop=recognition.seen == STOP)
        self._since_open_s += unseen_s
        if self._since_open_s > _LONGEST_S:
            self._begin()
        self._take(openness(recognition.hand), dt_s, shows_stop=recognition.seen == STOP)
        return self.progress == 1.0

    def _is_still_done(self, dt_s: float, *, shows_stop: bool) -> bool:
        self._done_s += dt_s
        if self._done_s >= _DONE_S or not shows_stop:
            self._begin()
        return self.progress == 1.0

    def _take(self, how_open: float, dt_s: float, *, shows_stop: bool) -> None:
        is_open = shows_stop and how_open >= max(_OPEN, self._widest - _LESS_OPEN)
        self._widest = max(how_open if is_open else 0.0, self._widest - _FORGOTTEN_A_SECOND * dt_s)
        if not is_open:
            self._close(how_open, dt_s, is_closed=how_open <= _CLOSED and not shows_stop)
        elif self._path:
            self._reopen(how_open)
        else:
            self._held += 1
            self._since_open_s = 0.0
            if self._held >= _FRAMES_HELD:
                self.progress = 1 / 3

    def _close(self, how_open: float, dt_s: float, *, is_closed: bool) -> None:
        """Process a frame in which the hand is not open."""
        if self.progress == 0.0:
            self._held = 0
            return
        self._path.append((how_open, min(dt_s, _UNSEEN_S)))
        self._reopened = 0
        self._closed += is_closed
        if self.progress < 0.5 and self._closed >= _FRAMES_HELD:
            closing_s, _ = self._half_closed_s(self._widest)
            self.progress = 2 / 3 if closing_s else 0.0
            if not closing_s:
                self._begin()

    def _reopen(self, how_open: float) -> None:
        """Process a frame in which the hand is open again."""
        self._reopened += 1
        if self._reopened < _FRAMES_HELD:
            return
        closing_s, opening_s = self._half_closed_s(how_open)
        is_made = self.progress > 0.5 and closing_s and opening_s and closing_s + opening_s >= _BETWEEN_S
        self.progress, self._held = 1.0 if is_made else 1 / 3, _FRAMES_HELD
        self._leave_open()

    def _half_closed_s(self, open_: float) -> tuple[float, float]:
        """Return for how long the hand was seen half closed on the way to where it was closed most, and back."""
        tightest, at = min((how_open, index) for index, (how_open, _) in enumerate(self._path))
        seen = [dt_s if tightest + _LESS_CLOSED < each < open_ - _LESS_OPEN else 0.0 for each, dt_s in self._path]
        return sum(seen[:at]), sum(seen[at:])


def openness(hand: Hand) -> float:
    """Return how far the fingertips are from the wrist, in distances of their knuckles: 0.8 is a fist, 1.75 open."""
    return float((_from_wrist(hand, _TIPS) / np.maximum(_from_wrist(hand, KNUCKLES), 1e-6)).mean())


def _from_wrist(hand: Hand, points: tuple[int, ...]) -> NDArray[np.float64]:
    world = hand.world.astype(np.float64)
    return np.asarray(np.linalg.norm(world[list(points)] - world[WRIST], axis=1), np.float64)
