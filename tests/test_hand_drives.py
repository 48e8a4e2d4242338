"""The hand as a joystick through real pictures and landmark models: how soon it moves, and how soon it stops."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from handsteer import Config, Teleop, Velocity
from handsteer.cameras.files import SensorNoise
from handsteer.config import ControlConfig
from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import HandPose, Pinhole, View, sign_pose
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render
from handsteer.types import GO, STOP, ZERO

WIDTH, HEIGHT, FPS = 640, 480, 30
WITHIN_S = 0.1
"""From the first frame that shows no held fist any more to a zero."""

Picture = NDArray[np.uint8]


class Person:
    """Shows a drawn hand to a teleop, frame by frame."""

    def __init__(self, config: ControlConfig | None = None) -> None:
        control = config or ControlConfig(mode="joystick", arming="off", engage="off")
        self.teleop = Teleop(Config(control=control))
        self._noise, self._frames = SensorNoise(), 0
        self._background = make_background("cluttered", WIDTH, HEIGHT, 0)

    def picture(
        self,
        pose: HandPose | None,
        forward_m: float = 0.0,
        left_m: float = 0.0,
        side: str = "Right",
        roll_deg: float = 0.0,
    ) -> Picture:
        if pose is None:
            return self._background.copy()
        x, y, z = pose.view.position
        view = View(
            pose.view.yaw, pose.view.pitch, pose.view.roll + math.radians(roll_deg), (x + left_m, y - forward_m, z)
        )
        placement = view.placement("Left" if side == "Left" else "Right")
        camera = Pinhole.webcam(WIDTH, HEIGHT)
        return render(pose_skeleton(pose.angles), placement, camera, Look(), self._background)

    def shows(self, picture: Picture, frames: int = 1) -> list[Velocity]:
        velocities = []
        for _ in range(frames):
            self._frames += 1
            velocities.append(self.teleop.step(self._noise.on(picture, self._frames / FPS), 1 / FPS))
        return velocities

    def drives(self) -> None:
        """Hold the joystick and move it forward."""
        fist = sign_pose(GO)
        self.shows(self.picture(sign_pose(STOP)), 15)
        self.shows(self.picture(fist), 10)
        for step in range(1, 7):
            self.shows(self.picture(fist, forward_m=0.01 * step))
        velocity = self.shows(self.picture(fist, forward_m=0.06), 5)[-1]
        assert velocity.linear_mps > 0.3
        assert velocity.angular_radps == 0.0


ENDS: dict[str, Callable[[Person], Picture]] = {
    "it opens": lambda person: person.picture(sign_pose(STOP), forward_m=0.06),
    "it is lost": lambda person: person.picture(None),
    "it points": lambda person: person.picture(sign_pose("Forward"), forward_m=0.06),
    "it is cut off by the edge": lambda person: person.picture(sign_pose(GO), forward_m=0.06, left_m=0.34),
    "the other hand is there": lambda person: person.picture(sign_pose(GO), forward_m=0.06, side="Left"),
    "another one is elsewhere": lambda person: person.picture(sign_pose(GO), forward_m=-0.05, left_m=0.18),
}


@pytest.mark.parametrize("end", ENDS)
def test_it_stops_within_a_tenth_of_a_second_and_must_be_closed_again(end: str) -> None:
    person = Person()
    person.drives()
    picture = ENDS[end](person)
    velocities = person.shows(picture, round(WITHIN_S * FPS) + 1)
    assert velocities[-1] == ZERO, f"after {end}"
    fist = person.picture(sign_pose(GO), forward_m=0.06)
    assert set(person.shows(fist, 15)) == {ZERO}
    person.drives()


def half_closed(share: float) -> HandPose:
    open_hand, fist = sign_pose(STOP), sign_pose(GO)
    return HandPose((1 - share) * open_hand.angles + share * fist.angles, open_hand.view)


def test_a_hand_that_opens_closes_and_opens_engages() -> None:
    person = Person(ControlConfig())
    between = [person.picture(half_closed(share)) for share in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)]
    person.shows(person.picture(half_closed(0.0)), 15)
    assert person.teleop.reason == "disengaged: open, close and open your hand to begin"
    for picture in between:
        person.shows(picture)
    person.shows(person.picture(half_closed(1.0)), 8)
    for picture in reversed(between):
        person.shows(picture)
    person.shows(person.picture(half_closed(0.0)), 10)
    assert person.shows(person.picture(sign_pose("Forward")), 15)[-1].linear_mps > 0.0


def test_pictures_of_a_palm_and_a_fist_in_turn_do_not_engage() -> None:
    person = Person(ControlConfig())
    palm, fist = (person.picture(half_closed(share)) for share in (0.0, 1.0))
    for frames in (8, 3, 15):
        for picture in (palm, fist, palm, fist, palm):
            person.shows(picture, frames)
    assert person.teleop.reason == "disengaged: open, close and open your hand to begin"
    assert set(person.shows(person.picture(sign_pose("Forward")), 15)) == {ZERO}


POINT = ControlConfig(rule="point", arming="off", engage="off")


@pytest.mark.parametrize("roll_deg", [-30, 0, 30])
def test_the_robot_drives_where_the_finger_points(roll_deg: float) -> None:
    person = Person(POINT)
    person.shows(person.picture(sign_pose(STOP)), 5)
    finger = person.picture(sign_pose("Forward"), forward_m=0.05, roll_deg=roll_deg)
    velocity = person.shows(finger, 40)[-1]
    assert velocity.linear_mps > 0.3
    # Clockwise in the picture, which is not mirrored, is to the person's left.
    assert math.copysign(1.0, velocity.angular_radps) == math.copysign(1.0, roll_deg) or roll_deg == 0
    assert (abs(velocity.angular_radps) > 0.25) == (roll_deg != 0)


def test_a_higher_hand_that_points_drives_faster() -> None:
    person = Person(POINT)
    person.shows(person.picture(sign_pose(STOP)), 5)
    speeds = [
        person.shows(person.picture(sign_pose("Forward"), forward_m=height_m), 30)[-1].linear_mps
        for height_m in (-0.06, 0.0, 0.06)
    ]
    assert speeds == sorted(speeds)
    assert speeds[2] > 1.5 * speeds[0]


@pytest.mark.parametrize("after", [STOP, None])
def test_a_palm_or_no_hand_ends_pointing(after: str | None) -> None:
    person = Person(POINT)
    person.shows(person.picture(sign_pose(STOP)), 5)
    person.shows(person.picture(sign_pose("Forward")), 40)
    picture = person.picture(sign_pose(after) if after else None, forward_m=0.0)
    assert person.shows(picture, 9)[-1] == ZERO


def test_the_fist_keeps_the_speed_of_pointing() -> None:
    person = Person(POINT)
    person.shows(person.picture(sign_pose(STOP)), 5)
    before = person.shows(person.picture(sign_pose("Forward")), 40)[-1]
    kept = person.shows(person.picture(sign_pose(GO)), 20)[-1]
    assert kept.linear_mps == pytest.approx(before.linear_mps, abs=0.1)
    assert kept.angular_radps == 0.0


def test_a_teleop_driven_by_signs_has_no_stick() -> None:
    person = Person(ControlConfig(arming="off", engage="off"))
    person.shows(person.picture(sign_pose("Forward")), 10)
    assert not person.teleop.stick.held
