"""The spine without nodes: an image in, a velocity out."""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from handsteer import Config, Recognizer, Teleop, Velocity
from handsteer.cameras.files import SensorNoise
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, ControlConfig, VirtualHandConfig
from handsteer.errors import ConfigError, FrameError, quoted
from handsteer.graph import Graph
from handsteer.images import bgr_image
from handsteer.messages import CMD_VEL, IMAGE_RAW, Twist
from handsteer.types import ZERO
from tests.faults.painted import PaintedCamera, painted_recognizer
from tests.recognition.hands import show_sign

DT_S = 1 / 30
GREY = np.full((48, 64, 3), 100, np.uint8)


class Person:
    """Shows painted signs to a camera, which a teleop looks at."""

    def __init__(self, config: Config | None = None) -> None:
        config = config or Config(control=ControlConfig(engage_by="hold"))
        self.clock = SteppedClock()
        self.camera = PaintedCamera(self.clock)
        self.teleop = Teleop(config, painted_recognizer(config.signs))

    def image(self, sign: str) -> NDArray[np.uint8]:
        self.camera.sign = sign
        return self.camera.read().image

    def shows(self, sign: str, duration_s: float) -> list[Velocity]:
        return [self.teleop.step(self.image(sign), DT_S) for _ in range(round(duration_s / DT_S))]

    def drives(self) -> None:
        """Show an open palm, then Forward, until it drives."""
        self.shows("Stop", 1.2)
        assert self.shows("Forward", 1.0)[-1].linear_mps > 0.1


@pytest.mark.parametrize("made", [Recognizer, Teleop])
@pytest.mark.parametrize("config", [3, {}, {"control": {"max_linear": 0.2}}, "my.yaml", ControlConfig(), 0, False])
def test_what_is_not_a_config_is_refused(made: type[Recognizer | Teleop], config: Any) -> None:
    with pytest.raises(
        ConfigError, match=rf"^{re.escape(quoted(config))} is not a valid Config: give a Config, such as"
    ):
        made(config)


def test_a_hand_that_is_up_at_the_start_moves_nothing_before_neutral_was_seen() -> None:
    person = Person()
    assert set(person.shows("Forward", 2.0)) == {ZERO}
    assert person.teleop.reason == "disengaged: hold an open palm for 1 s to begin"
    person.drives()
    assert person.teleop.reason == "driving: Forward"


def test_a_hand_in_the_part_of_an_image_that_stands_still_drives_nothing() -> None:
    person = Person()
    person.drives()
    left, top, right, bottom = show_sign("Forward").box_px
    # As large as the picture that the place of the painted hand belongs to.
    images = (np.repeat(np.repeat(person.image("Forward"), 10, axis=0), 10, axis=1) for _ in range(60))
    assert person.teleop.step(next(images), DT_S).linear_mps > 0.1
    still = next(images)[top:bottom, left:right]
    velocities = []
    for torn in images:
        torn[top:bottom, left:right] = still
        velocities.append(person.teleop.step(torn, DT_S))
    assert set(velocities[15:]) == {ZERO}
    assert "torn" in person.teleop.reason


def test_without_the_clutch_neutral_is_still_required() -> None:
    person = Person(Config(control=ControlConfig(engage="off")))
    assert set(person.shows("Forward", 2.0)) == {ZERO}
    assert "show Stop or lower your hand" in person.teleop.reason
    person.shows("Stop", 0.1)
    assert person.shows("Forward", 1.0)[-1].linear_mps > 0.1


def test_without_arming_and_engaging_the_first_sign_drives() -> None:
    person = Person(Config(control=ControlConfig(arming="off", engage="off")))
    assert person.shows("Forward", 1.0)[-1].linear_mps > 0.1


def test_a_sign_that_never_changes_has_to_be_shown_anew() -> None:
    person = Person(Config(control=ControlConfig(renew_time=3.0, engage_by="hold")))
    person.drives()
    assert person.shows("Forward", 1.5)[-1] != ZERO
    assert person.teleop.reason == "driving: Forward; stops in 1 s unless it changes"
    assert person.shows("Forward", 1.0)[-1] == ZERO
    assert person.teleop.reason.startswith("ready: the same sign for 3 s")
    assert set(person.shows("Forward", 3.0)) == {ZERO}
    person.shows("Stop", 0.1)
    assert person.shows("Forward", 1.0)[-1].linear_mps > 0.1


def test_where_nothing_has_to_be_shown_anew_a_sign_drives_on() -> None:
    person = Person(Config(control=ControlConfig(renew_time=3.0, renew="off", engage_by="hold")))
    person.drives()
    assert person.shows("Forward", 6.0)[-1] != ZERO


@pytest.mark.parametrize("image", [None, GREY], ids=["no image", "a frozen camera"])
def test_without_new_images_the_robot_stands_and_waits_for_neutral(image: NDArray[np.uint8] | None) -> None:
    person = Person()
    person.drives()
    unseen = [person.teleop.step(image, DT_S) for _ in range(30)]
    assert unseen[12] == unseen[-1] == ZERO
    assert not person.teleop.reason.startswith("driving")
    assert set(person.shows("Forward", 1.0)) == {ZERO}
    person.drives()


def test_one_long_pause_is_a_fault_though_an_image_comes_at_its_end() -> None:
    person = Person()
    person.drives()
    assert person.teleop.step(person.image("Forward"), 5.0) == ZERO
    assert set(person.shows("Forward", 1.0)) == {ZERO}


@pytest.mark.parametrize("dt_s", [-0.1, math.nan, math.inf, None, "0.03", 10**400, np.zeros(2)], ids=type)
def test_a_time_that_cannot_be_stops_the_robot(dt_s: Any) -> None:
    person = Person()
    person.drives()
    assert person.teleop.step(person.image("Forward"), dt_s) == ZERO
    assert set(person.shows("Forward", 1.0)) == {ZERO}


@pytest.mark.parametrize("sign", ["Forward", "Go", "Turn Left"])
@pytest.mark.parametrize("ramp", ["per_message", "per_second"])
@pytest.mark.parametrize("failed", [Velocity(math.nan, math.nan), Velocity(0.1, math.nan), Velocity(-math.inf, 0.0)])
def test_a_velocity_that_is_not_finite_holds_back_to_zero(failed: Velocity, ramp: str, sign: str) -> None:
    person = Person(Config.model_validate({"control": {"engage_by": "hold", "ramp": ramp}}))
    person.drives()
    if sign == "Turn Left":
        person.shows(sign, 1.0)
    person.teleop.hold_back(failed)
    velocity = person.teleop.step(person.image(sign), DT_S)
    assert 0.0 <= velocity.linear_mps < 0.1
    assert 0.0 <= velocity.angular_radps < 0.5


@pytest.mark.parametrize(
    "image", [GREY[:, :, 0], GREY / 255.0, GREY[:0], "photo.jpg", Path("photo.jpg"), [1, 2], object()], ids=type
)
def test_a_broken_image_raises_and_leaves_the_robot_standing(image: Any) -> None:
    teleop = Teleop(Config(control=ControlConfig(arming="off")))
    with pytest.raises(FrameError):
        teleop.step(image, DT_S)
    assert teleop.step(None, DT_S) == ZERO


def test_an_image_that_cannot_be_looked_at_stops_a_robot_that_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard: the fault in ``_sign_of``."""
    person = Person()
    person.drives()
    with monkeypatch.context() as broken:
        broken.setattr(Recognizer, "step", Mock(side_effect=FrameError("broken")))
        with pytest.raises(FrameError):
            person.teleop.step(person.image("Forward"), DT_S)
    assert person.teleop.step(None, DT_S) == ZERO
    assert set(person.shows("Forward", 1.0)) == {ZERO}


def test_stop_holds_until_it_is_reset_and_neutral_was_seen() -> None:
    person = Person()
    person.drives()
    person.teleop.stop()
    assert set(person.shows("Forward", 1.0)) == {ZERO}
    assert person.teleop.reason == "standing: stopped, until it is reset"
    person.teleop.reset()
    assert set(person.shows("Forward", 1.0)) == {ZERO}
    person.drives()


@given(st.lists(st.tuples(st.sampled_from(["Forward", "Turn Left", "Go", None]), st.floats(0.01, 1.0))))
def test_nothing_moves_before_neutral_whatever_comes(shown: list[tuple[str | None, float]]) -> None:
    """Neither signs that move nor missing images are neutral."""
    person = Person()
    for sign, dt_s in shown:
        image = None if sign is None else person.image(sign)
        assert person.teleop.step(image, dt_s) == ZERO


@pytest.mark.slow
def test_it_commands_what_the_nodes_command() -> None:
    """The same images through the graph of nodes, and through the spine."""
    config = Config(
        camera=CameraConfig(source="virtual", width=320, height=240),
        virtual_hand=VirtualHandConfig(script="Stop:0.7 Go:0.6 Stop:0.7 Forward:1.5 Turn Left:1 NONE:0.5 Stop:1"),
        control=ControlConfig(arming="on", engage="on"),
    )
    images: list[NDArray[np.uint8]] = []
    commands: list[Velocity] = []
    with Graph(config, SteppedClock()) as graph:
        graph.transport.subscribe("test", IMAGE_RAW, lambda image: images.append(bgr_image(image.message)))
        graph.transport.subscribe("test", CMD_VEL, lambda twist: commands.append(_velocity(twist.message)))
        graph.run_stepped(6.0)

    teleop = Teleop(config)
    assert commands[-1] == ZERO
    assert max(command.linear_mps for command in commands) > 0.3
    assert _changes(teleop.step(image, DT_S) for image in images) == _changes(commands)


def test_the_doors_are_few_and_open() -> None:
    picture = SensorNoise().on(np.full((240, 320, 3), 90, np.uint8), 0.0)
    assert Recognizer().recognize(picture).sign == "NONE"


def _velocity(twist: Twist) -> Velocity:
    return Velocity(twist.linear.x, twist.angular.z)


def _changes(velocities: Iterable[Velocity]) -> list[Velocity]:
    changes = [ZERO]
    for velocity in velocities:
        if velocity != changes[-1]:
            changes.append(velocity)
    return changes
