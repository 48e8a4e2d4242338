"""The graph in which a hand sign drives a robot.

::

    my_camera ──/image_raw──▶ hand_sign_recognition ──/gesture/hand_sign──▶ hand_sign_control ──cmd_vel──▶ robot
                                                                 steering ──/steering/cmd_vel──▲

Each box is a node (:mod:`handsteer.nodes`), each arrow a topic (:mod:`handsteer.messages`). The topics that join nodes
are arguments; beyond them, every node keeps the state of ``/stop``, and publishes what only people, pages and other
programs subscribe to. The work is done in
packages that do not depend on nodes: :mod:`handsteer.cameras` deliver frames, :mod:`handsteer.recognition` recognises
the hand's sign, :mod:`handsteer.control` converts it to a velocity, and :mod:`handsteer.robots` follow it. A transport
(:mod:`handsteer.transports`) carries the messages.
"""

import logging
import math
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from handsteer.audit import setting_changes
from handsteer.cameras import Camera
from handsteer.cameras.choice import Size
from handsteer.clock import Clock, RealClock, SteppedClock
from handsteer.config import Config
from handsteer.errors import ConfigError
from handsteer.making import (
    cmd_vel_topic,
    make_camera,
    make_control,
    make_recognition,
    make_robot,
    make_steering,
    open_cameras,
)
from handsteer.messages import (
    CAMERA_CHANGED,
    GESTURE_JOY,
    HAND_SIGN,
    IMAGE_ANNOTATED,
    IMAGE_COMPRESSED,
    IMAGE_DRAWN,
    IMAGE_LANDMARKS,
    IMAGE_RAW,
    ODOM,
    RECORDED,
    SCAN,
    STEERING_CMD_VEL,
    String,
    Topic,
)
from handsteer.nodes.auditing import Auditor
from handsteer.nodes.base import Node
from handsteer.nodes.journal import Journal
from handsteer.nodes.run_recording import RunRecording
from handsteer.nodes.steering import SteeringNode
from handsteer.recognition.recognizer import Recognizer, model_files
from handsteer.robots import Robot
from handsteer.summary import Summary
from handsteer.transports.base import Session, Transport
from handsteer.transports.in_process import InProcessTransport

log = logging.getLogger(__name__)

_NAME = "handsteer"
_LOOK_PERIOD_S = 0.2


class Graph:
    """The five nodes, joined by one transport and one clock.

    Use it as a context manager: however the block ends, the robot is stopped.

    Args:
        config: All parameters; :meth:`reconfigure` changes them.
        clock: Real time by default; a :class:`~handsteer.clock.SteppedClock` for :meth:`run_stepped`.
        transport: Within this process by default.
        link: This process in the graph of a robot behind a topic, for such a ``robot.kind``; the caller closes it
            after this graph.
        camera: Delivers the frames; by default the one that ``config`` names.
        recognizer: Recognises the signs; by default one as ``config`` has it.
        robot: Is driven; by default the one that ``config`` names. It counts as a real one, which the hand has to
            engage and that needs neutral before it moves, unless ``control.arming`` and ``engage`` are off.
        steering: Whether to include the node ``steering``; the page of another process has its own.

    Attributes:
        recording: The recording that is being made, or the last one.

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
        camera: Camera | None = None,
        recognizer: Recognizer | None = None,
        robot: Robot | None = None,
        steering: bool = True,
    ) -> None:
        self.config = config
        self.clock = clock or RealClock()
        self.transport = transport or InProcessTransport()
        wires = (self.transport, self.clock)
        cmd_vel = cmd_vel_topic(config)
        journals = tuple(Journal(*wires) for _ in range(2))
        noted = tuple((journal.transport, journal.clock) for journal in journals)
        simulated = robot is None and config.robot.kind == "sim"
        with ExitStack() as opened:
            self.robot = make_robot(config, *wires, link, robot, cmd_vel=cmd_vel, odom=ODOM, scan=SCAN)
            opened.callback(self.robot.on_stop)
            self.recognition = make_recognition(
                config,
                *noted[0],
                recognizer,
                image=IMAGE_RAW,
                compressed=IMAGE_COMPRESSED,
                sign=HAND_SIGN,
                joy=GESTURE_JOY,
                camera_changed=CAMERA_CHANGED,
            )
            self.cameras = open_cameras(config, self.clock, camera, may_be_real=not simulated)
            opened.callback(self.cameras.close)
            self.cameras.on_change = self._tell_of_camera
            self._camera_changed = self.transport.advertise("my_camera", CAMERA_CHANGED)
            self.camera = make_camera(config, *wires, self.cameras, image=IMAGE_RAW, compressed=IMAGE_COMPRESSED)
            self.control = make_control(
                config,
                *noted[1],
                simulated=simulated,
                sign=HAND_SIGN,
                joy=GESTURE_JOY,
                camera_changed=CAMERA_CHANGED,
                steering=STEERING_CMD_VEL,
                cmd_vel=cmd_vel,
                odom=ODOM,
                scan=SCAN,
            )
            opened.pop_all()  # from here on, stop() closes them
        self._steering = make_steering(config, *wires, steering=STEERING_CMD_VEL, cmd_vel=cmd_vel) if steering else None
        self._added: tuple[Node, ...] = ()
        self.recognition.journal, self.control.journal = journals
        self._auditor = Auditor(self.transport, _NAME, self.clock)
        self._cmd_vel = cmd_vel
        recorded = (CAMERA_CHANGED, IMAGE_COMPRESSED, cmd_vel, *((SCAN,) if config.uses_scans else ()))
        self.recording = RunRecording(*wires, self._auditor, (self.recognition, self.control), recorded)
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

    @property
    def topics(self) -> tuple[Topic[Any], ...]:
        """All topics that programs next to the graph may look at, including those on demand."""
        on_demand = (IMAGE_RAW, IMAGE_ANNOTATED, IMAGE_LANDMARKS, IMAGE_DRAWN, SCAN)
        return (*RECORDED, IMAGE_COMPRESSED, self._cmd_vel, *on_demand)

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
            duration_s: Maximum time to wait; unlimited by default. One that is not a number waits for nothing.
            until: Called five times a second; true ends the wait.

        Raises:
            TransportError: The graph of a real robot is gone.
        """
        end_s = self.clock.now() + (math.inf if duration_s is None else duration_s)
        while not self.camera.ended.wait(max(0.0, min(_LOOK_PERIOD_S, end_s - self.clock.now()))):
            if not self.clock.now() < end_s or (self._link is not None and self._link.wait(0.0)) or until():
                return

    def stop(self) -> None:
        """Stop all nodes and the robot; may be called twice."""
        for node in self.nodes:
            node.stop()
        self.end_recording()
        self.transport.close()

    def reconfigure(self, config: Config, by: str = _NAME) -> None:
        """Apply the parameters of ``config`` that can change while nodes run (``live`` of each section).

        Returns at once; may be called from any thread.

        Args:
            config: All parameters.
            by: Who changes them, for the audit.

        Raises:
            ConfigError: A node cannot apply it, for example because a file that it names is broken; nothing has
                changed.
        """
        for node in self.nodes:
            node.check(config)
        before, self.config = self.config, config
        for event in setting_changes(before, config, by):
            self._auditor.say(event, self.clock.now())
        for node in self.nodes:
            node.reconfigure(config)
        if config.signs.swap_sides != before.signs.swap_sides:
            self._tell_of_camera()

    def choose_camera(self, source: str, size: Size | None = None, is_far: bool = False) -> Future[None]:
        """Select a camera; the robot stops, and needs neutral before it moves again. May be called from any thread.

        Args, result and errors are those of :meth:`~handsteer.cameras.choice.ChoiceOfCameras.choose`.
        """
        done = self.cameras.choose(source, size, is_far)
        self.camera.reconfigure(self.config)
        return done

    def run_stepped(self, duration_s: float = math.inf) -> None:
        """Run all nodes in turn on this thread, as fast as possible, on the graph's stepped clock.

        No frame is skipped and nothing depends on the speed of the machine: the same input gives the same commands.

        Args:
            duration_s: How much of the graph's time to run, in seconds; a file that ends may end the run before.

        Raises:
            ConfigError: The graph's clock is real, its camera waits for a device, or ``duration_s`` is not valid.
        """
        if not duration_s >= 0:
            raise ConfigError(f"{duration_s} is not a valid duration of a run, in seconds")
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

    def record(self, path: Path | str, by: str = _NAME) -> None:
        """Record all topics to ``path`` from now on, an MCAP file that must not exist yet.

        Recorded before the start, a run can be replayed bit for bit. Recognition then uses the recorded, compressed
        pictures. May be called from any thread.

        Args:
            path: The file.
            by: Who starts it, for the audit.

        Raises:
            RecordingError: The file cannot be created, or another recording is being made.
        """
        self.recording.start(Path(path), self.config, model_files(self.config), by, self.recognition.look_at_compressed)

    def end_recording(self, by: str = _NAME) -> None:
        """End the recording, if there is one; ``by`` is who ends it, for the audit. May be called from any thread."""
        self.recording.end(by)

    def _tell_of_camera(self) -> None:
        self.recognition.is_camera_far = self.cameras.is_far
        self._camera_changed.publish(String(data=self.cameras.name), self.clock.now())

    def summary(self) -> Summary:
        """Return the statistics of the run so far."""
        return Summary.of(self, self.clock.now() - self._began_s)
