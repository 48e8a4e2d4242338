"""The graph in which a hand sign drives a robot.

::

    my_camera ──/image_raw──▶ hand_sign_recognition ──/gesture/hand_sign──▶ hand_sign_control ──cmd_vel──▶ robot
                                                                 steering ──/steering/cmd_vel──▲

Each box is a node (:mod:`handsteer.nodes`), each arrow a topic (:mod:`handsteer.messages`). The work is done in
packages that do not depend on nodes: :mod:`handsteer.cameras` deliver frames, :mod:`handsteer.recognition` recognises
the hand's sign, :mod:`handsteer.control` converts it to a velocity, and :mod:`handsteer.robots` follow it. A transport
(:mod:`handsteer.transports`) carries the messages.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from handsteer.clock import Clock, RealClock, SteppedClock
from handsteer.config import Config
from handsteer.errors import ConfigError
from handsteer.making import make_camera, make_control, make_recognition, make_robot, make_steering, open_cameras
from handsteer.nodes.node import Node
from handsteer.nodes.steering import SteeringNode
from handsteer.robots.course import CourseState
from handsteer.transports.base import Session, Transport
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import Pose2D

log = logging.getLogger(__name__)

_LOOK_PERIOD_S = 0.2


class Graph:
    """The five nodes, joined by one transport and one clock.

    Use it as a context manager: however the block ends, the robot is stopped.

    Args:
        config: All parameters; :meth:`reconfigure` changes them.
        clock: Real time by default; a :class:`~handsteer.clock.SteppedClock` for :meth:`run_stepped`.
        transport: Within this process by default.
        link: This process in the graph of a real robot, for ``robot.kind`` other than ``sim``; the caller closes it
            after this graph.
        steering: Whether to include the node ``steering``; the page of another process has its own.

    Raises:
        HandsteerError: A part cannot be used (camera, model, world); the message suggests what to do.
    """

    def __init__(
        self,
        config: Config,
        clock: Clock | None = None,
        transport: Transport | None = None,
        link: Session | None = None,
        *,
        steering: bool = True,
    ) -> None:
        self.config = config
        self.clock = clock or RealClock()
        self.transport = transport or InProcessTransport()
        wires = (self.transport, self.clock)
        self.robot = make_robot(config, *wires, link)
        self.recognition = make_recognition(config, *wires)
        self.cameras = open_cameras(config, self.clock)
        self.camera = make_camera(config, *wires, self.cameras)
        self.control = make_control(config, *wires, simulated=config.robot.kind == "sim")
        self._steering = make_steering(config, *wires) if steering else None
        self._added: tuple[Node, ...] = ()
        self._link = link
        self._began_s = self.clock.now()

    @property
    def steering(self) -> SteeringNode:
        """The node ``steering``.

        Raises:
            ConfigError: The graph was constructed without it.
        """
        if self._steering is None:
            raise ConfigError("this graph was constructed without the node steering")
        return self._steering

    @property
    def nodes(self) -> tuple[Node, ...]:
        """The nodes in the order in which they are stopped: the control sends its zero first, the robot ends last."""
        steering = () if self._steering is None else (self._steering,)
        return (self.control, *steering, self.camera, self.recognition, *self._added, self.robot)

    def add(self, node: Node) -> None:
        """Run and stop ``node``, on this graph's transport and clock, with the others."""
        self._added = (*self._added, node)

    def __enter__(self) -> "Graph":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Run each node on a thread of its own."""
        self._began_s = self.clock.now()
        for node in reversed(self.nodes):
            node.start()

    def wait(self, duration_s: float | None = None, until: Callable[[], bool] = lambda: False) -> None:
        """Wait until ``duration_s`` seconds have passed, or the camera's file or a real robot's graph ends the run.

        Args:
            duration_s: Maximum time to wait; unlimited by default.
            until: Called five times a second; true ends the wait.

        Raises:
            TransportError: The graph of a real robot is gone.
        """
        end_s = self.clock.now() + (math.inf if duration_s is None else duration_s)
        while not self.camera.ended.wait(max(0.0, min(_LOOK_PERIOD_S, end_s - self.clock.now()))):
            if self.clock.now() >= end_s or (self._link is not None and self._link.wait(0.0)) or until():
                return

    def stop(self) -> None:
        """Stop all nodes and the robot; may be called twice."""
        for node in self.nodes:
            node.stop()
        self.transport.close()

    def reconfigure(self, config: Config) -> None:
        """Apply the parameters of ``config`` that can change while nodes run (``live`` of each section).

        Returns at once; may be called from any thread.

        Raises:
            ConfigError: A node cannot apply it, for example because a file that it names is broken; nothing has
                changed.
        """
        for node in self.nodes:
            node.check(config)
        self.config = config
        for node in self.nodes:
            node.reconfigure(config)

    def run_stepped(self, duration_s: float = math.inf) -> None:
        """Run all nodes in turn on this thread, as fast as possible, on the graph's stepped clock.

        No frame is skipped and nothing depends on the speed of the machine: the same input gives the same commands.

        Args:
            duration_s: How much of the graph's time to run, in seconds; a file that ends may end the run before.

        Raises:
            ConfigError: The graph's clock is real, or its camera waits for a device.
        """
        clock = self.clock
        if not isinstance(clock, SteppedClock) or not self.camera.is_paced:
            raise ConfigError("a stepped run needs a video file, a folder of photos or the virtual hand as its camera")
        end_s = clock.now() + duration_s
        while not self.camera.ended.is_set():
            due_s = min(node.next_due_s for node in self.nodes if node.next_due_s is not None)
            if due_s > end_s:
                clock.advance_to(end_s)
                return
            clock.advance_to(due_s)
            while any([node.spin_once() for node in reversed(self.nodes)]):
                pass

    def summary(self) -> "Summary":
        """Return the statistics of the run so far."""
        duration_s = self.clock.now() - self._began_s
        measured = isinstance(self.clock, RealClock) and len(self.control.latency) > 0
        return Summary(
            duration_s=duration_s,
            frames=self.camera.frames,
            fps=self.camera.frames / duration_s if duration_s else 0.0,
            latency_median_ms=self.control.latency.percentile_ms(50) if measured else None,
            latency_p99_ms=self.control.latency.percentile_ms(99) if measured else None,
            signs=dict(self.recognition.counts),
            final_pose=self.robot.state.truth if self.robot.was_located else None,
            odometry=self.robot.state.odometry if self.robot.was_located else None,
            path_length_m=self.robot.path_length_m,
            contacts=self.robot.state.collisions,
            course=self.robot.course,
            trouble=self.robot.state.trouble,
            callback_errors=sum(node.callback_errors for node in self.nodes),
        )


@dataclass(frozen=True)
class Summary:
    """Statistics of a run.

    Attributes:
        duration_s: Length of the run.
        frames: Frames from the camera.
        fps: Frames per second.
        latency_median_ms: From the capture of a frame to the resulting Twist; None if the clock was stepped.
        latency_p99_ms: The 99th percentile of the same.
        signs: Number of frames per confirmed sign, including ``NONE``.
        final_pose: The robot's actual pose in the world; a real one's odometry. None if unknown.
        odometry: The robot's pose from odometry; None if unknown.
        path_length_m: Distance driven.
        contacts: How often it has begun to touch an obstacle; None for a real one.
        course: Gates, bumps and time on its world's course, with the score in seconds; None if there is no course.
        trouble: What was wrong with the robot at the end, such as ``is not there: …``; empty if nothing.
        callback_errors: Number of failed callbacks.
    """

    duration_s: float
    frames: int
    fps: float
    latency_median_ms: float | None
    latency_p99_ms: float | None
    signs: dict[str, int]
    final_pose: Pose2D | None
    odometry: Pose2D | None
    path_length_m: float
    contacts: int | None
    course: CourseState | None
    trouble: str
    callback_errors: int

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        return {**asdict(self), "course": self.course and self.course.as_dict()}
