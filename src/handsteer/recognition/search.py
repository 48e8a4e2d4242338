"""Decides where to search for new hands, and when: not in a picture that has not changed.

Palms are detected in the plain frame as MediaPipe does. A palm model misses hands in dark, noisy pictures, so palms
are also detected in a smoothed frame, in which it misses some small hands instead; and hands that nearly fill a frame,
fists above all, so palms are also detected in a widened frame, where they appear smaller. While there is no hand, palms
of a low score count too if the landmark model is sure of their hands, and that model is applied to the middle of the
frame without any palm. The palm model was trained on colours, so in a grey frame, palms are detected in a copy that is
tinted like skin too.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, radians
from typing import ClassVar, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.landmark_models import is_grey
from handsteer.recognition.regions import Palm, PalmDetector, Roi

_MIDDLE: Final = 0.7
"""Side of the square in the middle, relative to the frame's shorter side."""
_NEAR: Final = 0.4
"""Side of a near hand's region, relative to the frame's longer side; a hand takes about half of its region."""
_NEAR_PRESENCE: Final = 0.9
"""Minimum presence of a hand that the palm model did not detect in the plain frame."""
_TURNED_PRESENCE: Final = 0.95
"""Likewise of a hand that does not point upwards: faces and people sometimes resemble one."""
_SURE_PALM: Final = 0.8
DOUBTFUL_PALM: Final = 0.1
"""Minimum score of a palm that counts only if the landmark model is sure of its hand.

Hands that point down, dark ones, and those at the frame's edge often score less than the configured minimum.
"""
_DOUBTFUL_PRESENCE: Final = 0.95
"""Minimum presence of the hand of such a palm; with 0.9, pictures of people at rest are misread."""
_LARGER: Final = 1.7
_SURE_LARGER: Final = (1.3, _LARGER)
"""Factors on the region of a palm in which the landmark model sees no hand: the palm's box may be too small.

In the smaller one a doubtful palm gave ``Go`` for a person who shows nothing.
"""
_RETRIED: Final = 4
"""Maximum number of sure and of doubtful palms that are tried again."""
_FURTHER: Final = 2
"""Palms beyond the wanted number: one that shows a sign may have a lower score than those of another person."""
_TINT: Final = (1.25, 1.05, 0.80)
"""Exponents of grey, 0 to 1, that give the blue, green and red of about the skin of that brightness."""

Cells = NDArray[np.uint8]
"""Mean colours of the cells of a picture, as a small picture; a hand may be as bright as its background."""

_ACROSS_FRAME: Final = 48
"""Number of cells along the longer side of a frame: a readable hand is larger than a cell."""
_ACROSS_HAND: Final = 12
_SAMPLES: Final = 6
"""Rows and columns that are sampled per cell; more hardly reduce the noise of its mean."""


@dataclass(frozen=True)
class Places:
    """Possible regions of hands in a frame.

    Attributes:
        regions: The most promising first.
        min_presence: Minimum presence of a hand, 0 to 1.
        rivals: Other rotations of a single region; of those that show a hand, the one with the highest presence is
            used.
    """

    regions: list[Roi]
    min_presence: float = 0.0
    rivals: tuple[Roi, ...] = ()


@dataclass(frozen=True)
class PalmView:
    """How the palm model sees a frame: ``widened`` by a factor, and ``smoothed``; see ``regions``."""

    widened: float = 1.0
    smoothed: bool = False


@dataclass(frozen=True)
class Palms:
    """Detect palms in these ``views`` of a frame, optionally only those of ``near`` hands.

    The views are tried in order, until there are enough palms with a high score. Larger regions of palms come last, if
    wanted: they are for palms in whose own the landmark model sees no hand. In a stream, the next frames do as much.
    Tinted ones are for frames without colours only.
    """

    views: tuple[PalmView, ...] = (PalmView(),)
    near: bool = False
    larger: bool = False
    tinted: bool = False

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Iterator[Places]:
        """Yield the regions of palms, those of ``limit`` hands and a few more, then those of doubtful palms, if any.

        A palm that is found as sampled comes before those that only smoothing shows: the landmark model reads more
        hands in its region.
        """
        found: list[tuple[bool, Palm]] = []
        image = _tinted(image) if self.tinted else image
        for view in self.views:
            if sum(palm.score >= _SURE_PALM for _, palm in found) < limit:
                seen = palms.detect(image, limit + _FURTHER, widened=view.widened, smoothed=view.smoothed)
                found += [(view.smoothed, palm) for palm in seen]
        found.sort(key=lambda each: (each[0], -each[1].score))
        regions = [palm.roi for _, palm in found if palm.is_sure]
        if self.near:
            yield Places([roi for roi in regions if roi.side >= _NEAR * max(image.shape[:2])], _NEAR_PRESENCE)
            return
        yield Places(regions)
        palms_left = sorted((palm for _, palm in found if not palm.is_sure), key=lambda palm: -palm.score)
        doubtful = [palm.roi for palm in palms_left]
        if doubtful:
            yield Places(doubtful, _DOUBTFUL_PRESENCE)
        if self.larger:
            again = [region.grown(factor) for factor in _SURE_LARGER for region in regions[:_RETRIED]]
            again += [region.grown(_LARGER) for region in doubtful[:_RETRIED]]
            # One by one: of several regions of one hand, only the first is used.
            yield from (Places([region], _DOUBTFUL_PRESENCE) for region in again)


@dataclass(frozen=True)
class Middle:
    """Use the middle of the frame, as if the fingers pointed ``turned_deg`` clockwise from up."""

    turned_deg: float = 0.0
    tinted: ClassVar = False

    def places(self, image: NDArray[np.uint8], palms: PalmDetector, limit: int) -> Iterator[Places]:
        """Yield the region, with its other rotations as rivals.

        In a region rotated wrongly, the landmark model takes a thumb up for an index finger.
        """
        height, width = image.shape[:2]
        region, *rivals = (
            Roi(width / 2, height / 2, _MIDDLE * min(width, height), radians(self.turned_deg + turned))
            for turned in (0.0, 90.0, 180.0, 270.0)
        )
        yield Places([region], _TURNED_PRESENCE if self.turned_deg else _NEAR_PRESENCE, tuple(rivals))


Turn = tuple[Palms | Middle, ...]
"""Ways to search one frame; each is used only if the previous ones find no hand."""

_VIEWS: Final = tuple(PalmView(widened, smoothed) for widened in (1.0, 1.25) for smoothed in (False, True))
_PLAIN, _SMOOTH, _WIDE, _SMOOTH_WIDE = (Palms((view,)) for view in _VIEWS)
_VERY_WIDE: Final = Palms((PalmView(2.0),), near=True)
_MIDDLE_UP, *_MIDDLES_TURNED = (Middle(turned_deg) for turned_deg in (0.0, 180.0, 90.0, 270.0))

_AS_MEDIAPIPE: Final[Turn] = (_PLAIN,)
_ALL_SIZES: Final = (Palms(_VIEWS, larger=True), _VERY_WIDE)
_FIRST: Final[Turn] = (*_ALL_SIZES, _MIDDLE_UP, *_MIDDLES_TURNED, *(replace(way, tinted=True) for way in _ALL_SIZES))
# Palm detection takes longest, so there is one per frame. Most hands that are shown point upwards. With colours, the
# turns that consist of tinted ways only are left out.
_WITHOUT_HANDS: Final[tuple[Turn, ...]] = tuple(
    turn
    for turned, wide in zip(_MIDDLES_TURNED, itertools.cycle((_WIDE, _SMOOTH_WIDE)), strict=False)
    for turn in (
        *((_PLAIN,), (wide, _MIDDLE_UP), (_SMOOTH,), (_VERY_WIDE, turned)),
        *((replace(way, tinted=True),) for way in (_PLAIN, wide, _SMOOTH, _VERY_WIDE)),
    )
)
# A tracked hand was usually found in the plain frame, in which a second one would have been found too.
_BESIDE_A_HAND: Final[tuple[Turn, ...]] = ((_SMOOTH_WIDE,), (_PLAIN,))


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
        turns = self._beside_a_hand if beside_a_hand else self._without_hands
        has_no_colours = is_grey(image)
        usable = ([way for way in turn if has_no_colours or not way.tinted] for turn in turns)
        for way in next(filter(None, usable)):
            for places in way.places(image, self._palms, self._limit):
                yield places
                if beside_a_hand:
                    break


def _tinted(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the grey ``image``, (height, width, 3) uint8, BGR, as if all in it were skin."""
    levels = np.arange(256)[:, None] / 255
    return np.asarray(cv2.LUT(image, np.rint(255 * levels**_TINT).astype(np.uint8)[None]), np.uint8)


@dataclass(frozen=True)
class Pace:
    """How often to process frames.

    Attributes:
        change: Difference of a cell, in levels of 255, that counts as a change.
        settle_s: Time after a change in which every frame is processed.
        period_s: Time between processed frames while nothing changes.
        least_s: Minimum time between processed frames.
    """

    change: float
    settle_s: float
    period_s: float
    least_s: float = 0.0


class Stillness:
    """Decides whether to process a frame: while the picture changes, and periodically.

    The picture is compared with the last processed one, not with the last frame, so slow changes are detected too.

    Attributes:
        woken: Whether the last frame in question has changed after frames that were not worth processing.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Treat the picture as just changed."""
        self._seen: Cells | None = None
        self._since_change_s = 0.0
        self._since_look_s = inf
        self._rests = False
        self.woken = False

    def wait(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, >= 0."""
        self._since_change_s += dt_s
        self._since_look_s += dt_s

    def is_too_early(self, pace: Pace) -> bool:
        """Return whether not to process a frame yet, changed or not."""
        return self._since_look_s < pace.least_s

    def wants_look(self, cells: Cells, pace: Pace) -> bool:
        """Return whether to process the frame of ``cells``, of the same shape as in :meth:`look`."""
        changed = self._seen is None or cv2.norm(cells, self._seen, cv2.NORM_INF) >= pace.change
        self.woken = changed and self._rests
        if changed:
            self._rests = False
            self._since_change_s = 0.0
            return True
        wanted = self._since_look_s >= pace.period_s or self._since_change_s < pace.settle_s
        self._rests = self._rests or not wanted
        return wanted

    def look(self, cells: Cells) -> None:
        """Record that the frame with these ``cells`` is processed."""
        self._seen = cells
        self._since_look_s = 0.0


def cells_of_frame(image: NDArray[np.uint8]) -> Cells:
    """Return up to (36, 48, 3) cells of ``image``, (height, width, 3) uint8, BGR; fewer for a small image."""
    height, width = image.shape[:2]
    scale = min(1.0, _ACROSS_FRAME / max(height, width))
    return _means(image, max(1, round(height * scale)), max(1, round(width * scale)))


def cells_of_hands(image: NDArray[np.uint8], regions: Sequence[Roi]) -> Cells:
    """Return the (12 n, 12, 3) cells of the n ``regions`` of hands, as far as they are within ``image``."""
    return np.concatenate([_means(_box(image, region), _ACROSS_HAND, _ACROSS_HAND) for region in regions])


def _box(image: NDArray[np.uint8], region: Roi) -> NDArray[np.uint8]:
    """Return the part of ``image`` in the upright square around the centre of ``region``, at least one pixel."""
    height, width = image.shape[:2]
    left, top = region.center_x - region.side / 2, region.center_y - region.side / 2
    begin_x, begin_y = int(np.clip(left, 0, width - 1)), int(np.clip(top, 0, height - 1))
    end_x, end_y = max(begin_x + 1, int(left + region.side)), max(begin_y + 1, int(top + region.side))
    return image[begin_y:end_y, begin_x:end_x]


def _means(image: NDArray[np.uint8], rows: int, columns: int) -> Cells:
    """Return the means of (rows, columns, 3) cells of ``image``, from a sample of their pixels."""
    some = cv2.resize(image, (columns * _SAMPLES, rows * _SAMPLES), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.resize(some, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
