"""Random views of the virtual hand, as a webcam may see it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole, View, sign_pose
from handsteer.plugins.virtual_hand.renderer import SKINS, Look, make_background, render, true_pixels
from handsteer.types import Handedness

CAMERA = Pinhole.webcam(640, 480)
HAND_LENGTH_M = 0.19


@dataclass(frozen=True)
class Picture:
    """A picture, where the joints are in it (21, 2), and how long the hand would be if it were flat, in pixels."""

    image: NDArray[np.uint8]
    joints: NDArray[np.float64]
    hand_px: float


def random_view(view: View, random: np.random.Generator, distances_m: tuple[float, float]) -> View:
    """Turn a view by up to 20 degrees and 15 in the image, and move it to anywhere where the whole hand is seen."""
    yaw, pitch, roll = np.radians(random.uniform((-20, -20, -15), (20, 20, 15)))
    z = float(np.exp(random.uniform(*np.log(distances_m))))
    half = np.array([CAMERA.width, CAMERA.height]) / (2 * CAMERA.focal_px) * z
    x, y = random.uniform(-1, 1, 2) * np.maximum(half - [0.13, 0.14], 0)
    towards_middle = 0.04 * np.cos(view.roll)
    position = (float(x), float(y + towards_middle), z)
    return replace(view, yaw=view.yaw + yaw, pitch=view.pitch + pitch, roll=view.roll + roll, position=position)


def random_picture(
    sign: str, hand: Handedness, random: np.random.Generator, distances_m: tuple[float, float]
) -> Picture:
    """Draw a sign in a random view, skin, light and room."""
    pose = sign_pose(sign, hand)
    view = random_view(pose.view, random, distances_m)
    skeleton, placement = pose_skeleton(pose.angles), view.placement(hand)
    look = Look(
        skin=str(random.choice(list(SKINS))),
        sleeve=bool(random.integers(2)),
        light=(float(random.uniform(-0.8, 0.8)), float(random.uniform(-1.0, -0.2)), -0.8),
        brightness=float(random.uniform(0.8, 1.1)),
    )
    kind = str(random.choice(["plain", "cluttered"]))
    background = make_background(kind, CAMERA.width, CAMERA.height, int(random.integers(10_000)))
    image = render(skeleton, placement, CAMERA, look, background)
    hand_px = HAND_LENGTH_M / view.position[2] * CAMERA.focal_px
    return Picture(image, true_pixels(skeleton, placement, CAMERA), hand_px)
