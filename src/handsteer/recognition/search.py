"""Decides where to search for new hands.

Palms are detected in the plain frame as MediaPipe does. The palm model misses hands that nearly fill a frame, fists
above all, so palms are also detected in a widened frame, where they appear smaller; and while there is no hand, the
landmark model is applied to the middle of the frame without any palm.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.palm import Palm, PalmDetector
from handsteer.recognition.roi import Roi

_MIDDLE: Final = 0.7
"""Side of the square in the middle, relative to the frame's shorter side."""
_NEAR: Final = 0.4
"""Side of a near hand's region, relative to the frame's longer side; a hand takes about half of its region."""
_NEAR_PRESENCE: Final = 0.9
"""Minimum presence of a hand that the palm model did not detect in the plain frame."""
_TURNED_PRESENCE: Final = 0.95
"""Likewise of a hand that does not point upwards: faces and people sometimes resemble one."""
_SURE_PALM: Final = 0.8


@dataclass(frozen=True)
class Places:
    """Possible regions of hands in a frame.

    Attributes:
        regions: By descending score.
        min_presence: Minimum presence of a hand, 0 to 1.
        rivals: Other rotations of a single region; of those that show a hand, the one with the highest presence is
            used.
    """

    regions: list[Roi]
    min_presence: float = 0.0
    rivals: tuple[Roi, ...] = ()


@dataclass(frozen=True)
class Palms:
    """Detect palms in a frame that is ``widened`` by these factors, optionally only those of ``near`` hands.

    The factors are tried in order, until there are enough palms with a high score.
    """

    widened: tuple[float, ...] = (1.0,)
    near: bool = False

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Places:
        """Return the regions of palms, at most ``limit`` in each of the widened frames."""
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
    """Use the middle of the frame, as if the fingers pointed ``turned_deg`` clockwise from up."""

    turned_deg: float = 0.0

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Places:
        """Return the region, with its other rotations as rivals.

        In a region rotated wrongly, the landmark model takes a thumb up for an index finger.
        """
        height, width = image.shape[:2]
        region, *rivals = (
            Roi(width / 2, height / 2, _MIDDLE * min(width, height), radians(self.turned_deg + turned))
            for turned in (0.0, 90.0, 180.0, 270.0)
        )
        return Places([region], _TURNED_PRESENCE if self.turned_deg else _NEAR_PRESENCE, tuple(rivals))


Turn = tuple[Palms | Middle, ...]
"""Ways to search one frame; each is used only if the previous ones find no hand."""

_PLAIN: Final = Palms()
_WIDE: Final = Palms((1.25,))
_VERY_WIDE: Final = Palms((2.0,), near=True)
_MIDDLE_UP, *_MIDDLES_TURNED = (Middle(turned_deg) for turned_deg in (0.0, 180.0, 90.0, 270.0))

_AS_MEDIAPIPE: Final[Turn] = (_PLAIN,)
_FIRST: Final[Turn] = (Palms((1.0, 1.25)), _VERY_WIDE, _MIDDLE_UP, *_MIDDLES_TURNED)
# Palm detection takes longest, so there is one per frame. Most hands that are shown point upwards.
_WITHOUT_HANDS: Final[tuple[Turn, ...]] = tuple(
    turn for turned in _MIDDLES_TURNED for turn in ((_PLAIN,), (_WIDE, _MIDDLE_UP), (_PLAIN,), (_VERY_WIDE, turned))
)
# A tracked hand was usually found in the plain frame, in which a second one would have been found too.
_BESIDE_A_HAND: Final[tuple[Turn, ...]] = ((_WIDE,), (_PLAIN,))


class Search:
    """Searches for hands in successive frames in alternating ways, so that no frame takes long.

    Args:
        palms: The palm model.
        limit: Number of hands wanted.
        wide: Whether to use other ways than MediaPipe's.
    """

    def __init__(self, palms: PalmDetector, limit: int, *, wide: bool) -> None:
        self._palms = palms
        self._limit = limit
        self._wide = wide
        self.reset()

    def reset(self) -> None:
        """Start a new stream, whose first frame is searched in all ways."""
        self._without_hands: Iterator[Turn] = itertools.repeat(_AS_MEDIAPIPE)
        self._beside_a_hand: Iterator[Turn] = itertools.repeat(_AS_MEDIAPIPE)
        if self._wide:
            self._without_hands = itertools.chain([_FIRST], itertools.cycle(_WITHOUT_HANDS))
            self._beside_a_hand = itertools.cycle(_BESIDE_A_HAND)

    def begin_again(self) -> None:
        """Restart the cycle for frames without hands at its most effective ways: a hand may be in view now."""
        if self._wide:
            self._without_hands = itertools.cycle(_WITHOUT_HANDS)

    def places(self, image: NDArray[np.uint8], *, beside_a_hand: bool) -> Iterator[Places]:
        """Yield possible regions of hands in the next frame; later ones are for when the earlier ones show no hand.

        ``beside_a_hand`` is whether a hand is tracked already; ``image`` is (height, width, 3) uint8, BGR.
        """
        if self._wide and not beside_a_hand:
            self._beside_a_hand = itertools.cycle(_BESIDE_A_HAND)
        turn = next(self._beside_a_hand if beside_a_hand else self._without_hands)
        for way in turn:
            yield way.places(image, self._palms, self._limit)
