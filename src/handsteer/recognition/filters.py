"""Filters over time: the active hand of several, likelihoods, when to doubt them, the confirmed sign, positions."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.config import SignsConfig
from handsteer.recognition.features import PALM
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.types import GO, NONE, STOP

_JUMP: Final = 1.0
"""Largest movement of a hand between two frames, in hand sizes."""
_MUCH_SMALLER: Final = 0.6
"""Hands smaller than this fraction of the active one belong to people in the background."""

_FRAMES: Final = 12
_STILL: Final = 0.25
"""Largest movement of a still hand during the confirmation, in hand sizes; chosen, not measured."""

_OPINION_PERIOD_S: Final = 0.5
"""Time from one second opinion to the next, unless the last ones have changed what is seen."""

_SPEED_HZ: Final = 1.0
"""Cutoff frequency for the speed in the One-Euro filter, as its authors have it."""

# The stamps of periodic frames jitter: without slack, rounding would decide about a whole frame.
_SLACK_S = 0.001


@dataclass(frozen=True)
class HandPosition:
    """A hand's position in the image: the centre of its box and the box's longer side, in pixels."""

    x: float
    y: float
    size: float

    @classmethod
    def of(cls, hand: Hand) -> "HandPosition":
        """Return the position of ``hand``."""
        x, y = ((hand.pixels[:, :2].min(axis=0) + hand.pixels[:, :2].max(axis=0)) / 2).tolist()
        return cls(x, y, max(1.0, hand.longer_side_px))

    @classmethod
    def of_palm(cls, hand: Hand) -> "HandPosition":
        """Return the position of the palm of ``hand``, independent of the fingers, with the size of the whole hand."""
        x, y = hand.pixels[PALM, :2].mean(axis=0).tolist()
        return cls(x, y, max(1.0, hand.longer_side_px))

    def distance(self, other: "HandPosition") -> float:
        """Return the distance to ``other`` in sizes of this hand."""
        return float(np.hypot(self.x - other.x, self.y - other.y)) / self.size


class HandSelector:
    """Selects the active hand, which gives the signs, and follows it.

    - Without an active hand, it selects one that shows a sign, by confidence and size; a fist only if no other hand of
      about its size or larger shows another sign.
    - Once a sign of the active hand is confirmed, it stays active while in view, until it has had no confirmed sign for
      ``switch_time`` and another hand, not much smaller, shows one: a resting hand or a bystander does not take over.
    - A hand that is out of view for ``dropout_hold`` is no longer active; until then, any hand may show ``Stop``.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self.reset()

    def reconfigure(self, config: SignsConfig) -> None:
        """Change the times; the active hand stays."""
        self._config = config

    def reset(self) -> None:
        """Forget the active hand."""
        self._followed: HandPosition | None = None
        self._unseen_s = 0.0
        self._idle_s = math.inf

    def wants_search(self) -> bool:
        """Return whether to search for further hands, which takes time: while the active one shows no sign."""
        return self._idle_s > 0.0

    def choose(self, hands: Sequence[Hand], guesses: Sequence[SignGuess], dt_s: float) -> int | None:
        """Return the index of the active hand; None if it is not in view.

        Args:
            hands: The hands of one frame.
            guesses: The sign of each hand; ``NONE`` below the threshold.
            dt_s: Seconds since the last frame, >= 0.
        """
        places = [HandPosition.of(hand) for hand in hands]
        showing = [index for index, guess in enumerate(guesses) if guess.sign != NONE]
        self._idle_s += dt_s
        followed = self._find(places, dt_s)
        if self._followed is not None and followed is None:
            # Any hand may stop the robot, including the active one after a jump.
            showing = [index for index in showing if guesses[index].sign == STOP]
            if not showing:
                return None
        if followed is not None and followed not in showing and self._idle_s >= self._config.switch_time:
            showing = [index for index in showing if places[index].size >= _MUCH_SMALLER * places[followed].size]
        elif followed is not None:
            showing = []
        if showing:
            some = _purposeful(showing, guesses, places)
            followed = max(some, key=lambda index: guesses[index].confidence * places[index].size ** 0.5)
            self._idle_s = math.inf
        if followed is None:
            return max(range(len(places)), key=lambda index: places[index].size, default=None)
        self._followed = places[followed]
        return followed

    def confirm(self) -> None:
        """Report that the active hand's sign is confirmed: from now on the hand stays active."""
        self._idle_s = 0.0

    def _find(self, places: list[HandPosition], dt_s: float) -> int | None:
        """Return the index of the active hand among ``places``; None if it is not there, or there is none."""
        before = self._followed
        if before is None:
            return None
        nearest = min(range(len(places)), key=lambda index: before.distance(places[index]), default=None)
        if nearest is not None and before.distance(places[nearest]) <= _JUMP:
            self._unseen_s = 0.0
            return nearest
        self._unseen_s += dt_s
        if self._unseen_s > self._config.dropout_hold:
            self.reset()
        return None


def _purposeful(showing: list[int], guesses: Sequence[SignGuess], places: Sequence[HandPosition]) -> list[int]:
    """Return the hands of ``showing`` without the fists where another hand shows another sign.

    A hand that holds something or rests looks like a fist too. A much smaller hand belongs to another person.
    """
    others = [places[index].size for index in showing if guesses[index].sign != GO]
    largest = max(others, default=0.0)
    return [index for index in showing if guesses[index].sign != GO or largest < _MUCH_SMALLER * places[index].size]


@dataclass(frozen=True)
class _Seen:
    dt_s: float
    place: HandPosition
    likelihoods: Mapping[str, float]


class Evidence:
    """The last 12 frames of one hand: its stillness, and the likelihoods of signs."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque(maxlen=_FRAMES)

    def add(self, place: HandPosition | None, likelihoods: Mapping[str, float], dt_s: float) -> None:
        """Add the next frame.

        Args:
            place: Position of its palm; None if it is not in view, which clears all earlier frames.
            likelihoods: The likelihood of each sign, 0 to 1.
            dt_s: Seconds since the last frame, >= 0.
        """
        if place is None:
            self._seen.clear()
        else:
            self._seen.append(_Seen(dt_s, place, likelihoods))

    def is_still(self, seconds: float) -> bool:
        """Return whether the hand moved by less than a quarter of its size in the last ``seconds``.

        A hand that has been in view for less time is judged by the available frames.
        """
        if not self._seen:
            return False
        now = self._seen[-1].place
        return all(now.distance(each.place) <= _STILL for each in self._last(seconds))

    def likelihood(self, sign: str, seconds: float) -> float:
        """Return the mean likelihood of ``sign`` in the last ``seconds``, 0 to 1; 0 without a frame."""
        last = self._last(seconds)
        return sum(each.likelihoods.get(sign, 0.0) for each in last) / len(last) if last else 0.0

    def reset(self) -> None:
        """Clear all frames."""
        self._seen.clear()

    def _last(self, seconds: float) -> list[_Seen]:
        """Return the newest frame, and the earlier ones that are at most ``seconds`` older."""
        last: list[_Seen] = []
        age_s = 0.0
        for each in reversed(self._seen):
            if age_s > seconds + 1e-9:
                break
            last.append(each)
            age_s += each.dt_s
        return last


class OpinionTimes:
    """When second opinions are due: each takes as long as a frame, and most change nothing."""

    def __init__(self) -> None:
        self._since_any_s = self._since_change_s = math.inf

    @property
    def are_due(self) -> bool:
        """Whether to ask in this frame."""
        return self._since_any_s >= _OPINION_PERIOD_S or self._since_change_s < _OPINION_PERIOD_S

    def wait(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, >= 0."""
        self._since_any_s += dt_s
        self._since_change_s += dt_s

    def note(self, *, has_changed: bool) -> None:
        """Record an opinion, and whether it has changed what is seen."""
        self._since_any_s = 0.0
        if has_changed:
            self._since_change_s = 0.0


class Debouncer:
    """Confirms signs, and bridges short losses.

    - ``Stop`` is confirmed at its first frame.
    - Any other sign is confirmed once a still hand has shown it in every frame for ``confirm_time``.
    - A confirmed sign that is not seen stays active for up to ``dropout_hold``; then it becomes ``NONE``.

    Attributes:
        sign: The confirmed sign, or ``NONE``.
        candidate: The sign that is seen but not confirmed yet; ``NONE`` if there is none.
        candidate_s: Seconds since the candidate was first seen.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self.sign = self.candidate = NONE
        self.candidate_s = self._unseen_s = 0.0

    @property
    def progress(self) -> float:
        """Progress of confirming the candidate, 0 to 1."""
        if self.candidate == NONE:
            return 0.0
        return min(1.0, self.candidate_s / self._config.confirm_time) if self._config.confirm_time else 1.0

    def step(self, seen: str, dt_s: float, *, still: bool = True) -> str:
        """Process one frame and return the confirmed sign.

        Args:
            seen: A sign, or ``NONE``.
            dt_s: Seconds since the last frame, >= 0.
            still: Whether the hand is held still; otherwise the frame's time does not count towards a new sign.
        """
        if seen in (self.sign, STOP):
            self._accept(seen)
            return self.sign
        self.candidate_s = self.candidate_s + dt_s if still and seen == self.candidate else 0.0
        self.candidate = seen
        self._unseen_s += dt_s
        if seen != NONE and self.candidate_s >= self._config.confirm_time - _SLACK_S:
            self._accept(seen)
        elif self._unseen_s > self._config.dropout_hold + _SLACK_S:
            self.sign = NONE
        return self.sign

    def is_due(self, seen: str, dt_s: float) -> bool:
        """Return whether ``seen``, ``dt_s`` seconds after the last frame, is confirmed now if the hand is still."""
        shown_s = self.candidate_s + dt_s if seen == self.candidate else 0.0
        return seen in (self.sign, STOP) or shown_s >= self._config.confirm_time - _SLACK_S

    def reconfigure(self, config: SignsConfig) -> None:
        """Change the times; the confirmed sign stays."""
        self._config = config

    def reset(self) -> None:
        """Reset to ``NONE``."""
        self._accept(NONE)

    def _accept(self, sign: str) -> None:
        self.sign, self.candidate = sign, NONE
        self.candidate_s = self._unseen_s = 0.0


class OneEuro:
    """The One-Euro filter: a low-pass whose cutoff rises with speed (Casiez, Roussel and Vogel, CHI 2012).

    Args:
        value: The first value, (n,).
    """

    def __init__(self, value: NDArray[np.float64]) -> None:
        self._value = value
        self._raw = value
        self._speed = np.zeros_like(value)

    def step(self, raw: NDArray[np.float64], dt_s: float, min_cutoff_hz: float, beta: float) -> NDArray[np.float64]:
        """Return the filtered value.

        Args:
            raw: The next value, (n,).
            dt_s: Seconds since the last one, >= 0.
            min_cutoff_hz: Cutoff frequency at rest.
            beta: Its increase with speed, in Hz per unit a second.
        """
        if dt_s <= 0:
            return self._value
        speed = (raw - self._raw) / dt_s
        self._raw = raw
        self._speed = self._speed + _share(_SPEED_HZ, dt_s) * (speed - self._speed)
        share = _share(min_cutoff_hz + beta * float(np.linalg.norm(self._speed)), dt_s)
        self._value = self._value + share * (raw - self._value)
        return self._value


def _share(cutoff_hz: float, dt_s: float) -> float:
    """Return the weight of a new value in a first-order low-pass."""
    return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff_hz * dt_s))
