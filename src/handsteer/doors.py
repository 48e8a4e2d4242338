"""The doors: entry points by which plug-ins come in, our own and those of other distributions alike.

A distribution declares an object of its own in its ``pyproject.toml``, under the group of a door::

    [project.entry-points."handsteer.robots"]
    printer = "my_package.robot:open_robot"

Once it is installed, ``--robot printer`` drives it. What is installed is listed at once, and loaded only when it is
named. docs/plugins.md has an example for each door but the last two, which handsteer keeps for itself.
"""

import importlib.metadata
import logging
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Generic, ParamSpec, Protocol, TypeVar

from handsteer.errors import PLUGIN_FAILURES, HandsteerError, PluginError, did_you_mean

if TYPE_CHECKING:
    from handsteer.cameras import Camera
    from handsteer.clock import Clock
    from handsteer.config import Config, Section, SignsConfig
    from handsteer.control.assist import Around
    from handsteer.control.obstacles import Hit
    from handsteer.recognition.hand import Classifier
    from handsteer.robots import Robot
    from handsteer.transports.base import Session
    from handsteer.types import Velocity

log = logging.getLogger(__name__)

_OURS: Final = "handsteer"

T = TypeVar("T")
Made = TypeVar("Made")
P = ParamSpec("P")


class SignAction(Protocol):
    """What a sign does to the velocity, besides the built-in actions.

    Attributes:
        effect: What it does, for people, such as ``stops and blinks``.
    """

    effect: str

    def velocity(self, now: "Velocity", since_last_s: float) -> "Velocity":
        """Return the velocity to command for one message with the sign; the limits of the control apply to it.

        It is called on the control's thread, so it must return at once. If it raises, the robot stops, and
        nothing moves before a sign that stops.

        Args:
            now: The velocity that is commanded so far.
            since_last_s: Seconds since the last message with a sign, at most ``control.sign_timeout``; 0 for the first.
        """
        ...


class Assist(Protocol):
    """Changes what a person wants, for what a laser scanner sees; the collision monitor then limits it."""

    def step(self, wanted: "Velocity", around: "Around") -> "tuple[Velocity, Hit | None]":
        """Return the velocity to command instead of ``wanted``, and the obstacle that it avoids, or None.

        It is called on the control's thread for every command, so it must return at once. If it raises, or returns what
        :func:`handsteer.control.assist.is_within` refuses, ``wanted`` is limited as without it.

        Args:
            wanted: What the person wants; finite.
            around: The obstacles and the robot.
        """
        ...


class Door(Generic[T]):
    """A group of entry points.

    Args:
        group: Its name, such as ``handsteer.robots``.
        what: What comes in, for messages, such as ``robot``.
        needs: Attributes without which something that is opened is not one.
    """

    def __init__(self, group: str, what: str, needs: Sequence[str] = ()) -> None:
        self.group = group
        self._what = what
        self._needs = needs

    def names(self) -> tuple[str, ...]:
        """Return the names of what is installed, our own first."""
        return tuple(_entries(self.group))

    def target(self, name: str) -> str:
        """Return where the object is, as ``module:attribute``, without loading it.

        Raises:
            PluginError: There is none of this name.
        """
        return self._entry(name).value

    def load(self, name: str) -> T:
        """Return the object of this name.

        Raises:
            PluginError: There is none, or it cannot be loaded.
        """
        entry = self._entry(name)
        try:
            found: T = entry.load()
        except PLUGIN_FAILURES as error:
            raise self._failed(name, "loaded", error) from error
        return found

    def open(self: "Door[Callable[P, Made]]", name: str, *arguments: P.args, **options: P.kwargs) -> "Made":
        """Return what the function of this name makes of its arguments.

        Raises:
            PluginError: There is none, it cannot be loaded or opened, or lacks what it needs.
            HandsteerError: It says itself, by one, why it cannot be opened.
        """
        make = self.load(name)
        try:
            made = make(*arguments, **options)
        except HandsteerError:
            raise
        except PLUGIN_FAILURES as error:
            dist = self._entry(name).dist
            if dist is not None and dist.name == _OURS:
                raise
            raise self._failed(name, "opened", error) from error
        missing = [need for need in self._needs if not hasattr(made, need)]
        if missing:
            raise PluginError(f"{self.described(name)} is of type {type(made).__name__} without {', '.join(missing)}")
        return made

    def described(self, name: str) -> str:
        """Return what is of this name, with its distribution, for messages."""
        entry = self._entry(name)
        return f"the {self._what} {name} of {entry.dist.name if entry.dist else 'an unknown distribution'}"

    def _failed(self, name: str, done: str, error: BaseException) -> PluginError:
        return PluginError(f"{self.described(name)} cannot be {done}: {type(error).__name__}: {error}")

    def _entry(self, name: str) -> importlib.metadata.EntryPoint:
        entries = _entries(self.group)
        if all(package != _OURS for package, _ in _installed()):
            raise PluginError(
                "handsteer's own entry points are missing: install it again, as by make run or pip install"
            )
        if name not in entries:
            near = did_you_mean(name, entries)
            raise PluginError(f"there is no {self._what} {name!r}{near or ':'} installed are {', '.join(entries)}")
        return entries[name]


@cache
def _installed() -> tuple[tuple[str, importlib.metadata.EntryPoint], ...]:
    """Return the entry points of all doors, each with its distribution's name, our own first; searches only once."""
    found: list[tuple[str, importlib.metadata.EntryPoint]] = []
    for package in importlib.metadata.distributions():
        entries = [entry for entry in package.entry_points if entry.group.startswith(f"{_OURS}.")]
        if entries:  # to find a distribution's name, all of its metadata is parsed
            name = package.name
            found += [(name, entry) for entry in entries]
    return tuple(sorted(found, key=lambda each: (each[0] != _OURS, each[1].name)))


@cache
def _entries(group: str) -> dict[str, importlib.metadata.EntryPoint]:
    """Return what is installed by name, our own first; of two with one name ours, or the first found, is kept."""
    entries: dict[str, importlib.metadata.EntryPoint] = {}
    for _, entry in _installed():
        if entry.group != group:
            continue
        if entry.name not in entries:
            entries[entry.name] = entry
        elif entry.value != entries[entry.name].value:
            used = entries[entry.name].value
            log.warning("%s: %s has the name %s of %s, and is not used", group, entry.value, entry.name, used)
    return entries


CAMERAS: Final[Door[Callable[["Config", "Clock"], "Camera"]]] = Door(
    "handsteer.cameras", "camera", ("name", "period_s", "read", "close")
)
"""Open a camera; ``camera.source`` is its name."""

ROBOTS: Final[Door[Callable[["Config", "Clock"], "Robot"]]] = Door(
    "handsteer.robots", "robot", ("description", "command", "step", "obstacles", "scan", "commanders", "close")
)
"""Open a robot; ``robot.kind`` is its name."""

TRANSPORTS: Final[Door[Callable[[str, Sequence[str]], "Session"]]] = Door("handsteer.transports", "transport")
"""Join a graph of several processes, as a node of a name, with arguments in the syntax of the transport."""

CLASSIFIERS: Final[Door[Callable[["SignsConfig"], "Classifier"]]] = Door(
    "handsteer.classifiers", "classifier", ("signs", "classify", "confidence")
)
"""Open a classifier of hands; ``signs.classifier`` is its name."""

ACTIONS: Final[Door[type[SignAction]]] = Door("handsteer.actions", "action")
"""Classes of what a sign does, made without arguments; an entry of ``control.actions`` is the name."""

ASSISTS: Final[Door[type[Assist]]] = Door("handsteer.assists", "assist")
"""Classes that change commands for obstacles, made without arguments; ``control.assist`` is the name."""

PARAMETERS: Final[Door[type["Section"]]] = Door("handsteer.parameters", "section of parameters")
"""Sections of the configuration; their name is that of the section."""

VERBS: Final[Door[Any]] = Door("handsteer.verbs", "verb")
"""Functions that the command line runs by their name; an app of cyclopts, which has several, is called ``app``."""

PAGES: Final[Door[Any]] = Door("handsteer.pages", "page")
"""Pages of the web page, at ``/NAME``."""

RECORDERS: Final[Door[Callable[..., Any]]] = Door("handsteer.recorders", "recorder")
"""Record the topics of a graph to a file."""

COMPANIONS: Final[Door[Callable[..., Any]]] = Door("handsteer.companions", "companion")
"""What runs next to the graph, such as the process of the page."""
