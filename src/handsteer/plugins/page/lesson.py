"""A lesson: classes of hands, their takes, and the model trained from them; without page, clock, camera or threads."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from handsteer.config import TeachConfig
from handsteer.errors import DatasetError
from handsteer.plugins.page.lesson_state import NO_HAND, READY, Collected, LessonState, Seen, SignClass, filled, hint
from handsteer.plugins.teach.collect import Collector, Facts, Status
from handsteer.plugins.teach.dataset import Dataset, Take
from handsteer.plugins.teach.report import TrainingReport
from handsteer.recognition.custom_signs import CustomModel, label_for
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.types import NONE, SIGNS, find_sign

MOST_TAKES: Final = 50
"""Maximum number of takes of a class that can be recorded."""
MOST_CLASSES: Final = 20
"""Maximum number of classes."""
MOST_HANDS: Final = 100_000
"""Maximum number of hands of a lesson to which a file is added."""
LONGEST_HOLD_S: Final = 10.0
"""Maximum duration of a take that is recorded while a button is held."""
_MOST_UNDO: Final = 50
_TITLE_OF_NONE: Final = "background"
_TOO_FEW: Final = "Too few hands were seen: this take does not count."
_ADDED: Final = "The takes of the file are here: press Train, then try them."
_ADDED_READY: Final = "The signs of the file are here: try them, then keep them."


class Lesson:
    """Edits classes, records takes, and holds the result of training.

    Calls that do not fit the current state have no effect.

    Args:
        dataset: The takes of earlier lessons.
        plan: Number and length of takes.
        facts: Person, session and source of new takes; the label is ignored.
        model: The model in use, if any.

    Attributes:
        state: The state, replaced by each change.
    """

    def __init__(self, dataset: Dataset, plan: TeachConfig, facts: Facts, model: CustomModel | None = None) -> None:
        self._plan, self._facts = plan, facts
        self._count = 0
        self._collector: Collector | None = None
        self._hands: list[Hand] = []
        self._learning: tuple[SignClass, ...] = ()
        self._undo: list[tuple[str, SignClass]] = []
        # Takes of shipped signs are examples of other hands; the page does not show them.
        self._others = tuple(take for take in dataset.takes if take.label in SIGNS)
        labels = [*(label for label in dataset.labels if label not in (*SIGNS, NONE)), NONE]
        classes = tuple(self._class(label, dataset) for label in labels)
        self.state = LessonState(classes, kept=classes, kept_model=model, model=model)

    def restore(self, state: LessonState) -> None:
        """Continue with the classes of a lesson that has ended, and its model."""
        numbers = [each.number for one in state.classes for each in one.takes]
        self._count = max([self._count, *numbers, *(one.key for one in state.classes)])
        names = ("classes", "model", "learnt_from", "report", "take_numbers")
        self._set(**{name: getattr(state, name) for name in names})

    def add_class(self, name: str) -> None:
        """Add a class for the sign ``name``.

        Raises:
            DatasetError: It is not a valid name for a sign, or taken; or there are too many.
        """
        self._put(self._class(self._free_label(name)))

    def rename(self, key: int, name: str) -> None:
        """Give a class another name.

        Raises:
            DatasetError: It is not a valid name for a sign, or taken.
        """
        old = self.state.of(key)
        if old is not None and old.label not in (NONE, name) and not self._is_busy:
            self._put(replace(old, label=self._free_label(name, but=old.label)))

    def enable(self, key: int, *, on: bool) -> None:
        """Learn a class from the next training on, or leave it out."""
        old = self.state.of(key)
        if old is not None and old.label != NONE and old.is_enabled != on and not self._is_busy:
            self._put(replace(old, is_enabled=on))

    def delete_class(self, key: int) -> None:
        """Delete a class; of ``NONE``, its takes."""
        old = self.state.of(key)
        if old is None or self._is_busy:
            return
        self._undo.append((f"Undo: delete {_named(old.label)}", old))
        if old.label == NONE:
            self._put(replace(old, takes=()))
        else:
            self._set(classes=tuple(each for each in self.state.classes if each.key != key))

    def delete_take(self, number: int) -> None:
        """Delete a take."""
        if self.state.is_training:
            return
        for old in self.state.classes:
            gone = tuple(each for each in old.takes if each.number == number)
            if gone:
                self._undo.append((f"Undo: delete a take of {_named(old.label)}", replace(old, takes=gone)))
                self._put(replace(old, takes=tuple(each for each in old.takes if each.number != number)))

    def undo(self) -> None:
        """Undo the last deletion."""
        if not self._undo or self._is_busy:
            return
        _, gone = self._undo.pop()
        now = self.state.of(gone.key)
        if now is not None:
            takes = {each.number: each for each in (*now.takes, *gone.takes)}
            gone = replace(now, takes=tuple(takes[number] for number in sorted(takes)))
        elif any(find_sign(gone.label, [each.label]) for each in self.state.classes):
            self._set(message=f"There is another sign {gone.label} now: rename it, then teach this one again.")
            return
        self._put(gone)

    def record(self, key: int, *, hold: bool = False) -> None:
        """Record a take until :meth:`finish`; without ``hold``, the missing takes, each after a countdown."""
        to = self.state.of(key)
        if to is None or self._is_busy or len(to.takes) >= MOST_TAKES:
            return
        facts = replace(self._facts, label=to.label)
        if hold:
            self._collector = Collector(facts, takes=1, take_s=LONGEST_HOLD_S, countdown_s=0.0)
        else:
            missing = min(max(1, self._plan.takes - len(to.takes)), MOST_TAKES - len(to.takes))
            plan = self._plan
            self._collector = Collector(facts, takes=missing, take_s=plan.take_time, countdown_s=plan.countdown)
        self._hands = []
        self._set(recorded=key, is_held=hold, message="")

    def finish(self) -> None:
        """End the take that is being recorded, and keep it."""
        if self._collector is not None:
            self._note(self._collector.finish(), None)

    def pause(self) -> None:
        """Drop the current take, and stop recording."""
        self._collector = None
        self._hands = []
        self._set(recorded=None, status=READY)

    def see(self, hand: Hand | None, guess: SignGuess, confidences: Mapping[str, float], dt_s: float) -> None:
        """Process the next frame, ``dt_s`` seconds after the last: its hand, the model's guess, and each confidence."""
        none = {NONE: 1.0 - max(confidences.values(), default=0.0)} if hand is not None else {}
        self._set(seen=Seen(hand is not None, guess.sign, guess.confidence, {**confidences, **none}))
        if self._collector is not None:
            self._note(self._collector.step(hand, dt_s), hand)
        advice = hint(hand, guess, self._hands) if self.state.recorded is not None else ""
        self._set(hint=NO_HAND if hand is None else advice)

    def lose_frames(self) -> None:
        """Report that no frames arrive."""
        self._set(hint="No picture comes from the camera.", seen=None)

    def dataset(self) -> Dataset:
        """Return all takes, under the names of their classes."""
        takes = [replace(each.take, label=one.label) for one in self.state.classes for each in one.takes]
        disabled = frozenset(one.label for one in self.state.classes if not one.is_enabled and one.takes)
        return Dataset((*takes, *self._others), disabled)

    def add_dataset(self, dataset: Dataset, model: CustomModel | None) -> None:
        """Add the takes of a shared file; its ``model`` is tried if there were no own takes before.

        Raises:
            DatasetError: There would be too many classes or hands.
        """
        new = [label for label in dataset.labels if label not in SIGNS and self._class_of(label) is None]
        if len(self.state.classes) + len(new) > MOST_CLASSES:
            raise DatasetError(f"with this file there would be more than {MOST_CLASSES} classes")
        if sum(len(take.hands) for take in (*dataset.takes, *self.dataset().takes)) > MOST_HANDS:
            raise DatasetError(f"with this file there would be more than {MOST_HANDS} hands")
        was_empty = not any(one.takes for one in self.state.classes)
        before = self.state.classes
        for label in dataset.labels:
            if label not in SIGNS:
                old = self._class_of(label) or self._class(label)
                known = {_content(each.take) for each in old.takes}
                takes = [take for take in dataset.of(label) if _content(take) not in known]
                self._put(replace(old, takes=(*old.takes, *self._numbered(takes))))
        self._others = (*self._others, *(take for take in dataset.takes if take.label in SIGNS))
        adopted = model is not None and (was_empty or before == self.state.classes)
        if adopted:
            self._set(model=model, learnt_from=filled(self.state.classes), report=None, take_numbers=())
        self._set(message=_ADDED_READY if adopted else _ADDED)

    def begin_training(self) -> Dataset | None:
        """Start the training, if there is something to learn from; return its takes."""
        if not self.state.can_train:
            return None
        numbers = tuple(each.number for one in self.state.classes for each in one.takes)
        self._learning = filled(self.state.classes)
        self._set(progress=0.0, left_s=None, message="", take_numbers=numbers, report=None)
        return self.dataset()

    def advance(self, done: int, of: int, left_s: float | None = None) -> None:
        """Set the number of training steps that are done, and the seconds until the last."""
        self._set(progress=done / of, left_s=left_s)

    def learn(self, model: CustomModel, report: TrainingReport, took_s: float | None = None) -> None:
        """Set the result of the training, and how long it took."""
        if self.state.is_training:
            speed = {"rows_per_s": self.state.training_rows / took_s} if took_s else {}
            self._set(progress=None, model=model, report=report, learnt_from=self._learning, **speed)

    def end_training(self, message: str = "") -> None:
        """End the training without a result."""
        self._set(progress=None, message=message)

    def mark_kept(self, message: str) -> None:
        """Note that all has been kept."""
        model = self.state.model if self.state.is_fresh else self.state.kept_model
        self._set(kept=self.state.classes, kept_model=model, message=message)

    def forget_model(self) -> None:
        """Try no model any more: what it knew is deleted."""
        self._set(model=None, kept_model=None, learnt_from=None, report=None, take_numbers=())

    def say(self, message: str) -> None:
        """Show an error, or what has happened."""
        self._set(message=message)

    @property
    def _is_busy(self) -> bool:
        return self.state.is_training or self.state.recorded is not None

    def _class(self, label: str, dataset: Dataset | None = None) -> SignClass:
        self._count += 1
        empty = SignClass(self._count, label, is_enabled=dataset is None or label not in dataset.disabled)
        return replace(empty, takes=self._numbered(dataset.of(label))) if dataset is not None else empty

    def _numbered(self, takes: Sequence[Take]) -> tuple[Collected, ...]:
        first = self._count + 1
        self._count += len(takes)
        return tuple(Collected(number, take) for number, take in enumerate(takes, first))

    def _class_of(self, label: str) -> SignClass | None:
        return next((one for one in self.state.classes if one.label == label), None)

    def _free_label(self, name: str, but: str = "") -> str:
        taken = [each.label for each in self.state.classes if each.label != but]
        if not but and len(taken) >= MOST_CLASSES:
            raise DatasetError(f"there are {MOST_CLASSES} classes already: delete one first")
        label = label_for(name, taken)
        if label in (*SIGNS, NONE) or label.casefold() == _TITLE_OF_NONE:
            raise DatasetError(f"{label} is known already: give the new sign a name of its own")
        if label in taken:
            raise DatasetError(f"there is a sign {label} already: record more takes of that, or choose another name")
        return label

    def _put(self, one: SignClass) -> None:
        """Replace the class of the same key, or insert ``one`` before ``NONE``."""
        classes = self.state.classes
        if any(each.key == one.key for each in classes):
            self._set(classes=tuple(one if each.key == one.key else each for each in classes), message="")
        else:
            self._set(classes=(*classes[:-1], one, classes[-1]), message="")

    def _note(self, status: Status, hand: Hand | None) -> None:
        key = self.state.recorded
        to = self.state.of(key) if key is not None else None
        if status.finished is not None and to is not None:
            self._put(replace(to, takes=(*to.takes, *self._numbered([status.finished]))))
        if status.finished is not None or status.failed:
            self._hands = []
            self._set(message=_TOO_FEW if status.failed else "")
        elif status.phase == "recording" and hand is not None:
            self._hands.append(hand)
        if self._collector is not None and self._collector.done:
            self._collector = None
        self._set(recorded=key if self._collector is not None else None, status=status)

    def _set(self, **changes: Any) -> None:
        del self._undo[:-_MOST_UNDO]
        self.state = replace(self.state, **changes, undo=self._undo[-1][0] if self._undo else "")


def _content(take: Take) -> tuple[object, ...]:
    """Return what is the same in two copies of a take."""
    return len(take.hands), take.person, take.session, take.hands[0].points.tobytes() if take.hands else b""


def _named(label: str) -> str:
    return "the background" if label == NONE else label
