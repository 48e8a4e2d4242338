"""A made-up person: the virtual hand with a little finger and a thumb that do not stretch."""

from collections.abc import Iterable

import numpy as np

from handsteer.plugins.virtual_hand.kinematics import ANGLES, clamp
from handsteer.plugins.virtual_hand.poses import HandPose, View, sign_pose
from handsteer.recognition.hand import Classifier, Hand
from handsteer.recognition.shipped_signs import SURE
from handsteer.types import SIGNS, STOP, TURN_LEFT, TURN_RIGHT
from tests.recognition.hands import hand_of, show_pose

_BENT_THUMB = {"thumb_ip": 60.0, "thumb_mcp": 25.0}
_BENT = {STOP: {"little_pip": 70.0, "little_mcp": 30.0}, TURN_LEFT: _BENT_THUMB, TURN_RIGHT: _BENT_THUMB}


def odd_hand(sign: str, random: np.random.Generator) -> Hand:
    """Return a hand of this person that shows ``sign``, each time a little differently."""
    meant = sign_pose(sign)
    angles = meant.angles.copy()
    for joint, degrees in _BENT.get(sign, {}).items():
        angles[ANGLES.index(joint)] += np.radians(degrees)
    yaw, pitch, roll = random.normal(0, (0.12, 0.12, 0.1))
    view = View(yaw=meant.view.yaw + yaw, pitch=meant.view.pitch + pitch, roll=meant.view.roll + roll)
    hand = show_pose(HandPose(clamp(angles + random.normal(0, 0.06, angles.shape)), view))
    return hand_of(hand.pixels[:, :2] + random.normal(0, 1, (21, 2)), hand.world + random.normal(0, 0.002, (21, 3)))


def odd_hands(count: int, seed: int) -> dict[str, list[Hand]]:
    """Return ``count`` hands of this person for each sign."""
    random = np.random.default_rng(seed)
    return {sign: [odd_hand(sign, random) for _ in range(count)] for sign in SIGNS}


def errors(classifier: Classifier, hands: Iterable[Hand], sign: str) -> int:
    """Return how many of ``hands`` are not read as ``sign``."""
    guesses = [classifier.classify(hand) for hand in hands]
    return sum(guess.sign != sign or guess.confidence < SURE for guess in guesses)
