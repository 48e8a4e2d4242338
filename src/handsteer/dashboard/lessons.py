"""Manages lessons: who teaches, where the results are stored, and how the running graph adopts them."""

import datetime
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import yaml

from handsteer.clock import Clock
from handsteer.config import Config, ControlConfig, validate
from handsteer.dashboard.lesson import Lesson
from handsteer.dashboard.lesson_node import LessonNode, OpenModels
from handsteer.dashboard.remote_graph import RemoteGraph
from handsteer.errors import ConfigError, DatasetError
from handsteer.graph import Graph
from handsteer.recognition.custom_signs import label_for, load_custom_model, save_custom_model
from handsteer.recognition.hand import Classifier, Landmarker
from handsteer.recognition.recognizer import open_classifier, open_landmarker
from handsteer.training.custom.collect import Facts
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.transports.base import Transport
from handsteer.types import ACTIONS, NONE, SIGNS, Action, action_of, find_sign

_LONGEST_PERSON: Final = 40


@dataclass(frozen=True)
class LearntSign:
    """A sign that was taught and saved.

    Attributes:
        label: The sign.
        action: Its action; None for ``NONE``.
        dataset: The file with its takes.
        model: The file with the taught model, which is now in use.
        yaml: The lines of a configuration file that make the change permanent.
    """

    label: str
    action: Action | None
    dataset: Path
    model: Path
    yaml: str


@dataclass
class _Current:
    viewer: str
    node: LessonNode
    lost: tuple[str, ...]  # see Lessons.lost
    takes_are_saved: bool = False


class Lessons:
    """Runs one lesson at a time on a running graph; thread-safe.

    :meth:`known`, :meth:`begin` and :meth:`save` read and write files.

    Args:
        transport: Carries the graph's messages.
        clock: The graph's clock.
        open_models: Opens the landmarker and the classifier of the shipped signs, for a lesson.
        config: Returns the configuration of the running graph.
        reconfigure: Applies another one to the running graph; raises ConfigError if it is rejected.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        open_models: OpenModels,
        config: Callable[[], Config],
        reconfigure: Callable[[Config], None],
    ) -> None:
        self._transport, self._clock = transport, clock
        self._plan = config().teach
        self._open_models = open_models
        self._config = config
        self._reconfigure = reconfigure
        self._lock = threading.RLock()
        self._current: _Current | None = None
        self._closed = False

    @classmethod
    def of(cls, graph: Graph | RemoteGraph) -> "Lessons":
        """Return the lessons of a graph."""
        config = graph.config

        def open_models() -> tuple[Landmarker, Classifier]:
            return open_landmarker(config), open_classifier(config.signs.model_copy(update={"model": None}))

        return cls(graph.transport, graph.clock, open_models, lambda: graph.config, graph.reconfigure)

    @property
    def label(self) -> str | None:
        """The sign that is being taught by any viewer; None if none is."""
        current = self._current
        return current.node.state.label if current else None

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
        node = LessonNode(
            self._transport,
            self._clock,
            lesson=lesson,
            known=known,
            open_models=self._open_models,
            signs=lambda: self._config().signs,
        )
        with self._lock:
            self._end()
            if not self._closed:
                self._current = _Current(viewer, node, lost)
                node.start()

    def node(self, viewer: str) -> LessonNode | None:
        """Return the lesson of ``viewer``, if any."""
        current = self._current
        return current.node if current is not None and current.viewer == viewer else None

    def lost(self) -> tuple[str, ...]:
        """Return the signs of the current model that would be missing in this lesson's."""
        current = self._current
        return current.lost if current else ()

    def save(self, viewer: str, action: str) -> LearntSign | None:
        """Save the takes and the taught model, let the graph use it, and end the lesson.

        The robot obeys the sign as soon as it may move again.

        Args:
            viewer: The viewer who teaches.
            action: The sign's action.

        Returns:
            What was saved; None if ``viewer`` has no lesson, or nothing to save yet.

        Raises:
            ConfigError: The action does not exist, or the running nodes reject the sign.
            DatasetError: The file of takes is damaged, or cannot be written.
            ModelError: The model cannot be written.
        """
        with self._lock:
            current = self._current
            if current is None or current.viewer != viewer or (model := current.node.state.model) is None:
                return None
            state = current.node.state
            effect = next((each for each in self.actions() if each == action and state.label != NONE), None)
            if effect is None and state.label != NONE:
                raise ConfigError(f"{action!r} is no action: choose one of {', '.join(self.actions())}")
            path = self.model_path
            save_custom_model(model, path.expanduser())
            if not current.takes_are_saved:
                takes = [each.take for each in state.takes]
                save_dataset(self.known().with_takes(takes), self._plan.dataset.expanduser())
                current.takes_are_saved = True
            self._reconfigure(with_sign(self._config(), path, state.label, effect))
            self._end()
            return LearntSign(state.label, effect, self._plan.dataset, path, self._yaml(path))

    def end(self, viewer: str) -> None:
        """End the lesson of ``viewer``, if any, without saving anything."""
        with self._lock:
            if self.node(viewer) is not None:
                self._end()

    def close(self) -> None:
        """End any lesson permanently."""
        with self._lock:
            self._closed = True
            self._end()

    def _end(self) -> None:
        current, self._current = self._current, None
        if current is not None:
            # Off this thread, which may be the server's: a frame may be in progress.
            threading.Thread(target=current.node.stop, name="lesson_end", daemon=True).start()

    def _yaml(self, model: Path) -> str:
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
