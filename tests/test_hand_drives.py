"""The hand as a joystick through real pictures and landmark models: how soon it moves, and how soon it stops."""

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
        self, pose: HandPose | None, forward_m: float = 0.0, left_m: float = 0.0, side: str = "Right"
    ) -> Picture:
        if pose is None:
            return self._background.copy()
        x, y, z = pose.view.position
        view = View(pose.view.yaw, pose.view.pitch, pose.view.roll, (x + left_m, y - forward_m, z))
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
