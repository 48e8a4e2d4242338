"""Takes of a virtual hand, as a landmark model would see it if it made small errors."""

import numpy as np

from handsteer.plugins.teach.dataset import Take
from handsteer.plugins.virtual_hand.poses import HandPose, View, sign_pose
from handsteer.recognition.hand import Hand
from tests.recognition.hands import hand_of, show_pose


def take(
    label: str,
    pose: str | None = None,
    *,
    hands: int = 90,
    person: str = "me",
    session: str = "today",
    seed: int = 0,
    tilt: float = 0.0,
) -> Take:
    """Return a take of ``hands`` hands that are posed as the virtual hand shows ``pose``, by default as ``label``."""
    random = np.random.default_rng(seed)
    shown = [shaken(pose or label, random, tilt=tilt) for _ in range(hands)]
    return Take(label, person, session, "virtual", tuple(shown), tuple(number / 30 for number in range(hands)))


def takes(label: str, pose: str | None = None, *, count: int = 5, person: str = "me", seed: int = 0) -> list[Take]:
    """Return ``count`` takes of three seconds each."""
    return [take(label, pose, person=person, seed=seed + number) for number in range(count)]


def shaken(pose: str, random: np.random.Generator, *, tilt: float = 0.0) -> Hand:
    """Return a hand in that pose, a little other than it is meant to be, with landmarks that err a little."""
    meant = sign_pose(pose)
    view = View(
        yaw=meant.view.yaw + random.normal(0, 0.1),
        pitch=meant.view.pitch + random.normal(0, 0.1),
        roll=meant.view.roll + random.normal(0, 0.1) + tilt,
    )
    hand = show_pose(HandPose(meant.angles + random.normal(0, 0.05, meant.angles.shape), view))
    pixels = hand.pixels[:, :2] + random.normal(0, 1.0, (21, 2))
    return hand_of(pixels, hand.world + random.normal(0, 0.002, (21, 3)))


def other_hand(hand: Hand) -> Hand:
    """Return the other hand in the same pose, mirrored."""
    pixels = hand.pixels[:, :2] * (-1, 1) + (hand.image_size[0], 0)
    return hand_of(pixels, hand.world * (-1, 1, 1), "Left")
