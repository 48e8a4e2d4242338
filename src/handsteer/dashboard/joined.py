"""What the page does with a graph beside publishing and subscribing, wherever that graph runs."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Protocol

from handsteer.cameras.browser import Source
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.nodes.steering import SteeringNode
from handsteer.robots.world import World
from handsteer.transports.protocol import Transport


class BrowserFrames(Protocol):
    """Takes the frames of a browser's camera, as :class:`~handsteer.cameras.browser.BrowserCamera` does."""

    @property
    def is_given(self) -> bool:
        """Whether a browser has sent frames, and has not been forgotten since."""
        ...

    def offer(self, data: bytes) -> None:
        """Take a frame as it was sent.

        Raises:
            FrameError: It is no such frame, or too large.
        """
        ...

    def forget(self) -> None:
        """Drop what is known of the browser: another may follow."""
        ...


class Cameras(Protocol):
    """The graph's camera, which a browser's may stand in for."""

    @property
    def source(self) -> Source:
        """Which one is chosen."""
        ...

    @property
    def browser(self) -> BrowserFrames:
        """Takes the frames of the browser's."""
        ...

    def choose(self, source: Source) -> None:
        """Read from ``source`` from now on."""
        ...


class RobotInWorld(Protocol):
    """A robot whose world people edit; the methods are those of :class:`~handsteer.nodes.robot.RobotNode`."""

    @property
    def world(self) -> World | None:
        """The world that the robot is in, all things where they were at the start; None for a real one's."""
        ...

    def change_world(self, change: Callable[[World], World]) -> Future[None]:
        """Change the world around the robot; ``change`` can be pickled, as it may run in another process."""
        ...

    def enter_world(self, world: World) -> Future[None]:
        """Put the robot to the start of another world."""
        ...

    def reset(self) -> Future[None]:
        """Put the robot and all things to where they were at the start."""
        ...


class JoinedGraph(Protocol):
    """The graph that a page is of: one in this process, or another process's seen from here."""

    @property
    def config(self) -> Config: ...  # noqa: D102

    @property
    def transport(self) -> Transport: ...  # noqa: D102

    @property
    def clock(self) -> Clock: ...  # noqa: D102

    @property
    def steering(self) -> SteeringNode: ...  # noqa: D102

    @property
    def cameras(self) -> Cameras: ...  # noqa: D102

    @property
    def robot(self) -> RobotInWorld: ...  # noqa: D102

    def reconfigure(self, config: Config) -> None:
        """Let the nodes take what can change while they run.

        Raises:
            ConfigError: A node cannot take it; nothing has changed.
        """
        ...
