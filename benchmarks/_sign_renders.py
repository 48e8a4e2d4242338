"""The virtual hand for ``benchmarks/signs.py``: each sign from the palm and from the back, by either hand.

These are drawings: what holds for them need not hold for people.
"""

import hashlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from _sign_photos import Eyes, Seen
from _sign_table import Row, row_of
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import ANGLES, pose_skeleton
from handsteer.plugins.virtual_hand.poses import HandPose, Pinhole, View, sign_pose
from handsteer.plugins.virtual_hand.renderer import SKINS, make_background, render
from handsteer.plugins.virtual_hand.renderer import Look as Appearance
from handsteer.types import BACKWARD, MOTION_SIGNS, SIGNS, TURN_LEFT, TURN_RIGHT, Handedness

RENDERED: Final = "rendered"
_DRAWN: Final = 24
_SAMPLED: Final = 3
_CAMERA: Final = Pinhole.webcam(640, 480)
_NEAR_M, _FAR_M = 0.45, 0.9
_HANDS: Final[tuple[Handedness, ...]] = ("Right", "Left")
_TURNS: Final = {("Right", TURN_LEFT), ("Left", TURN_RIGHT)}
"""The turns that show the palm; a raised hand shows the other one with its back, and none with both."""


@dataclass(frozen=True)
class Arm:
    """How the forearm comes to a hand that points down, in degrees: the joints of the wrist, and roll in the image.

    A person who points down at a camera either lets the arm hang, or has the elbow to the side or behind the hand.
    """

    name: str = ""
    flexion: float = 0.0
    deviation: float = 0.0
    roll: float = 0.0


_ARMS: Final = {
    "palm": (Arm("arm from above"),),
    "back": (
        Arm("arm from above"),
        Arm("arm from the side", flexion=20.0, deviation=-20.0, roll=-20.0),
        Arm("arm behind", flexion=60.0),
    ),
}


@dataclass(frozen=True)
class RenderedLook:
    """One random view of the virtual hand: up to 20 degrees aside, 15 in the image, in any skin, light and room."""

    row: Row
    in_sample: bool
    pose: HandPose
    hand: Handedness
    number: int

    def take(self, eyes: Eyes) -> Seen:
        """Draw it and recognise it."""
        recognition = eyes.recognizer.recognize(self.picture())
        right = recognition.seen == self.row.shown
        line = f"{self.row.name} {self.number}: seen as {recognition.seen} {recognition.confidence:.2f}"
        return Seen(right, not right and recognition.seen in MOTION_SIGNS, line)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture, (480, 640, 3), BGR."""
        seed = hashlib.sha256(f"{self.row.name} {self.number}".encode()).digest()
        random = np.random.default_rng(list(seed))
        view = _moved(self.pose.view, random)
        look = Appearance(
            skin=list(SKINS)[self.number % len(SKINS)],
            sleeve=self.number % 2 == 0,
            light=(float(random.uniform(-0.8, 0.8)), float(random.uniform(-1.0, -0.2)), -0.8),
            brightness=float(random.uniform(0.8, 1.1)),
        )
        room = make_background("plain" if self.number % 4 < 2 else "cluttered", 640, 480, int(random.integers(1000)))
        return render(pose_skeleton(self.pose.angles), view.placement(self.hand), _CAMERA, look, room)


def _moved(view: View, random: np.random.Generator) -> View:
    yaw, pitch, roll = np.radians(random.uniform((-20, -20, -15), (20, 20, 15)))
    z = float(np.exp(random.uniform(np.log(_NEAR_M), np.log(_FAR_M))))
    half = np.array([_CAMERA.width, _CAMERA.height]) / (2 * _CAMERA.focal_px) * z
    x, y = random.uniform(-1, 1, 2) * np.maximum(half - [0.13, 0.14], 0.0)
    return View(view.yaw + yaw, view.pitch + pitch, view.roll + roll, (float(x), float(y), z))


def rendered_looks() -> Iterator[RenderedLook]:
    """Yield all random views."""
    for sign, hand in itertools.product(SIGNS, _HANDS):
        for side, arm in _sides(sign, hand):
            kind = f"{side}, {hand.lower()} hand" + (f", {arm.name}" if arm.name else "")
            row = row_of(RENDERED, "virtual hand", sign, kind, RENDERED)
            pose = _pose(sign, hand, side, arm)
            yield from (RenderedLook(row, number < _SAMPLED, pose, hand, number) for number in range(_DRAWN))


def _sides(sign: str, hand: Handedness) -> Iterator[tuple[str, Arm]]:
    if sign in (TURN_LEFT, TURN_RIGHT):
        yield "palm" if (hand, sign) in _TURNS else "back", Arm()
        return
    for side, arms in _ARMS.items():
        yield from ((side, arm) for arm in (arms if sign == BACKWARD else (Arm(),)))


def _pose(sign: str, hand: Handedness, side: str, arm: Arm) -> HandPose:
    """Return the sign from that side; a turn as the virtual hand always shows it."""
    pose = sign_pose(sign, hand)
    angles = pose.angles.copy()
    angles[[ANGLES.index("wrist_flexion"), ANGLES.index("wrist_deviation")]] += np.radians([arm.flexion, arm.deviation])
    view = pose.view
    if sign not in (TURN_LEFT, TURN_RIGHT):
        view = replace(view, yaw=np.pi - view.yaw if side == "back" else view.yaw)
    return HandPose(angles, replace(view, roll=view.roll + np.radians(arm.roll)))
