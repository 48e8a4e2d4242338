"""Manages lessons: who teaches, where the results are stored, and how the running graph adopts them."""

import datetime
import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from handsteer.config import Config, ControlConfig, SignsConfig, validate
from handsteer.config.driving import SIGN_EFFECTS
from handsteer.errors import ConfigError, DatasetError
from handsteer.graph import Graph
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lesson_node import LessonNode, OpenModels
from handsteer.plugins.page.lesson_state import LessonState
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.teach.collect import Facts
from handsteer.plugins.teach.dataset import Dataset, load_dataset, save_dataset
from handsteer.plugins.teach.exchange import load_shared, save_shared
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from handsteer.recognition.hand import Classifier, Landmarker
from handsteer.recognition.recognizer import open_classifier, open_landmarker
from handsteer.types import NONE, Action, action_of, find_sign

KEPT: Final = "Kept, and in use. End the lesson, then press Reset to drive."
KEPT_TAKES: Final = "The takes are kept. Train to use them."

_LONGEST_PERSON: Final = 40


@dataclass
class _Current:
    viewer: str
    node: LessonNode
    read: "_Version"


_Version = tuple[int, int] | None
"""Identifies the content of a file; None if there is none."""


class Lessons:
    """Runs one lesson at a time on a running graph; thread-safe.

    :meth:`begin`, :meth:`save`, :meth:`share` and :meth:`take_file` read and write files.

    Args:
        graph: Uses what is taught.
        open_models: Opens the landmarker and the classifier of the shipped signs for a lesson; those of the graph's
            configuration by default.
    """

    def __init__(self, graph: Graph | RemoteGraph, open_models: OpenModels | None = None) -> None:
        self._graph = graph
        self._plan = graph.config.teach
        self._open_models = open_models or partial(_open_models, graph.config)
        self._lock = threading.RLock()
        self._current: _Current | None = None
        self._draft: LessonState | None = None
        self._draft_read: _Version = None
        self._closed = False

    @property
    def is_running(self) -> bool:
        """Whether any viewer teaches."""
        return self._current is not None

    @property
    def draft(self) -> LessonState | None:
        """The last lesson, if it ended with something that was not kept; it stays in memory."""
        return self._draft

    @property
    def signs(self) -> SignsConfig:
        """The running parameters of recognition."""
        return self._graph.config.signs

    @property
    def model_path(self) -> Path:
        """The file that the taught model is written to."""
        return self._graph.config.signs.model or self._plan.model

    @property
    def takes_wanted(self) -> int:
        """Number of takes of a sign."""
        return self._plan.takes

    def actions(self) -> tuple[Action, ...]:
        """Return the available actions."""
        several = bool(self._graph.config.control.robots)
        return tuple(action for action in SIGN_EFFECTS if several or action != "next_robot")

    def action_of(self, label: str) -> Action:
        """Return the current or default action of the sign ``label``."""
        return action_of(label, self._graph.config.control.actions)

    def chosen_action(self, label: str, state: LessonState) -> Action | None:
        """Return the action of the sign ``label``; None if none was ever chosen for it."""
        actions = self._graph.config.control.actions
        in_use = state.kept_model.labels if state.kept_model is not None else ()
        return action_of(label, actions) if find_sign(label, [*actions, *in_use]) else None

    def begin(self, viewer: str, person: str = "", *, restore: bool = False) -> None:
        """Begin a lesson on the takes of earlier ones; a lesson abandoned by another viewer ends.

        ``person`` shows the signs; ``me`` by default. With ``restore``, the last lesson goes on, if it was not kept.

        Raises:
            DatasetError: It is not a valid name, or the file of takes is damaged.
            ModelError: The file to be overwritten is not a model of taught signs.
        """
        path = self._plan.dataset.expanduser()
        read = _version(path)
        dataset = load_dataset(path) if path.exists() else Dataset()
        old = self.model_path.expanduser()
        model = load_custom_model(old) if old.exists() else None
        when = f"{datetime.datetime.now():%Y-%m-%d %H:%M}"
        lesson = Lesson(dataset, self._plan, Facts(NONE, person_named(person), when, "page"), model)
        with self._lock:
            self._end()
            if self._closed:
                return
            if restore and self._draft is not None:
                lesson.restore(self._draft)
                if read != self._draft_read:
                    lesson.add_dataset(dataset, None)  # of another program, since then
            self._draft = None
            graph = self._graph
            # Read for each frame, because the parameter can change during the lesson.
            node = LessonNode(graph.transport, graph.clock, lesson, self._open_models, lambda: self.signs.swap_sides)
            self._current = _Current(viewer, node, read)
            node.start()

    def node(self, viewer: str) -> LessonNode | None:
        """Return the lesson of ``viewer``, if any."""
        current = self._current
        return current.node if current is not None and current.viewer == viewer else None

    def save(self, viewer: str, actions: Mapping[str, str]) -> None:
        """Save the takes, and the model if it was learnt from them, which the graph uses from then on.

        The robot obeys the signs as soon as it may move again, each by its action of ``actions``.

        Raises:
            ConfigError: An action does not exist or was never chosen, or the running nodes reject a sign.
            DatasetError: The file of takes has changed, or cannot be written.
            ModelError: The model cannot be written.
        """
        with self._lock:
            current = self._current
            if current is None or current.viewer != viewer:
                return
            state, dataset = current.node.state, current.node.do(Lesson.dataset)
            labels = [one.label for one in state.classes if one.label != NONE]
            effects = {label: self._action(actions[label]) for label in labels if label in actions}
            path = self._plan.dataset.expanduser()
            if _version(path) != current.read:
                raise DatasetError(f"{path} was changed by another program: end the lesson, and begin another")
            gone = [label for label in (state.model.labels if state.model is not None else ()) if label not in labels]
            takes = f"The takes are kept. Until you train, {gone[0]} counts as before." if gone else KEPT_TAKES
            message = takes
            had = {one.label for one in state.kept}
            if state.model is not None and not labels and had.issuperset(state.model.labels):
                self._forget_model(had)
                current.node.do(Lesson.forget_model)
                message = KEPT
            elif state.model is not None and (state.is_fresh or state.learnt_from is None):
                for label in state.model.labels:
                    if label in labels and label not in effects and self.chosen_action(label, state) is None:
                        raise ConfigError(f"choose first what the robot does at {label}")
                if state.is_fresh:
                    save_custom_model(state.model, self.model_path.expanduser())
                removed = had - {*labels, *state.model.labels}
                self._graph.reconfigure(with_signs(self._graph.config, self.model_path, effects, removed))
                message = takes if state.lost else KEPT
            save_dataset(dataset, path)
            current.read = _version(path)
            current.node.do(lambda lesson: lesson.mark_kept(message))

    def _forget_model(self, removed: Iterable[str]) -> None:
        """Delete the model, all of whose signs are ``removed``, and let the graph use none."""
        path = self.model_path.expanduser()
        self._graph.reconfigure(with_signs(self._graph.config, None, {}, removed))
        path.unlink(missing_ok=True)

    def share(self, viewer: str, path: Path) -> bool:
        """Write the takes and the model of the lesson of ``viewer`` to ``path``; return whether there is a lesson.

        Raises:
            DatasetError: It cannot be written.
        """
        node = self.node(viewer)
        if node is None:
            return False
        state = node.state
        save_shared(path, node.do(Lesson.dataset), state.model if state.is_fresh else None)
        return True

    def take_file(self, viewer: str, path: Path) -> None:
        """Add the takes and the model of an untrusted file to the lesson of ``viewer``, which shows any error."""
        node = self.node(viewer)
        if node is None:
            return
        try:
            dataset, model = load_shared(path)
            node.do(lambda lesson: lesson.add_dataset(dataset, model))
        except DatasetError as error:
            sentence = str(error).replace(str(path), "The file")
            node.do(lambda lesson: lesson.say(f"{sentence[:1].upper()}{sentence[1:]}."))

    def end(self, viewer: str) -> None:
        """End the lesson of ``viewer``, if any; what was not kept can be restored until the next lesson."""
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
            if current.node.state.is_changed:
                self._draft, self._draft_read = current.node.state, current.read
            # Off this thread, which may be the server's: a frame may be in progress.
            threading.Thread(target=current.node.stop, name="lesson_end", daemon=True).start()

    def _action(self, name: str) -> Action:
        found = next((each for each in self.actions() if each == name), None)
        if found is None:
            raise ConfigError(f"{name!r} is not a valid action: choose one of {', '.join(self.actions())}")
        return found


def _open_models(config: Config) -> tuple[Landmarker, Classifier]:
    return open_landmarker(config), open_classifier(config.signs.model_copy(update={"model": None}))


def with_signs(
    config: Config, model: Path | None, actions: Mapping[str, Action], removed: Iterable[str] = ()
) -> Config:
    """Return ``config`` with another ``model`` of taught signs, their actions, and without those of ``removed`` signs.

    Raises:
        ConfigError: A sign cannot have its action.
    """
    control = config.control
    gone = {find_sign(label, control.actions) for label in removed}
    wanted = {name: action for name, action in control.actions.items() if name not in gone}
    for label, action in actions.items():
        name = find_sign(label, wanted)
        if name is not None or action != action_of(label, {}):
            wanted[name or label] = action
    if wanted != control.actions:
        control = validate(ControlConfig, {**control.model_dump(exclude_unset=True), "actions": wanted})
    signs = config.signs.model_copy(update={"model": model})
    return config.model_copy(update={"signs": signs, "control": control})


def _version(path: Path) -> _Version:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def person_named(name: str) -> str:
    """Return the name of a person without needless spaces, ``me`` if it is empty.

    Raises:
        DatasetError: It is not a valid name.
    """
    name = " ".join(name.split())
    if len(name) > _LONGEST_PERSON or not name.isprintable():
        raise DatasetError(
            f"{name[:60]!r} is not a valid name of a person: give up to {_LONGEST_PERSON} printable characters"
        )
    return name or "me"
