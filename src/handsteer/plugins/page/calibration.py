"""Calibration on the page: asks for each sign with each hand, makes the profile, and lets the running graph use it."""

import logging
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

from handsteer.clock import Clock
from handsteer.errors import ProfileError
from handsteer.graph import Graph
from handsteer.images import bgr_image, mirrored
from handsteer.messages import IMAGE_RAW, Image
from handsteer.nodes.base import Node
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.teach.calibration import Calibration, calibrate, save_calibrated
from handsteer.plugins.teach.collect import Collector, Facts, Status, largest
from handsteer.recognition.hand import Hand, Landmarker
from handsteer.recognition.profile import profile_name, profile_names, profile_path
from handsteer.recognition.recognizer import open_landmarker
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.transports.base import Received, Transport
from handsteer.types import SIGNS

log = logging.getLogger(__name__)

Side = Literal["left", "right"]
SIDES: Final[tuple[Side, ...]] = ("left", "right")

TAKE_S: Final = 3.0
COUNTDOWN_S: Final = 2.0
_MOST_TRIES: Final = 3
_LONGEST_STEP_S: Final = 0.5
_UNATTENDED_S: Final = 1.0
_NO_FRAME_S: Final = 1.0
_WATCH_PERIOD_S: Final = 0.2
_READY: Final = Status("countdown", COUNTDOWN_S, 0)


@dataclass(frozen=True)
class CalibrationState:
    """The progress of a calibration.

    Attributes:
        sign: The sign to show; empty once all were shown.
        side: The hand to show it with.
        step: Its number, from 0.
        steps: Number of signs times hands.
        status: Progress of recording.
        has_hand: Whether a hand is in view.
        has_picture: Whether pictures come from the camera.
        result: The profile and the result for each sign; None until it is made.
        message: What went wrong, or what has happened; empty if nothing.
    """

    sign: str
    side: Side
    step: int
    steps: int
    status: Status = _READY
    has_hand: bool = False
    has_picture: bool = True
    result: Calibration | None = None
    message: str = ""

    @property
    def is_computing(self) -> bool:
        """Whether all signs were shown, and the profile is being made."""
        return not self.sign and self.result is None and not self.message

    @property
    def words(self) -> str:
        """What is to be done now, with the countdown in seconds or the number of recorded hands."""
        if not self.has_picture:
            return "No picture comes from the camera."
        if not self.has_hand:
            return "No hand is in view."
        if self.status.phase == "recording":
            return f"hold it: {self.status.hands} hands"
        return f"in {math.ceil(self.status.left_s)} s"


class CalibrationNode(Node):
    """Collects the hands of one calibration, and makes the profile on a thread of its own; thread-safe.

    Args:
        name: Of the profile.
        sides: The hands that will drive.
        open_hands: Opens the landmarker; called on this node's thread.
        swap: Whether frames are mirrored before recognition.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        name: str,
        sides: Sequence[Side],
        open_hands: Callable[[], Landmarker],
        *,
        swap: bool = False,
    ) -> None:
        super().__init__("dashboard_calibration", transport, clock)
        self._name, self._open_hands, self._swap = name, open_hands, swap
        self._steps = [(sign, side) for sign in SIGNS for side in sides]
        self._shown: dict[str, list[Hand]] = {sign: [] for sign in SIGNS}
        self._lock = threading.RLock()
        self._landmarker: Landmarker | None = None
        self._last_s: float | None = None
        self._attended_s = self._looked_s = clock.now()
        self._tries = 0
        self.state = CalibrationState(*self._steps[0], step=0, steps=len(self._steps))
        self._collector = self._new_collector()
        self.subscribe(IMAGE_RAW, self._on_image)
        self.every(_WATCH_PERIOD_S, self._watch)

    def attend(self) -> None:
        """Report that the viewer's page is open; without this for a second, the current sign begins again."""
        self._attended_s = self.clock.now()

    def skip(self) -> None:
        """Leave out the current sign with the current hand."""
        with self._lock:
            if self.state.sign:
                self._next()

    def see(self, hand: Hand | None, dt_s: float) -> None:
        """Process the next frame, ``dt_s`` seconds after the last, with its largest hand."""
        with self._lock:
            if not self.state.sign:
                return
            status = self._collector.step(hand, dt_s)
            self._tries += status.failed
            self.state = replace(self.state, status=status, has_hand=hand is not None, has_picture=True)
            if status.finished is not None:
                self._shown[self.state.sign] += status.finished.hands
            if status.finished is not None or self._tries == _MOST_TRIES:
                self._next()

    def say(self, message: str) -> None:
        """Show what has happened."""
        with self._lock:
            self.state = replace(self.state, message=message)

    def _next(self) -> None:
        self._tries = 0
        step = self.state.step + 1
        if step < len(self._steps):
            sign, side = self._steps[step]
            self.state = replace(self.state, sign=sign, side=side, step=step, status=_READY)
            self._collector = self._new_collector()
        else:
            self.state = replace(self.state, sign="", step=step)
            threading.Thread(target=self._make, name="calibration", daemon=True).start()

    def _make(self) -> None:
        message, result = "", None
        try:
            result = calibrate(self._name, self._shown, ShippedClassifier(load_model()))
        except ProfileError as error:
            message = f"No sign was adapted: {error}."
        except Exception:
            log.exception("the calibration failed")
            message = "The calibration failed; the log says why."
        with self._lock:
            self.state = replace(self.state, result=result, message=message)

    def _new_collector(self) -> Collector:
        return Collector(Facts(self.state.sign, "", "", ""), takes=1, take_s=TAKE_S, countdown_s=COUNTDOWN_S)

    def _on_image(self, received: Received[Image]) -> None:
        now = self.clock.now()
        captured_s = received.captured_s if received.captured_s is not None else now
        step_s = 0.0 if self._last_s is None else min(max(0.0, captured_s - self._last_s), _LONGEST_STEP_S)
        self._last_s = captured_s
        if not self.state.sign:
            return
        if self._landmarker is None:
            self._landmarker = self._open_hands()
        image = bgr_image(received.message)
        self.see(largest(self._landmarker.detect(mirrored(image) if self._swap else image)), step_s)
        # After the detection, which can take long on a slow machine: the camera is not lost then.
        self._looked_s = self.clock.now()

    def _watch(self) -> None:
        now = self.clock.now()
        with self._lock:
            if not self.state.sign:
                return
            is_lost = now - self._looked_s > _NO_FRAME_S
            if is_lost:
                self._last_s = None  # the countdown begins with the next picture
                self.state = replace(self.state, has_hand=False, has_picture=False)
            # Another person may be in view when the page, or the picture, is back.
            if is_lost or now - self._attended_s > _UNATTENDED_S:
                self._collector = self._new_collector()
                self.state = replace(self.state, status=_READY)


class Calibrations:
    """Runs one calibration at a time on a running graph; thread-safe.

    Args:
        graph: Uses the profile.
        open_hands: Opens the landmarker; that of the graph's configuration by default.
    """

    def __init__(self, graph: Graph | RemoteGraph, open_hands: Callable[[], Landmarker] | None = None) -> None:
        self._graph = graph
        self._open_hands = open_hands or (lambda: open_landmarker(graph.config))
        self._lock = threading.RLock()
        self._current: tuple[str, CalibrationNode] | None = None
        self._closed = False

    @property
    def chosen(self) -> Path | None:
        """The profile in use."""
        return self._graph.config.signs.profile

    @property
    def names(self) -> list[str]:
        """The saved profiles."""
        return profile_names()

    def node(self, viewer: str) -> CalibrationNode | None:
        """Return the calibration of ``viewer``, if any."""
        current = self._current
        return current[1] if current is not None and current[0] == viewer else None

    def begin(self, viewer: str, name: str, sides: Sequence[Side]) -> None:
        """Begin a calibration; one abandoned by another viewer ends.

        Raises:
            ProfileError: The name is none, or there is no hand.
        """
        name = profile_name(name)
        if not sides:
            raise ProfileError("choose a hand that will drive")
        with self._lock:
            self._end()
            if self._closed:
                return
            graph, swap = self._graph, self._graph.config.signs.swap_sides
            node = CalibrationNode(graph.transport, graph.clock, name, sides, self._open_hands, swap=swap)
            self._current = viewer, node
            node.start()

    def save(self, viewer: str) -> None:
        """Write the profile of ``viewer``, which the graph uses from then on.

        Raises:
            ProfileError: It cannot be written.
            ConfigError: The running nodes reject it.
        """
        with self._lock:
            node = self.node(viewer)
            if node is None or node.state.result is None:
                return
            profile = node.state.result.profile
            kept = save_calibrated(profile, profile_path(Path(profile.name)))
            self.choose(profile.name)
            others = f" Kept from the profile that was there: {', '.join(kept)}." if kept else ""
            node.say(f"Saved, and in use.{others} End the calibration, then press Reset to drive.")

    def choose(self, name: str) -> None:
        """Let the graph use the saved profile ``name``; with an empty name, everybody's signs.

        Raises:
            ProfileError: It is not a valid name.
            ConfigError: There is no such profile, or it is damaged.
        """
        profile = Path(profile_name(name)) if name else None
        config = self._graph.config
        signs = config.signs.model_copy(update={"profile": profile})
        self._graph.reconfigure(config.model_copy(update={"signs": signs}))

    def end(self, viewer: str) -> None:
        """End the calibration of ``viewer``, if any."""
        with self._lock:
            if self.node(viewer) is not None:
                self._end()

    def close(self) -> None:
        """End any calibration permanently."""
        with self._lock:
            self._closed = True
            self._end()

    def _end(self) -> None:
        current, self._current = self._current, None
        if current is not None:
            # Off this thread, which may be the server's: a frame may be in progress.
            threading.Thread(target=current[1].stop, name="calibration_end", daemon=True).start()
