"""The steps of a lesson that teaches one sign, without page, clock, camera or threads."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from handsteer.config import TeachConfig
from handsteer.recognition.classifier import SignGuess
from handsteer.recognition.custom_signs import CustomModel
from handsteer.recognition.features import KNUCKLES, WRIST
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognition
from handsteer.recognition.shipped_signs import SURE
from handsteer.training.custom.collect import Collector, Facts, Status
from handsteer.training.custom.dataset import Take
from handsteer.training.custom.report import TrainingReport
from handsteer.types import NONE

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
class View:
    """The state of a lesson for the page.

    Attributes:
        label: The sign.
        step: Collecting takes, training, or trying the result.
        recording: Whether takes are being recorded.
        status: Progress of collecting.
        hint: What to improve; empty if nothing.
        takes: Collected takes, without deleted ones.
        wanted: Number of takes to collect.
        can_train: Whether there are enough takes.
        progress: Of the training, 0 to 1.
        trouble: The last error; empty if none.
        report: How well the sign was learnt.
        seen: Recognition of the newest frame by the taught model.
    """

    label: str
    step: Step
    recording: bool
    status: Status
    hint: str
    takes: tuple[Collected, ...]
    wanted: int
    can_train: bool
    progress: float
    trouble: str
    report: TrainingReport | None
    seen: Recognition | None


class Lesson:
    """Collect takes, train, try the result; calls that do not fit the current step have no effect.

    Args:
        facts: Of all takes, including the sign.
        plan: Number and length of takes.
    """

    def __init__(self, facts: Facts, plan: TeachConfig) -> None:
        self.facts = facts
        self.step: Step = "collect"
        self.model: CustomModel | None = None
        self._plan = plan
        self._collector: Collector | None = None
        self._status = _READY
        self._hint = ""
        self._hands: list[Hand] = []
        self._takes: list[Collected] = []
        self._count = 0
        self._progress = 0.0
        self._trouble = ""
        self._report: TrainingReport | None = None
        self._seen: Recognition | None = None

    @property
    def takes(self) -> tuple[Take, ...]:
        """Collected takes, without deleted ones."""
        return tuple(each.take for each in self._takes)

    @property
    def is_recording(self) -> bool:
        """Whether a take, or the countdown before it, is in progress."""
        return self._collector is not None

    @property
    def view(self) -> View:
        """The state for the page."""
        return View(
            label=self.facts.label,
            step=self.step,
            recording=self.is_recording,
            status=self._status,
            hint=self._hint,
            takes=tuple(self._takes),
            wanted=self._plan.takes,
            can_train=len(self._takes) >= _LEAST_TAKES and not self.is_recording,
            progress=self._progress,
            trouble=self._trouble,
            report=self._report,
            seen=self._seen,
        )

    def record(self) -> None:
        """Start the countdown to the missing takes, or to one more if none is missing."""
        room = MOST_TAKES - len(self._takes)
        if self.step != "collect" or self.is_recording or room <= 0:
            return
        missing = max(1, self._plan.takes - len(self._takes))
        self._collector = Collector(
            self.facts, takes=min(missing, room), take_s=self._plan.take_time, countdown_s=self._plan.countdown
        )
        self._trouble = ""
        self._hands = []

    def pause(self) -> None:
        """Drop the current take, and stop collecting until :meth:`record`."""
        self._collector = None
        self._status = _READY
        self._hands = []

    def see(self, hand: Hand | None, guess: SignGuess, dt_s: float) -> Status:
        """Process the next frame while takes are collected, and return the progress.

        ``guess`` is what the classifier of known signs recognises ``hand`` as; ``dt_s`` are the seconds since the last
        frame.
        """
        if self.step != "collect":
            return _READY
        self._status = _READY
        if self._collector is not None:
            self._status = self._collector.step(hand, dt_s)
            self._note(hand)
            if self._collector.done:
                self._collector = None
        self._hint = hint(hand, guess, self._hands)
        return self._status

    def keep(self, take: Take, picture: bytes) -> None:
        """Store a finished take."""
        self._count += 1
        self._takes.append(Collected(self._count, take, picture))

    def delete(self, number: int) -> None:
        """Delete a take; it is replaced by another one while takes are recorded."""
        left = [each for each in self._takes if each.number != number]
        if self.step == "collect" and len(left) < len(self._takes):
            self._takes = left
            if self._collector is not None:
                self._collector.again()

    def lose_frames(self) -> None:
        """Report that no frames arrive."""
        self._hint = "No picture comes from the camera."
        self._seen = None

    def begin_training(self) -> bool:
        """Start the training if there are enough takes; return whether it has started."""
        if self.step != "collect" or not self.view.can_train:
            return False
        self.step, self._progress, self._trouble = "train", 0.0, ""
        return True

    def advance(self, done: int, of: int) -> None:
        """Set the number of training steps that are done."""
        self._progress = done / of

    def learn(self, model: CustomModel, report: TrainingReport) -> None:
        """Set the result of the training, to be tried."""
        if self.step == "train":
            self.step, self.model, self._report, self._seen = "try", model, report, None

    def try_out(self, seen: Recognition) -> None:
        """Set the recognition of the next frame by the taught model."""
        if self.step == "try":
            self._seen, self._hint = seen, ""

    def go_back(self, trouble: str = "") -> None:
        """Return to collecting, with all takes; ``trouble`` is the error to show."""
        self.step, self.model, self._report, self._trouble = "collect", None, None, trouble
        self.pause()

    def _note(self, hand: Hand | None) -> None:
        if self._status.finished is not None or self._status.failed:
            self._hands = []
            self._trouble = _TOO_FEW if self._status.failed else ""
        elif self._status.phase == "recording" and hand is not None:
            self._hands.append(hand)


def hands_in(takes: Sequence[Collected]) -> int:
    """Return how many hands there are in ``takes``."""
    return sum(len(each.take.hands) for each in takes)
