"""The landmark models, unchanged and made for people's hands, find the virtual hand and read its signs."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from handsteer.config import LandmarksConfig
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import SIGNS, Handedness
from tests.plugins.virtual_hand.views import random_picture

pytestmark = pytest.mark.slow

VIEWS = 50
NEAR_M, FAR_M = (0.45, 0.90), (0.90, 1.30)
"""A hand of 240 to 120 pixels in a picture of 640x480, and of 120 to 83."""


@dataclass
class Outcome:
    views: int
    errors: list[float] = field(default_factory=list)
    handed: int = 0
    read: Counter[str] = field(default_factory=Counter)

    @property
    def found(self) -> float:
        return len(self.errors) / self.views


def look_at(sign: str, hand: Handedness, views: int, distances_m: tuple[float, float]) -> Outcome:
    """Show random views, each by itself; a hand that is found elsewhere counts as not found."""
    random = np.random.default_rng([SIGNS.index(sign), hand == "Left"])
    landmarker, classifier = MediaPipeLandmarker(LandmarksConfig()), ShippedClassifier(load_model())
    outcome = Outcome(views)
    for _ in range(views):
        picture = random_picture(sign, hand, random, distances_m)
        landmarker.reset()
        for found in landmarker.detect(picture.image):
            off = np.linalg.norm(found.pixels[:, :2] - picture.joints, axis=1) / picture.hand_px
            if np.median(off) < 0.25:
                outcome.errors.append(float(np.median(off)))
                outcome.handed += found.handedness == hand
                outcome.read[classifier.classify(found).sign] += 1
    return outcome


def report(sign: str, hand: Handedness, outcome: Outcome) -> None:
    print(  # noqa: T201 - shown with -rP; these are the figures that the documentation quotes
        f"{sign}, {hand} hand: {outcome.found:.0%} of {outcome.views} found, joints off by"
        f" {np.median(outcome.errors):.1%} of the hand's length, {outcome.handed} with the right handedness,"
        f" read as {dict(outcome.read)}"
    )


@pytest.mark.parametrize("hand", ["Right", pytest.param("Left", marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("sign", SIGNS)
def test_random_views_are_found_where_they_are(sign: str, hand: Handedness) -> None:
    outcome = look_at(sign, hand, VIEWS, NEAR_M)
    report(sign, hand, outcome)
    assert outcome.found >= 0.95
    assert np.median(outcome.errors) <= 0.08
    assert outcome.handed >= 0.9 * len(outcome.errors)
    assert outcome.read[sign] >= 0.8 * len(outcome.errors)


@pytest.mark.exhaustive
@pytest.mark.parametrize("hand", ["Right", "Left"])
@pytest.mark.parametrize("sign", SIGNS)
def test_most_views_are_found_from_further_away(sign: str, hand: Handedness) -> None:
    outcome = look_at(sign, hand, 20, FAR_M)
    report(sign, hand, outcome)
    assert outcome.found >= 0.75
    assert np.median(outcome.errors) <= 0.08
