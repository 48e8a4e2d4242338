"""Where to look for hands that are not followed yet.

In the plain frame palms are looked for as MediaPipe does. The palm model misses hands that nearly fill a frame, fists
above all, so they are also looked for in a widened frame, where they look smaller; and while there is none, in the
middle of the frame without any palm, for the landmark model to say whether that is a hand.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.palm import Palm, PalmDetector
from handsteer.landmarks.roi import Roi

_MIDDLE: Final = 0.7
"""Side of the square in the middle, as a share of the frame's shorter side."""
_NEAR: Final = 0.4
"""Side of a near hand's region, as a share of the frame's longer side; a hand takes about half of its region."""
_NEAR_PRESENCE: Final = 0.9
"""How sure the landmark model has to be where the palm model saw nothing in the plain frame, at least."""
_TURNED_PRESENCE: Final = 0.95
"""Likewise for a hand that does not point upwards: faces and people look like one then, now and then."""
_SURE_PALM: Final = 0.8


@dataclass(frozen=True)
class Places:
    """Where hands may be in a frame.

    Attributes:
        regions: The surest first.
        min_presence: 0 to 1, how sure the landmark model has to be for it to be a hand, at least.
        rivals: Other ways to see the one region: of those in which a hand is seen, the surest counts.
    """

    regions: list[Roi]
    min_presence: float = 0.0
    rivals: tuple[Roi, ...] = ()


@dataclass(frozen=True)
class Palms:
    """Look for palms in a frame that is ``widened`` so many times, or only for those of ``near`` hands.

    With several factors it is looked in one frame after another, until there are enough palms that are sure.
    """

    widened: tuple[float, ...] = (1.0,)
    near: bool = False

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Places:
        """Return where there are palms, at most ``limit`` in each of the widened frames."""
        found: list[Palm] = []
        for widened in self.widened:
            if sum(palm.score >= _SURE_PALM for palm in found) < limit:
                found += palms.detect(image, limit, widened=widened)
        regions = [palm.roi for palm in sorted(found, key=lambda palm: -palm.score)]
        if not self.near:
            return Places(regions)
        return Places([roi for roi in regions if roi.side >= _NEAR * max(image.shape[:2])], _NEAR_PRESENCE)


@dataclass(frozen=True)
class Middle:
    """Look at the middle of the frame, as if the fingers pointed ``turned_deg`` clockwise from up."""

    turned_deg: float = 0.0

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Places:
        """Return the one place, and how it is seen with the fingers pointing elsewhere.

        A thumb up looks like an index finger to a model that expects the fingers there.
        """
        height, width = image.shape[:2]
        region, *rivals = (
            Roi(width / 2, height / 2, _MIDDLE * min(width, height), radians(self.turned_deg + turned))
            for turned in (0.0, 90.0, 180.0, 270.0)
        )
        return Places([region], _TURNED_PRESENCE if self.turned_deg else _NEAR_PRESENCE, tuple(rivals))


Turn = tuple[Palms | Middle, ...]
"""Ways to look for hands in one frame; each only if those before find none."""

_PLAIN: Final = Palms()
_WIDE: Final = Palms((1.25,))
_VERY_WIDE: Final = Palms((2.0,), near=True)
_MIDDLE_UP, *_MIDDLES_TURNED = (Middle(turned_deg) for turned_deg in (0.0, 180.0, 90.0, 270.0))

_AS_MEDIAPIPE: Final[Turn] = (_PLAIN,)
_FIRST: Final[Turn] = (Palms((1.0, 1.25)), _VERY_WIDE, _MIDDLE_UP, *_MIDDLES_TURNED)
# A search of palms takes the longest, so there is one in a frame. Most hands that are shown point upwards.
_WITHOUT_HANDS: Final[tuple[Turn, ...]] = tuple(
    turn for turned in _MIDDLES_TURNED for turn in ((_PLAIN,), (_WIDE, _MIDDLE_UP), (_PLAIN,), (_VERY_WIDE, turned))
)
# A hand that is followed was mostly found in the plain frame, in which a second one would have been seen too.
_BESIDE_A_HAND: Final[tuple[Turn, ...]] = ((_WIDE,), (_PLAIN,))


class Search:
    """Looks for hands in one frame after another, each time in other ways, so that no frame takes long.

    Args:
        palms: The palm model.
        limit: How many hands are wanted.
        wide: Whether to look in other ways than MediaPipe at all.
    """

    def __init__(self, palms: PalmDetector, limit: int, *, wide: bool) -> None:
        self._palms = palms
        self._limit = limit
        self._wide = wide
        self.reset()

    def reset(self) -> None:
        """Take the next frame for the first of a stream, in which it is looked for hands in all ways."""
        self._without_hands: Iterator[Turn] = itertools.repeat(_AS_MEDIAPIPE)
        self._beside_a_hand: Iterator[Turn] = itertools.repeat(_AS_MEDIAPIPE)
        if self._wide:
            self._without_hands = itertools.chain([_FIRST], itertools.cycle(_WITHOUT_HANDS))
            self._beside_a_hand = itertools.cycle(_BESIDE_A_HAND)

    def begin_again(self) -> None:
        """Of the ways to look in frames without hands, begin with those that find most: there may be one just now."""
        if self._wide:
            self._without_hands = itertools.cycle(_WITHOUT_HANDS)

    def places(self, image: NDArray[np.uint8], *, beside_a_hand: bool) -> Iterator[Places]:
        """Yield where hands may be in the next frame; further places are for when those before are no hands.

        Args:
            image: (height, width, 3) uint8, BGR.
            beside_a_hand: Whether one is followed already.
        """
        if self._wide and not beside_a_hand:
            self._beside_a_hand = itertools.cycle(_BESIDE_A_HAND)
        turn = next(self._beside_a_hand if beside_a_hand else self._without_hands)
        for way in turn:
            yield way.places(image, self._palms, self._limit)
