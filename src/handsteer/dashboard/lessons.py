"""Manages lessons: who teaches, where the results are stored, and how the running graph adopts them."""

import datetime
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import yaml

from handsteer.clock import Clock
from handsteer.config import Config, ControlConfig, TeachConfig, validate
from handsteer.dashboard.joined import JoinedGraph
from handsteer.dashboard.lesson import Lesson, View
from handsteer.dashboard.lesson_node import LessonNode, LessonVision
from handsteer.errors import ConfigError, DatasetError
from handsteer.recognition.custom_signs import label_for, load_custom_model, save_custom_model
from handsteer.recognition.recognizer import open_classifier, open_landmarker
from handsteer.training.custom.collect import Facts
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.transports.protocol import Transport
from handsteer.types import ACTIONS, NONE, SIGNS, Action, action_of, find_sign

_LONGEST_PERSON: Final = 40


@dataclass(frozen=True)
class Kept:
    """A sign that was taught and kept.

    Attributes:
        label: The sign.
        action: Its action; None for ``NONE``.
        dataset: The file with its takes.
        model: The file with the taught model, which is now in use.
        lines: YAML that makes the change permanent.
    """

    label: str
    action: Action | None
    dataset: Path
    model: Path
    lines: str


@dataclass
class _Given:
    """The current lesson.

    Attributes:
        viewer: The viewer who teaches.
        node: Runs it.
        lost: Signs of the current model that cannot be trained again, because there are no takes of them.
        takes_are_saved: Whether its takes are in the file.
    """

    viewer: str
    node: LessonNode
    lost: tuple[str, ...]
    takes_are_saved: bool = False


class Teaching:
    """Runs one lesson at a time on a running graph; thread-safe.

    :meth:`known`, :meth:`begin` and :meth:`keep` read and write files.

    Args:
        transport: Carries the graph's messages.
        clock: The graph's clock.
        plan: Files, and number and length of takes.
        eyes: Recognition for lessons.
        config: Returns the configuration of the running graph.
        reconfigure: Applies another one to the running graph; raises ConfigError if it is rejected.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        plan: TeachConfig,
        eyes: LessonVision,
        *,
        config: Callable[[], Config],
        reconfigure: Callable[[Config], None],
    ) -> None:
        self._wires = (transport, clock)
        self._plan = plan
        self._eyes = eyes
        self._config = config
        self._reconfigure = reconfigure
        self._lock = threading.RLock()
        self._given: _Given | None = None
        self._closed = False

    @classmethod
    def of(cls, graph: JoinedGraph) -> "Teaching":
        """Return the teaching for a graph."""
        config = graph.config
        eyes = LessonVision(
            open_landmarker=lambda: open_landmarker(config),
            open_shipped=lambda: open_classifier(config.signs.model_copy(update={"model": None})),
            signs=lambda: graph.config.signs,
        )
        wires = (graph.transport, graph.clock)
        return cls(*wires, config.teach, eyes, config=lambda: graph.config, reconfigure=graph.reconfigure)

    @property
    def label(self) -> str | None:
        """The sign that is being taught by any viewer; None if none is."""
        given = self._given
        return given.node.view.label if given else None

    @property
    def model_path(self) -> Path:
        """The file that the taught model is written to."""
        return self._config().signs.model or self._plan.model

    def known(self) -> Dataset:
        """Return the takes of earlier lessons.

        Raises:
            DatasetError: Their file is damaged.
        """
        path = self._plan.dataset.expanduser()
        return load_dataset(path) if path.exists() else Dataset()

    def actions(self) -> tuple[Action, ...]:
        """Return the available actions."""
        several = bool(self._config().control.robots)
        return tuple(action for action in ACTIONS if several or action != "next_robot")

    def action_of(self, label: str) -> Action:
        """Return the current or default action of the sign ``label``."""
        return action_of(label, self._config().control.actions)

    def begin(self, viewer: str, name: str, person: str = "") -> None:
        """Begin a lesson; a lesson abandoned by another viewer ends.

        Args:
            viewer: The viewer who teaches.
            name: The sign: taught before, new, or ``NONE`` for hands that are no sign.
            person: The person who shows it; ``me`` by default.

        Raises:
            DatasetError: It is not a valid name, the name of a shipped sign, or the file of takes is damaged.
            ModelError: The file to be overwritten is not a model of taught signs.
        """
        known = self.known()
        label = label_for(name, known.labels)
        if label in SIGNS:
            raise DatasetError(f"{label} is known already: give the new sign a name of its own")
        path = self.model_path.expanduser()
        old = load_custom_model(path).labels if path.exists() else ()
        lost = tuple(sign for sign in old if sign not in (*known.labels, label))
        when = f"{datetime.datetime.now():%Y-%m-%d %H:%M}"
        lesson = Lesson(Facts(label, _person(person), when, "page"), self._plan)
        node = LessonNode(*self._wires, lesson, known, self._eyes)
        with self._lock:
            self._end()
            if not self._closed:
                self._given = _Given(viewer, node, lost)
                node.start()

    def lesson(self, viewer: str) -> LessonNode | None:
        """Return the lesson of ``viewer``, if any."""
        given = self._given
        return given.node if given is not None and given.viewer == viewer else None

    def view(self, viewer: str) -> View | None:
        """Return the state of the lesson of ``viewer``, if any."""
        node = self.lesson(viewer)
        return node.view if node else None

    def lost(self) -> tuple[str, ...]:
        """Return the signs of the current model that would be missing in this lesson's."""
        given = self._given
        return given.lost if given else ()

    def keep(self, viewer: str, action: str) -> Kept | None:
        """Save the takes and the taught model, let the graph use it, and end the lesson.

        The robot obeys the sign as soon as it may move again.

        Args:
            viewer: The viewer who teaches.
            action: The sign's action.

        Returns:
            What was kept; None if ``viewer`` has no lesson, or nothing to keep yet.

        Raises:
            ConfigError: The action does not exist, or the running nodes reject the sign.
            DatasetError: The file of takes is damaged, or cannot be written.
            ModelError: The model cannot be written.
        """
        with self._lock:
            given = self._given
            model = given.node.learnt if given is not None and given.viewer == viewer else None
            if given is None or model is None:
                return None
            view = given.node.view
            does = next((each for each in self.actions() if each == action and view.label != NONE), None)
            if does is None and view.label != NONE:
                raise ConfigError(f"{action!r} is no action: choose one of {', '.join(self.actions())}")
            path = self.model_path
            save_custom_model(model, path.expanduser())
            if not given.takes_are_saved:
                takes = [each.take for each in view.takes]
                save_dataset(self.known().with_takes(takes), self._plan.dataset.expanduser())
                given.takes_are_saved = True
            self._reconfigure(with_sign(self._config(), path, view.label, does))
            self._end()
            return Kept(view.label, does, self._plan.dataset, path, self._lines(path))

    def end(self, viewer: str) -> None:
        """End the lesson of ``viewer``, if any, without keeping anything."""
        with self._lock:
            if self._given is not None and self._given.viewer == viewer:
                self._end()

    def close(self) -> None:
        """End any lesson permanently."""
        with self._lock:
            self._closed = True
            self._end()

    def _end(self) -> None:
        given, self._given = self._given, None
        if given is not None:
            # Off this thread, which may be the server's: a frame may be in progress.
            threading.Thread(target=given.node.stop, name="lesson_end", daemon=True).start()

    def _lines(self, model: Path) -> str:
        actions = dict(self._config().control.actions)
        content = {"signs": {"model": str(model)}, **({"control": {"actions": actions}} if actions else {})}
        return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def with_sign(config: Config, model: Path, label: str, action: Action | None) -> Config:
    """Return ``config`` with another model of taught signs, and with the action of the sign ``label``, if any.

    Raises:
        ConfigError: ``label`` cannot have that action.
    """
    control = config.control
    if action is not None:
        actions = {**control.actions, find_sign(label, control.actions) or label: action}
        control = validate(ControlConfig, {**control.model_dump(exclude_unset=True), "actions": actions})
    signs = config.signs.model_copy(update={"model": model})
    return config.model_copy(update={"signs": signs, "control": control})


def _person(name: str) -> str:
    name = " ".join(name.split())
    if len(name) > _LONGEST_PERSON or not name.isprintable():
        raise DatasetError(f"{name[:60]!r} is no name of a person: give up to {_LONGEST_PERSON} printable characters")
    return name or "me"
