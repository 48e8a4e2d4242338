"""The world around a simulated robot: changes requested by the page, the course, and the markers."""

import queue
from collections.abc import Callable
from concurrent.futures import Future

from handsteer.errors import WorldError
from handsteer.messages import WORLD_MARKERS, Header
from handsteer.nodes.base import Node
from handsteer.nodes.world_markers import Touches, gate_strips, world_markers
from handsteer.robots import InWorld, Robot, RobotState
from handsteer.robots.course import Referee
from handsteer.robots.world import Change, World
from handsteer.transports.base import Call
from handsteer.types import CourseState

_MARKERS_PERIOD_S = 0.05
_REPEAT_S = 0.5
_MOST_WAITING = 16


class Surroundings:
    """Publishes the obstacles and gates around a robot, counts the gates, and changes the world on request.

    A real robot has no world: it cannot be changed, and only what the robot itself knows is published.

    Args:
        node: The robot's node.
        robot: The robot.
        frame_id: Coordinate frame of the markers.
        before_change: Called on the node's thread before each change; stops the robot.
        after_restart: Called once the robot and the world are at the start.
    """

    def __init__(
        self,
        node: Node,
        robot: Robot,
        frame_id: str,
        *,
        before_change: Callable[[], None],
        after_restart: Callable[[], None],
    ) -> None:
        self._node = node
        self._robot = robot
        self._frame_id = frame_id
        self._before_change = before_change
        self._after_restart = after_restart
        self._in_world = robot if isinstance(robot, InWorld) else None
        self._waiting: queue.Queue[tuple[Callable[[], None], Future[None]]] = queue.Queue(_MOST_WAITING)
        self._referee = Referee(self._in_world.world.gates if self._in_world else ())
        self._touches = Touches()
        self._most_markers = 0
        self._published: tuple[object, ...] | None = None
        self._published_s = 0.0
        self._markers = node.publisher(WORLD_MARKERS)
        node.every(_MARKERS_PERIOD_S, self._publish)

    @property
    def world(self) -> World | None:
        """The robot's world, with all things in their initial places; None for a real robot."""
        return self._in_world.world if self._in_world else None

    @property
    def course(self) -> CourseState | None:
        """The progress on the course of its world; None if there is no course."""
        return self._referee.state if self._referee.state.gates else None

    def change(self, change: Change) -> Future[None]:
        """Stop the robot, and change the world around it; may be called from any thread.

        Args:
            change: Takes the world and returns the new one; runs on the node's thread.

        Returns:
            Done, or failed with the :class:`~handsteer.errors.WorldError` that explains why nothing has changed.
        """
        return self._ask(lambda: self._change(change))

    def enter(self, world: World) -> Future[None]:
        """Move the robot to the start of another world; see :meth:`change`."""
        return self._ask(lambda: self._restart(lambda robot: robot.enter(world)))

    def reset(self) -> Future[None]:
        """Reset the robot and all things to their initial places; see :meth:`change`."""
        return self._ask(lambda: self._restart(lambda robot: robot.reset()))

    def services(self) -> dict[str, Call]:
        """Return ``reset_odometry``, which sets the odometry to 0 at the current place; none for a real robot."""
        robot = self._in_world
        if robot is None:
            return {}

        def reset() -> str:
            self._ask(robot.reset_odometry)
            return "the odometry counts from here"

        return {"reset_odometry": reset}

    def make_changes(self) -> None:
        """Make the changes requested so far, in order, on this thread."""
        for _ in range(self._waiting.qsize()):
            change, future = self._waiting.get_nowait()
            if future.set_running_or_notify_cancel():
                try:
                    change()
                except WorldError as error:
                    future.set_exception(error)
                except Exception as error:
                    future.set_exception(error)
                    raise
                else:
                    future.set_result(None)

    def note(self, state: RobotState) -> None:
        """Count gates and remember touches of the robot in ``state``."""
        self._referee.step(state.truth, state.collisions or 0, state.time_s)
        self._touches.note(state.contacts, self._node.clock.now())

    def _ask(self, change: Callable[[], None]) -> Future[None]:
        """Queue ``change`` for the node's thread; may be called from any thread."""
        future: Future[None] = Future()
        try:
            self._waiting.put_nowait((change, future))
        except queue.Full:
            future.set_exception(WorldError("too many changes wait already: the robot is busy or has ended"))
        return future

    def _editable(self) -> InWorld:
        if self._in_world is None:
            raise WorldError("a real robot has no world that could be changed, and cannot be put to its start")
        return self._in_world

    def _change(self, change: Change) -> None:
        robot = self._editable()
        gates, world = robot.world.gates, change(robot.world)
        self._before_change()
        robot.change(world)
        if world.gates != gates:
            self._referee = Referee(world.gates)

    def _restart(self, begin: Callable[[InWorld], None]) -> None:
        robot = self._editable()
        self._before_change()
        begin(robot)
        self._referee = Referee(robot.world.gates)
        self._after_restart()

    def _publish(self) -> None:
        if not self._markers.has_subscribers:
            self._published = None
            return
        now = self._node.clock.now()
        strips = gate_strips(self.world.gates, self._referee.state) if self.world else []
        obstacles, touched = self._robot.obstacles(), self._touches.shown(now)
        content = (obstacles, strips, touched)
        # A world that stands is repeated for new subscribers only; markers are a tenth of what a recording takes.
        if content == self._published and now - self._published_s < _REPEAT_S:
            return
        self._published, self._published_s = content, now
        header = Header(stamp=self._node.clock.stamp(now), frame_id=self._frame_id)
        self._markers.publish(world_markers(header, obstacles, strips, touched, self._most_markers))
        # A subscriber keeps each marker until it is deleted.
        self._most_markers = max(self._most_markers, len(obstacles))
