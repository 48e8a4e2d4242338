"""A simulated operator of a running graph: a rendered hand that points, in front of a camera."""

import queue
import threading
import time

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import Frame
from handsteer.clock import RealClock
from handsteer.graph import Graph
from handsteer.plugins.bench.courses import open_course
from handsteer.plugins.bench.hand_interfaces import Point
from handsteer.plugins.bench.hand_view import HandCamera, HandView, LandmarkErrors
from handsteer.plugins.bench.hands import Slips
from handsteer.plugins.bench.interfaces import TICK_S
from handsteer.plugins.bench.laps import KINDS
from handsteer.plugins.bench.operator import DECISION_S, REACTION_S, Operator, Seen
from handsteer.plugins.virtual_hand.poses import Pinhole
from handsteer.types import Velocity

COURSE = "slalom"
FRAMES_PER_S = 20.0
SEED = 4


class HandsCamera:
    """A camera that delivers the operator's pictures."""

    name = "webcam"
    period_s = None

    def __init__(self) -> None:
        self._clock = RealClock()
        self._pictures: queue.Queue[NDArray[np.uint8]] = queue.Queue(1)

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Deliver ``picture`` next, unless one waits already."""
        if self._pictures.empty():
            self._pictures.put(picture)

    def read(self) -> Frame | None:
        """Return the next picture; None if none comes within a moment."""
        try:
            return Frame(self._pictures.get(timeout=0.1), self._clock.now())
        except queue.Empty:
            return None

    def close(self) -> None:
        """Do nothing."""


class SlalomLap:
    """Drives ``graph`` through the slalom, from :meth:`start` to :meth:`stop`.

    Args:
        graph: Its world is the slalom, and its control's rule ``point``.
        camera: Its camera.
    """

    def __init__(self, graph: Graph, camera: HandsCamera) -> None:
        config, skill = graph.config, KINDS["point"].skill
        self._graph, self._shown = graph, camera
        view = HandView(config, "landmarks", LandmarkErrors(), SEED)
        self._interface = Point(config, skill, view, Slips(0.0, 0.0), np.random.default_rng(SEED))
        self._operator = Operator(open_course(COURSE), skill, REACTION_S, np.random.default_rng(SEED))
        self._camera = HandCamera(Pinhole.webcam(config.camera.width, config.camera.height), SEED)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._drive, name="operator", daemon=True)

    def start(self) -> None:
        """Begin to send pictures of the hand, in real time."""
        self._thread.start()

    def stop(self) -> None:
        """Take the hand away."""
        self._ended.set()
        self._thread.join()

    def _drive(self) -> None:
        began_s = time.monotonic()
        ticks = decided = sent = 0
        while not self._ended.wait(TICK_S / 2):
            now_s = time.monotonic() - began_s
            while (ticks + 1) * TICK_S <= now_s:
                ticks += 1
                if ticks * TICK_S >= decided * DECISION_S:
                    decided += 1
                    self._decide()
                self._interface.step()
            if now_s * FRAMES_PER_S >= sent:
                sent = int(now_s * FRAMES_PER_S) + 1
                self._send(now_s)

    def _decide(self) -> None:
        state = self._graph.robot.state
        speed = Velocity(state.linear_mps, state.angular_radps)
        self._interface.want(self._operator.decide(Seen(state.truth, speed, bool(state.contacts))))

    def _send(self, now_s: float) -> None:
        self._shown.show(self._camera.picture(self._interface.hand.pose(), now_s))
