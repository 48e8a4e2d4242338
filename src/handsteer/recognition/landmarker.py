"""MediaPipe's hand landmark models, run without MediaPipe.

The processing follows MediaPipe 0.10.21's graph ``hand_landmark_tracking_cpu``, used by ``mp.solutions.hands``: while
enough hands are tracked, only the landmark model runs, on the region from the last landmarks; otherwise palms are
detected in the whole frame first. In addition, unless configured otherwise, a new hand is processed twice, the second
time in the region from its own landmarks, because a palm locates a hand less precisely; in a photo, a third and a
fourth time if asked, see :meth:`MediaPipeLandmarker.look_again`; and hands are searched for in further ways than by
palms in the frame, see ``search``.

The first frame of a stream, and each frame without a time, is processed completely. In any other one the number of runs
of the models is limited, and the next frame does what is left: its second run on a new hand, or its first on a region.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import inf
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.config import LandmarksConfig
from handsteer.recognition.estimates import (
    SAME_HAND_OVERLAP,
    SECOND_LOOK,
    Estimate,
    distinct,
    estimate_region,
    hand_of,
    of_different_hands,
)
from handsteer.recognition.hand import Hand, check_picture
from handsteer.recognition.landmark_models import PictureModel, find_hand_models
from handsteer.recognition.regions import PalmDetector, Roi
from handsteer.recognition.search import (
    DOUBTFUL_PALM,
    Pace,
    Places,
    Search,
    Stillness,
    cells_of_frame,
    cells_of_hands,
)

_RUNS: Final = 5
"""Maximum runs of the landmark model in a frame without palm detection: four rotations, one of them twice."""
_RUNS_WITH_PALMS: Final = 2
"""Likewise in a frame with palm detection; a lost hand's count too. MediaPipe's ``full`` models take longer for one."""
_AGAIN_PRESENCE: Final = 0.9
"""Minimum presence in a second look: of four hands without a sign that it read as a motion, two had less."""
_OPINION_PRESENCE: Final = {False: _AGAIN_PRESENCE, True: 0.95}
"""Minimum presence in a second opinion, by whether it is mirrored.

With 0.9 mirrored too, a hand that hangs gave ``Backward`` in two of 11,220 views without a sign.
"""
_SURER: Final = 0.003
"""Presence by which the model has to be surer in it."""
_SEARCH: Final = Pace(change=6, settle_s=0.12, period_s=0.2)
"""How often to search without a hand: when settled, each of the four main ways has had its frame at 30 Hz."""
_SEARCH_BESIDE_A_HAND: Final = Pace(change=6, settle_s=0.6, period_s=1.0, least_s=0.3)
"""Likewise with a hand in view: after a change, both ways have their frame."""
_FOLLOW: Final = Pace(change=3, settle_s=0.08, period_s=0.1)
"""How often to process tracked hands: below three levels, landmarks deviate by at most 0.03 of the hand."""
_SAME_TURN_OVERLAP: Final = 0.3
"""Regions that overlap more than this share a turn: one way to search gives a face a region 1.5 times another's."""


class MediaPipeLandmarker:
    """Detects and tracks hands in frames; not thread-safe.

    Hands never swap places between frames.

    Args:
        config: Model, number of hands, thresholds, threads.

    Raises:
        ModelMissing: A model file is missing.
        ModelCorrupt: A model file has unexpected content.
    """

    def __init__(self, config: LandmarksConfig) -> None:
        self._config = config
        self._models = models = find_hand_models(config.model)
        least = config.min_detection_confidence
        doubtful = min(least, DOUBTFUL_PALM) if config.wide_search else None
        palms = PalmDetector(models.palm, config.threads, least, doubtful)
        self._search = Search(palms, config.max_hands, wide=config.wide_search)
        self._searched = Stillness()
        self._searched_beside = Stillness()
        self._still = Stillness()
        self._landmarks = PictureModel(models.landmark, config.threads)
        self._looked_at: list[Roi] = []
        self._image_size = (0, 0)
        self._start_stream()

    def _start_stream(self) -> None:
        self._followed: list[Roi] = []
        self._hands: list[Hand] = []
        self._has_rough = False
        self._has_tracked = False
        self._waiting: Places | None = None
        self._had_turn: list[Roi] = []
        self._runs_left = inf
        self._is_first = True

    @cached_property
    def _second_model(self) -> PictureModel | None:
        """The landmark model for second opinions, opened when it is needed."""
        return None if self._models.second is None else PictureModel(self._models.second, self._config.threads)

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands in ``image``, 1 to 32766 pixels a side, as :class:`Landmarker` describes.

        A frame of another size starts a new stream: no hand is tracked into it. A rejected frame changes nothing.
        Without ``dt_s``, every frame is processed.
        """
        check_picture(image)
        height, width = image.shape[:2]
        if (width, height) != self._image_size:
            self.reset()
            self._image_size = (width, height)
        for stillness in (self._searched, self._searched_beside, self._still):
            stillness.wait(dt_s)
        self._runs_left = inf if self._is_first or dt_s == inf else _RUNS
        self._is_first = False
        if self._has_rough or self._waiting:
            self._still.reset()
            estimates = self._followed_on(image)
        elif self._wants_search(image, search):
            self._still.reset()
            estimates = self._new_and_followed(image, self._followed)
        elif self._followed and self._still.wants_look(cells_of_hands(image, self._looked_at), _FOLLOW):
            estimates = self._followed_on(image)
        else:
            return list(self._hands)
        if self._followed and not estimates:
            self._searched.reset()
        present, self._followed = of_different_hands(estimates)
        self._has_rough = any(estimate.is_rough for estimate in present)
        self._has_tracked = not all(estimate.is_rough for estimate in present)
        if self._followed:
            self._looked_at = self._followed
            self._still.look(cells_of_hands(image, self._looked_at))
        self._hands = [hand_of(estimate, width, height) for estimate in present]
        return list(self._hands)

    def look_again(self, image: NDArray[np.uint8], hand: Hand) -> Hand:
        """Return ``hand`` as seen again in its own region and, mirrored, in a larger one, if the model is surer then.

        Only in photos and the first frame of a stream: in others, the next frames show as much.
        """
        index = self._index_of(hand)
        if index is None or self._runs_left < inf or not self._config.refine_new_hands:
            return hand
        own = self._followed[index]
        seconds = (self._run(image, own), self._run(image, own.grown(SECOND_LOOK), mirrored=True))
        best = max(seconds, key=lambda each: each.presence)
        is_another = any(best.region.overlap(one) > SAME_HAND_OVERLAP for one in self._followed if one is not own)
        if is_another or best.presence < max(_AGAIN_PRESENCE, hand.presence + _SURER):
            return hand
        self._hands[index] = hand_of(best, *self._image_size)
        self._followed[index] = best.region
        return self._hands[index]

    def second_opinion(self, image: NDArray[np.uint8], hand: Hand, *, mirrored: bool = False) -> Hand | None:
        """Return ``hand`` as a second landmark model sees it, if it is sure, as :class:`Landmarker` describes."""
        index, model = self._index_of(hand), self._second_model
        if index is None or model is None:
            return hand
        # The mirrored look, which may have to confirm this one, belongs to the same frame.
        if self._runs_left < (1 if mirrored else 2):
            return None
        self._runs_left -= 1
        seen = estimate_region(model, image, self._followed[index], mirrored=mirrored)
        return hand if seen.presence < _OPINION_PRESENCE[mirrored] else hand_of(seen, *self._image_size)

    def _index_of(self, hand: Hand) -> int | None:
        return next((index for index, each in enumerate(self._hands) if each is hand), None)

    def follow_only(self, hand: Hand) -> None:
        """Stop tracking all hands of the last frame except ``hand``."""
        kept = [index for index, each in enumerate(self._hands) if each is hand]
        self._hands = [self._hands[index] for index in kept]
        self._followed = [self._followed[index] for index in kept]
        self._waiting = None

    def reset(self) -> None:
        """Stop tracking all hands."""
        self._start_stream()
        self._search.reset()
        for stillness in (self._searched, self._searched_beside, self._still):
            stillness.reset()

    def _wants_search(self, image: NDArray[np.uint8], further: bool) -> bool:
        """Return whether to search for hands; while one is tracked, only if ``further`` ones are requested."""
        searched, pace = self._searched, _SEARCH
        if self._followed:
            if not further or self._config.max_hands == 1:
                return False
            searched, pace = self._searched_beside, _SEARCH_BESIDE_A_HAND
        if searched.is_too_early(pace) or not searched.wants_look(cells := cells_of_frame(image), pace):
            return False
        if searched.woken and not self._followed:
            self._search.begin_again()
        searched.look(cells)
        return True

    def _followed_on(self, image: NDArray[np.uint8]) -> list[Estimate]:
        """Return the hands that are still visible and those of waiting regions; if there is none, newly found ones."""
        waiting, self._waiting = self._waiting, None
        present = self._present(image, waiting or Places([]), self._followed)
        # A hand that its second run has rejected was none: searching for it as for a lost one would find it again.
        if present or not (self._has_tracked and self._config.wide_search):
            return present
        self._search.begin_again()
        # Search immediately for a hand that has jumped: it may show Stop.
        return [] if waiting else self._new_and_followed(image, [])

    def _new_and_followed(self, image: NDArray[np.uint8], followed: list[Roi]) -> list[Estimate]:
        """Return the tracked hands that are still visible, and newly found ones."""
        if not followed:
            # One of two hands may be found only in the next frame, which is searched in another way.
            self._searched_beside.reset()
        self._runs_left -= _RUNS - _RUNS_WITH_PALMS
        for places in self._search.places(image, beside_a_hand=bool(followed)):
            present = self._present(image, places, followed)
            if present or self._waiting:
                return present
        return []

    def _present(self, image: NDArray[np.uint8], places: Places, followed: list[Roi]) -> list[Estimate]:
        """Return the estimates of the regions ``followed`` and of ``places`` that show a hand.

        What lacks a run of the model waits for the next frame.
        """
        if places.rivals and self._runs_left < _RUNS:
            if self._runs_left < 1 or self._is_present(self._run(image, places.regions[0])):
                self._waiting = places
            return []
        regions = self._chosen(followed, places.regions)
        if len(regions) > self._runs_left:
            # The hand that points upwards may show Stop.
            regions.sort(key=lambda region: abs(region.rotation))
        present, left = self._of_regions(image, regions, places.min_presence)
        if left:
            self._waiting = Places(left, places.min_presence)
        if not present or not places.rivals:
            return present[: self._config.max_hands]
        rivals, _ = self._of_regions(image, places.rivals, places.min_presence)
        return [max(present + rivals, key=lambda each: each.presence)]

    def _chosen(self, followed: list[Roi], found: list[Roi]) -> list[Roi]:
        """Return different regions, in a stream at most ``max_hands``: those ``followed``, then of those ``found``.

        The found ones take turns, and without room they replace the last followed one. Otherwise a face that the
        palm model takes for a hand, or two hands of a person who watches, would hide the hand that shows a sign.
        """
        new = distinct([*followed, *found])[len(followed) :]
        if self._runs_left == inf or not new:
            return [*followed, *new]
        limit = self._config.max_hands
        room = max(limit - len(followed), min(1, limit - 1))
        had = {region for region in new if any(region.overlap(one) > _SAME_TURN_OVERLAP for one in self._had_turn)}
        if len(had) == len(new):
            self._had_turn, had = followed[limit - room :], set()
        chosen = sorted(new, key=lambda region: region in had)[:room]
        self._had_turn += chosen
        return [*followed[: limit - room], *chosen]

    def _of_regions(
        self, image: NDArray[np.uint8], regions: Sequence[Roi], min_presence: float
    ) -> tuple[list[Estimate], list[Roi]]:
        """Return the estimates of the regions that show a hand, and the regions that lack a run of the model."""
        firsts = [self._run(image, region) for region in regions if self._runs_left >= 1]
        present, left = [], list(regions[len(firsts) :])
        for region, first in zip(regions, firsts, strict=False):
            estimate, least = first, 0.0
            if all(region is not followed for followed in self._followed):
                estimate, least = self._refined(image, first), min_presence
            if estimate.is_rough and estimate.presence < least:
                left.append(region)
            elif self._is_present(estimate) and estimate.presence >= least:
                present.append(estimate)
        return present, left

    def _refined(self, image: NDArray[np.uint8], first: Estimate) -> Estimate:
        """Return the estimate of the second run on a new hand; ``first``, as a rough one, if no run is left."""
        if not self._config.refine_new_hands or not self._is_present(first):
            return first
        rough = replace(first, is_rough=True)
        return self._run(image, rough.region) if self._runs_left >= 1 else rough

    def _run(self, image: NDArray[np.uint8], region: Roi, *, mirrored: bool = False) -> Estimate:
        self._runs_left -= 1
        return estimate_region(self._landmarks, image, region, mirrored=mirrored)

    def _is_present(self, estimate: Estimate) -> bool:
        return estimate.presence > self._config.min_presence
