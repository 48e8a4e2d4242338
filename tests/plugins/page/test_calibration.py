"""A calibration on the nodes of a graph, without a page: real hands of a made-up person, a real profile."""

import itertools
import math
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from handsteer.clock import RealClock, SteppedClock
from handsteer.config import Config, SignsConfig
from handsteer.errors import ProfileError
from handsteer.graph import Graph
from handsteer.images import image_message
from handsteer.messages import IMAGE_RAW, Header
from handsteer.plugins.page.calibration import COUNTDOWN_S, TAKE_S, CalibrationNode, Calibrations, CalibrationState
from handsteer.recognition.hand import Hand
from handsteer.recognition.profile import load_profile, profile_path
from handsteer.recognition.recognizer import open_classifier
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import FORWARD, SIGNS, STOP
from tests.recognition.hands import RecordedLandmarker
from tests.recognition.odd_person import odd_hands

PATIENCE_S = 300.0
IMAGE = np.full((48, 64, 3), 90, np.uint8)


class Room:
    """A graph whose camera sees the made-up person show what the calibration asks for; time passes per frame."""

    def __init__(self) -> None:
        self.clock = RealClock()
        self.transport = InProcessTransport()
        self.config = Config()
        self.hands = odd_hands(40, seed=0)
        self.hides = False
        self.calibrations = Calibrations(cast(Graph, self), lambda: self)
        self._frames = itertools.count()
        self._ended = threading.Event()
        self._camera = threading.Thread(target=self._publish)
        self._camera.start()

    def reconfigure(self, config: Config) -> None:
        open_classifier(config.signs)
        self.config = config

    def detect(self, image: np.ndarray, **_: object) -> list[Hand]:
        node = self.calibrations.node("ann")
        sign = node.state.sign if node is not None else ""
        return [] if self.hides or not sign else [self.hands[sign][next(self._frames) % 40]]

    def look_again(self, image: np.ndarray, hand: Hand) -> Hand:
        raise AssertionError("a calibration reads hands as they are found")

    def second_opinion(self, image: np.ndarray, hand: Hand, *, mirrored: bool = False) -> Hand:
        raise AssertionError("a calibration reads hands as they are found")

    def follow_only(self, hand: Hand) -> None:
        raise AssertionError("a calibration looks at all hands")

    def reset(self) -> None:
        raise AssertionError("a calibration is one stream")

    def _publish(self) -> None:
        images = self.transport.advertise("my_camera", IMAGE_RAW)
        for number in itertools.count():
            if self._ended.wait(0.005):
                return
            header = Header(self.clock.stamp(self.clock.now()), "camera")
            images.publish(image_message(IMAGE, header), number * 0.1)

    def wait_until(self, condition: Callable[[], bool], *, attends: bool = True) -> None:
        for _ in range(round(PATIENCE_S / 0.02)):
            node = self.calibrations.node("ann")
            if node is not None and attends:
                node.attend()
            if condition():
                return
            threading.Event().wait(0.02)
        pytest.fail("waited in vain")

    def close(self) -> None:
        self.calibrations.close()
        self._ended.set()
        self._camera.join()


@pytest.fixture
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Room]:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    room = Room()
    yield room
    room.close()


def begin(room: Room, *sides: str) -> CalibrationNode:
    room.calibrations.begin("ann", "Ann", sides or ("left", "right"))  # type: ignore[arg-type]
    node = room.calibrations.node("ann")
    assert node is not None
    return node


@pytest.mark.slow
def test_a_person_shows_all_signs_and_the_graph_uses_the_profile(room: Room) -> None:
    node = begin(room)
    steps = set()

    def is_made() -> bool:
        steps.add((node.state.sign, node.state.side))
        return node.state.result is not None

    room.wait_until(is_made)
    assert {step for step in steps if step[0]} == {(sign, side) for sign in SIGNS for side in ("left", "right")}
    room.calibrations.save("ann")
    assert room.config.signs.profile == Path("Ann")
    assert "Saved, and in use" in node.state.message
    assert STOP in load_profile(profile_path(Path("Ann"))).views
    assert room.calibrations.names == ["Ann"]
    room.calibrations.choose("")
    assert room.config == Config()


@pytest.mark.slow
def test_signs_that_are_skipped_or_not_seen_are_left_out(room: Room) -> None:
    node = begin(room, "right")
    while node.state.sign:
        if node.state.sign == FORWARD:
            room.wait_until(lambda: node.state.sign != FORWARD)
        node.skip()
    room.wait_until(lambda: node.state.result is not None)
    assert node.state.result is not None
    assert {each.sign for each in node.state.result.results} <= {FORWARD, SIGNS[2]}
    room.hides = True
    node = begin(room, "right")
    room.wait_until(lambda: bool(node.state.message))
    assert node.state.message.startswith("No sign was adapted: Stop: only 0 hands were seen")
    room.calibrations.save("ann")
    assert room.config.signs.profile is None


def test_nothing_is_recorded_while_the_page_is_away(room: Room) -> None:
    node = begin(room)
    room.wait_until(lambda: node.state.status.phase == "recording")
    room.wait_until(lambda: node.state.status.phase == "countdown", attends=False)
    assert node.state.result is None


class Booth:
    """One calibration that is run step by step, ten frames a second; each is looked at for ``looks_for_s``."""

    def __init__(self, looks_for_s: float = 0.0) -> None:
        self.clock = SteppedClock()
        transport = InProcessTransport()
        self.node = CalibrationNode(transport, self.clock, "Ann", ["right"], lambda: Looker(self, looks_for_s))
        self._images = transport.advertise("my_camera", IMAGE_RAW)

    def run(self, duration_s: float, *, pictures: bool = True) -> CalibrationState:
        for _ in range(round(duration_s * 10)):
            self.clock.advance(0.1)
            self.node.attend()
            if pictures:
                header = Header(self.clock.stamp(self.clock.now()), "camera")
                self._images.publish(image_message(IMAGE, header), self.clock.now())
            self.node.spin_once()
        return self.node.state


class Looker(RecordedLandmarker):
    """Always finds a hand, while time passes."""

    def __init__(self, booth: Booth, takes_s: float) -> None:
        super().__init__([[hand] for hand in odd_hands(40, seed=0)[SIGNS[0]]] * 10)
        self._booth, self._takes_s = booth, takes_s

    def detect(self, image: np.ndarray, *, search: bool = True, dt_s: float = math.inf) -> list[Hand]:
        self._booth.clock.advance(self._takes_s)
        self._booth.node.attend()
        return super().detect(image, search=search, dt_s=dt_s)


def test_a_take_begins_again_after_the_camera_was_lost() -> None:
    booth = Booth()
    state = booth.run(COUNTDOWN_S + 1.5)
    assert state.status.phase == "recording"
    assert state.status.hands > 10
    assert booth.run(0.8, pictures=False).status == state.status, "a short pause is none"
    state = booth.run(0.5, pictures=False)
    assert (state.words, state.status.phase) == ("No picture comes from the camera.", "countdown")
    booth.run(30.0, pictures=False)
    state = booth.run(0.1)
    assert (state.words, state.status.left_s) == ("in 2 s", COUNTDOWN_S)
    state = booth.run(COUNTDOWN_S + TAKE_S - 0.3)
    assert (state.step, state.status.phase) == (0, "recording")
    assert state.status.hands <= TAKE_S * 10 + 1, "none from before"
    assert booth.run(0.6).step == 1


def test_a_picture_that_is_looked_at_for_long_is_no_lost_camera() -> None:
    booth = Booth(looks_for_s=1.5)
    for _ in range(30):
        assert booth.run(0.1).has_picture
    assert booth.node.state.step > 0


def test_after_the_last_sign_a_lost_camera_changes_nothing() -> None:
    booth = Booth()
    for _ in SIGNS:
        booth.node.skip()
    assert booth.run(2.0, pictures=False).has_picture


def test_what_is_no_name_or_no_profile_is_refused(room: Room) -> None:
    for name, sides in (("../ann", ["left"]), ("ann", [])):
        with pytest.raises(ProfileError):
            room.calibrations.begin("ann", name, sides)  # type: ignore[arg-type]
    with pytest.raises(ProfileError, match="cannot read"):
        room.calibrations.choose("ann")
    with pytest.raises(ProfileError, match="not a valid name"):
        room.calibrations.choose("../../etc/ann")
    assert room.config.signs == SignsConfig()


def test_a_calibration_belongs_to_one_viewer(room: Room) -> None:
    node = begin(room)
    assert room.calibrations.node("bob") is None
    room.calibrations.end("bob")
    assert room.calibrations.node("ann") is node
    room.calibrations.end("ann")
    assert room.calibrations.node("ann") is None
