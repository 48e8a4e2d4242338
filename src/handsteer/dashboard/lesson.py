"""The steps of a lesson that teaches one sign, without page, clock, camera or threads."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from handsteer.config import TeachConfig
from handsteer.recognition.custom_signs import CustomModel
from handsteer.recognition.features import KNUCKLES, WRIST
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.recognizer import Recognition
from handsteer.recognition.shipped_signs import SURE
from handsteer.training.custom.collect import Collector, Facts, Status
from handsteer.training.custom.dataset import Take
from handsteer.training.custom.report import TrainingReport
from handsteer.types import EFFECTS, NONE, Action

_SMALL_PX: Final = 60.0
_ENOUGH_HANDS: Final = 15
_LEAST_TURN_RAD: Final = np.radians(6.0)
_LEAST_GROWTH: Final = 1.12

NO_HAND: Final = "No hand is in view."
SMALL: Final = "Come nearer: the hand is small in the picture."
STILL: Final = "Move the hand a little: nearer, farther, tilted."


def hint(hand: Hand | None, guess: SignGuess, hands: Sequence[Hand]) -> str:
    """Return one sentence on what to improve; empty if nothing.

    Args:
        hand: The hand in the newest frame.
        guess: What the shipped signs' classifier recognises it as.
        hands: The hands of the current take, oldest first.
    """
    if hand is None:
        return NO_HAND
    if hand.longer_side_px < _SMALL_PX:
        return SMALL
    if guess.sign != NONE and guess.confidence >= SURE:
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


Step = Literal["collect", "train", "try"]

MOST_TAKES: Final = 50
"""Maximum number of takes in one lesson."""

_LEAST_TAKES: Final = 2
_READY: Final = Status("ready", 0.0, 0)
_TOO_FEW: Final = "Too few hands were seen: this take is done again."


@dataclass(frozen=True)
class Collected:
    """A take of this lesson.

    Attributes:
        number: From 1, in order of collection.
        take: The hands.
        picture: A small JPEG file of one of its frames, mirrored, with the hand's skeleton; it stays in memory.
    """

    number: int
    take: Take
    picture: bytes


@dataclass(frozen=True)
class LessonState:
    """The state of a lesson.

    Attributes:
        label: The sign.
        wanted: Number of takes to collect.
        step: Collecting takes, training, or trying the result.
        recording: Whether a take, or the countdown before it, is in progress.
        status: Progress of collecting.
        hint: What to improve; empty if nothing.
        takes: Collected takes, without deleted ones.
        progress: Of the training, 0 to 1.
        error: The last error; empty if none.
        model: The taught model, while it is tried.
        report: How well the sign was learnt.
        seen: Recognition of the newest frame by the taught model.
    """

    label: str
    wanted: int
    step: Step = "collect"
    recording: bool = False
    status: Status = _READY
    hint: str = ""
    takes: tuple[Collected, ...] = ()
    progress: float = 0.0
    error: str = ""
    model: CustomModel | None = None
    report: TrainingReport | None = None
    seen: Recognition | None = None

    @property
    def can_train(self) -> bool:
        """Whether there are enough takes."""
        return len(self.takes) >= _LEAST_TAKES and not self.recording


class Lesson:
    """Collect takes, train, try the result; calls that do not fit the current step have no effect.

    Args:
        facts: Of all takes, including the sign.
        plan: Number and length of takes.

    Attributes:
        facts: Of all takes.
        state: The state, replaced by each change.
    """

    def __init__(self, facts: Facts, plan: TeachConfig) -> None:
        self.facts = facts
        self.state = LessonState(facts.label, plan.takes)
        self._plan = plan
        self._collector: Collector | None = None
        self._hands: list[Hand] = []
        self._count = 0

    def record(self) -> None:
        """Start the countdown to the missing takes, or to one more if none is missing."""
        room = MOST_TAKES - len(self.state.takes)
        if self.state.step != "collect" or self.state.recording or room <= 0:
            return
        missing = max(1, self._plan.takes - len(self.state.takes))
        self._collector = Collector(
            self.facts, takes=min(missing, room), take_s=self._plan.take_time, countdown_s=self._plan.countdown
        )
        self._hands = []
        self._set(recording=True, error="")

    def pause(self) -> None:
        """Drop the current take, and stop collecting until :meth:`record`."""
        self._collector = None
        self._hands = []
        self._set(recording=False, status=_READY)

    def see(self, hand: Hand | None, guess: SignGuess, dt_s: float) -> Status:
        """Process the next frame while takes are collected, and return the progress.

        ``guess`` is what the classifier of known signs recognises ``hand`` as; ``dt_s`` are the seconds since the last
        frame.
        """
        if self.state.step != "collect":
            return _READY
        status = _READY
        if self._collector is not None:
            status = self._collector.step(hand, dt_s)
            self._note(status, hand)
            if self._collector.done:
                self._collector = None
        self._set(recording=self._collector is not None, status=status, hint=hint(hand, guess, self._hands))
        return status

    def add(self, take: Take, picture: bytes) -> None:
        """Add a finished take."""
        self._count += 1
        self._set(takes=(*self.state.takes, Collected(self._count, take, picture)))

    def delete(self, number: int) -> None:
        """Delete a take; it is replaced by another one while takes are recorded."""
        left = tuple(each for each in self.state.takes if each.number != number)
        if self.state.step == "collect" and len(left) < len(self.state.takes):
            self._set(takes=left)
            if self._collector is not None:
                self._collector.again()

    def lose_frames(self) -> None:
        """Report that no frames arrive."""
        self._set(hint="No picture comes from the camera.", seen=None)

    def begin_training(self) -> bool:
        """Start the training if there are enough takes; return whether it has started."""
        if self.state.step != "collect" or not self.state.can_train:
            return False
        self._set(step="train", progress=0.0, error="")
        return True

    def advance(self, done: int, of: int) -> None:
        """Set the number of training steps that are done."""
        self._set(progress=done / of)

    def learn(self, model: CustomModel, report: TrainingReport) -> None:
        """Set the result of the training, to be tried."""
        if self.state.step == "train":
            self._set(step="try", model=model, report=report, seen=None)

    def try_out(self, seen: Recognition) -> None:
        """Set the recognition of the next frame by the taught model."""
        if self.state.step == "try":
            self._set(seen=seen, hint="")

    def go_back(self, error: str = "") -> None:
        """Return to collecting, with all takes; ``error`` is shown."""
        self._set(step="collect", model=None, report=None, error=error)
        self.pause()

    def _set(self, **changes: Any) -> None:
        self.state = replace(self.state, **changes)

    def _note(self, status: Status, hand: Hand | None) -> None:
        if status.finished is not None or status.failed:
            self._hands = []
            self._set(error=_TOO_FEW if status.failed else "")
        elif status.phase == "recording" and hand is not None:
            self._hands.append(hand)


def counted(state: LessonState) -> str:
    """Return the number of takes of ``state``, and of their hands, in words."""
    takes, hands = len(state.takes), sum(len(each.take.hands) for each in state.takes)
    of = f" of {state.wanted}" if takes <= state.wanted else ""
    return f"{takes}{of} takes, {hands} hands"


def instruction(state: LessonState) -> tuple[str, str]:
    """Return the current instruction while takes are recorded: a number, and words."""
    if state.status.phase == "recording":
        return str(state.status.hands), f"hands: show {state.label}"
    return str(math.ceil(state.status.left_s)), f"then show {state.label}"


def outcome(seen: Recognition | None, label: str, action_of: Callable[[str], Action]) -> tuple[str, str]:
    """Return in words how the taught model recognises the hand, and what the robot would do.

    Args:
        seen: The recognition of the newest frame; None without a frame.
        label: The taught sign.
        action_of: Returns the action of a sign, current or intended.
    """
    if seen is None:
        return "No picture", ""
    if seen.hand is None:
        return "No hand", "no hand is in view"
    if seen.seen == NONE:
        return "No sign", f"show {label}" if label != NONE else "which is correct"
    return f"{seen.seen}, {seen.confidence:.0%}", f"would mean: {EFFECTS[action_of(seen.seen)]}"
