"""What the page uses of a graph in addition to topics, in whichever process that graph runs."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Protocol

from handsteer.cameras.browser import Source
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.nodes.steering import SteeringNode
from handsteer.robots.world import World
from handsteer.transports.base import Transport


class BrowserFrames(Protocol):
    """Receives the frames of a browser's camera, like :class:`~handsteer.cameras.browser.BrowserCamera`."""

    @property
    def is_given(self) -> bool:
        """Whether a browser has sent frames since the last :meth:`forget`."""
        ...

    def offer(self, data: bytes) -> None:
        """Accept an encoded frame.

        Raises:
            FrameError: It cannot be decoded, or is too large.
        """
        ...

    def forget(self) -> None:
        """Forget the current browser; another may follow."""
        ...


class Cameras(Protocol):
    """The graph's camera, which a browser's camera can replace."""

    @property
    def source(self) -> Source:
        """The selected camera."""
        ...

    @property
    def browser(self) -> BrowserFrames:
        """Receives the frames of the browser's camera."""
        ...

    def choose(self, source: Source) -> None:
        """Read from ``source`` from now on."""
        ...


class RobotInWorld(Protocol):
    """A robot with an editable world; the methods are those of :class:`~handsteer.nodes.robot.RobotNode`."""

    @property
    def world(self) -> World | None:
        """The robot's world with all things at their start positions; None for a real robot."""
        ...

    def change_world(self, change: Callable[[World], World]) -> Future[None]:
        """Change the robot's world; ``change`` must be picklable, because it may run in another process."""
        ...

    def enter_world(self, world: World) -> Future[None]:
        """Move the robot to the start of another world."""
        ...

    def reset(self) -> Future[None]:
        """Move the robot and all things to their start positions."""
        ...


class JoinedGraph(Protocol):
    """The graph of a page, in this process or another one."""

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
        """Apply the live parameters of ``config`` to the nodes.

        Raises:
            ConfigError: A node rejects them; nothing has changed.
        """
        ...
