"""The state of a lesson, and what the page says of it; without page, clock, camera or threads."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from handsteer.plugins.teach.collect import Status
from handsteer.plugins.teach.dataset import Take
from handsteer.plugins.teach.effects import effect_words
from handsteer.plugins.teach.report import TrainingReport
from handsteer.plugins.teach.train import training_rows
from handsteer.recognition.custom_signs import CustomModel
from handsteer.recognition.features import KNUCKLES, WRIST
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.shipped_signs import SURE
from handsteer.types import NONE, SIGNS, Action

ROWS_PER_S: Final = 145_000.0
"""Rows that a training passes over a second, next to a robot that is driven: 1.8 million in 12.3 s on two processors
(``benchmarks/teach.py``); alone, it is twice as fast."""

_STEP_S: Final = 5
_SMALL_PX: Final = 60.0
_ENOUGH_HANDS: Final = 15
_LEAST_TURN_RAD: Final = np.radians(6.0)
_LEAST_GROWTH: Final = 1.12

UNDECIDED: Final = "choose on its card what the robot does"
NO_HAND: Final = "No hand is in view."
SMALL: Final = "Come nearer: the hand is small in the picture."
STILL: Final = "Move the hand a little: nearer, farther, tilted."


def hint(hand: Hand | None, guess: SignGuess, hands: Sequence[Hand]) -> str:
    """Return one sentence on what to improve; empty if nothing.

    ``hand`` is that in the newest frame, ``hands`` are those of the current take, oldest first.
    """
    if hand is None:
        return NO_HAND
    if hand.longer_side_px < _SMALL_PX:
        return SMALL
    if guess.sign in SIGNS and guess.confidence >= SURE:
        return f"This looks like {guess.sign}, which is known already: show another shape."
    return STILL if is_still(hands) else ""


def is_still(hands: Sequence[Hand]) -> bool:
    """Return whether ``hands`` are many, and all of similar size and tilt."""
    if len(hands) < _ENOUGH_HANDS:
        return False
    pixels = np.array([hand.pixels[:, :2] for hand in hands], np.float64)
    palms = pixels[:, KNUCKLES].mean(axis=1) - pixels[:, WRIST]
    lengths = np.maximum(np.linalg.norm(palms, axis=1), 1e-9)
    # Relative to the mean direction, so that a hand that points up or down is treated alike.
    mean = palms.mean(axis=0)
    turns = np.arctan2(palms[:, 1] * mean[0] - palms[:, 0] * mean[1], palms @ mean)
    return bool(np.ptp(turns) < _LEAST_TURN_RAD and lengths.max() / lengths.min() < _LEAST_GROWTH)


READY: Final = Status("ready", 0.0, 0)
"""Nothing is recorded."""


@dataclass(frozen=True)
class Collected:
    """A take of a lesson.

    Attributes:
        number: Identifies it in the lesson, from 1.
        take: The hands.
    """

    number: int
    take: Take


@dataclass(frozen=True)
class SignClass:
    """The takes of one sign, or of hands that are not a sign.

    Attributes:
        key: Identifies it in the lesson.
        label: The sign, or ``NONE``.
        takes: Its takes, oldest first.
        is_enabled: Whether it is to be learnt.
    """

    key: int
    label: str
    takes: tuple[Collected, ...] = ()
    is_enabled: bool = True

    @property
    def hands(self) -> int:
        """Number of hands in its takes."""
        return sum(len(each.take.hands) for each in self.takes)


@dataclass(frozen=True)
class Seen:
    """The hand in the newest frame.

    Attributes:
        hand: Whether there is one.
        sign: The recognised sign, or ``NONE``.
        confidence: Of ``sign``, 0 to 1.
        confidences: The confidence of each class, 0 to 1, ``NONE`` included: how little any sign is recognised.
    """

    hand: bool
    sign: str = NONE
    confidence: float = 0.0
    confidences: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class LessonState:
    """The state of a lesson.

    Attributes:
        classes: Own signs, and last the class ``NONE``.
        kept: The classes that were kept last.
        kept_model: The model that was kept last, if any.
        recorded: Key of the class that is being recorded; None if none is.
        is_held: Whether it is recorded while a button is held.
        status: Progress of recording.
        hint: What to improve; empty if nothing.
        undo: What can be undone, as the label of a button; empty if nothing.
        progress: Of the training, 0 to 1; None if there is none.
        left_s: Seconds until the training ends; None if it is not known yet.
        rows_per_s: Rows that a training passes over a second.
        message: The last error, or what has happened; empty if nothing.
        model: The model that is tried; None if no sign has been learnt yet.
        learnt_from: The classes that ``model`` was learnt from in this lesson; None if it is an earlier one.
        report: How well they were learnt.
        take_numbers: Number of each take that the report's mistakes index.
        seen: The newest frame; None without one.
    """

    classes: tuple[SignClass, ...]
    kept: tuple[SignClass, ...]
    kept_model: CustomModel | None = None
    recorded: int | None = None
    is_held: bool = False
    status: Status = READY
    hint: str = ""
    undo: str = ""
    progress: float | None = None
    left_s: float | None = None
    rows_per_s: float = ROWS_PER_S
    message: str = ""
    model: CustomModel | None = None
    learnt_from: tuple[SignClass, ...] | None = None
    report: TrainingReport | None = None
    take_numbers: tuple[int, ...] = ()
    seen: Seen | None = None

    @property
    def is_training(self) -> bool:
        """Whether a training is running."""
        return self.progress is not None

    @property
    def is_fresh(self) -> bool:
        """Whether the model was learnt from the takes as they are now."""
        return self.model is not None and self.learnt_from == filled(self.classes)

    @property
    def is_changed(self) -> bool:
        """Whether there is something to keep."""
        return self.classes != self.kept or (self.is_fresh and self.model is not self.kept_model)

    @property
    def can_train(self) -> bool:
        """Whether there is a take to learn from, and nothing else is in progress."""
        own = any(each.takes and each.is_enabled for each in self.classes if each.label != NONE)
        return own and self.recorded is None and not self.is_training

    @property
    def lost(self) -> tuple[str, ...]:
        """The signs of an earlier model that a training would lose, because they have no takes."""
        if self.model is None or self.learnt_from is not None:
            return ()
        return tuple(sign for sign in self.model.labels if not any(each.label == sign for each in self.classes))

    @property
    def training_rows(self) -> int:
        """Number of rows that a training now would pass over."""
        return training_rows(sum(bool(each.takes) and each.is_enabled for each in self.classes if each.label != NONE))

    def of(self, key: int) -> SignClass | None:
        """Return the class ``key``, if it exists."""
        return next((each for each in self.classes if each.key == key), None)


def filled(classes: Sequence[SignClass]) -> tuple[SignClass, ...]:
    """Return the classes that have takes."""
    return tuple(each for each in classes if each.takes)


def counted(one: SignClass) -> str:
    """Return the number of takes of a class, and of their hands, in words."""
    if not one.takes:
        return "No takes yet"
    return f"1 take, {one.hands} hands" if len(one.takes) == 1 else f"{len(one.takes)} takes, {one.hands} hands"


def training_words(state: LessonState) -> str:
    """Return how far the training is, or how long one would take; empty if there is nothing to learn from."""
    if state.progress is not None:
        if state.left_s is None:
            return "Making hands of every shape"
        return f"Learning: {state.progress:.0%}, about {math.ceil(state.left_s)} s left"
    if not state.can_train:
        return ""
    expected_s = state.training_rows / state.rows_per_s
    return f"Training takes about {_STEP_S * math.ceil(expected_s / _STEP_S)} s here."


def instruction(state: LessonState) -> tuple[str, str]:
    """Return the current instruction while takes are recorded: a number, and words."""
    one = state.of(state.recorded) if state.recorded is not None else None
    label = one.label if one is not None else NONE
    shown = "show anything else" if label == NONE else f"show {label}"
    if state.status.phase == "recording":
        return str(state.status.hands), f"hands: {shown}"
    return str(math.ceil(state.status.left_s)), f"then {shown}"


def outcome(seen: Seen | None, least: float, action_of: Callable[[str], Action | None]) -> tuple[str, str]:
    """Return in words how the hand is recognised, and what the robot would do; a sign counts from ``least`` on."""
    if seen is None:
        return "No picture", "no picture comes from the camera"
    if not seen.hand:
        return "No hand", "the robot would stop: no hand is in view"
    if seen.sign == NONE or seen.confidence < least:
        return "No sign", "the robot would stop: the hand shows none of the signs"
    action = action_of(seen.sign)
    return f"{seen.sign}, {seen.confidence:.0%}", f"would mean: {effect_words(action, None)}" if action else UNDECIDED
