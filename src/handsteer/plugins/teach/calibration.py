"""Calibration: makes a profile of one person from hands that showed each sign, and reports what it reads."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer import __version__
from handsteer.errors import ProfileError
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.synthetic.hands import SHAPES, make_hands
from handsteer.plugins.teach.synthetic.people import draw_people, load_people
from handsteer.recognition.features import COUNT, shape_features
from handsteer.recognition.hand import Classifier, Hand
from handsteer.recognition.profile import (
    FLOOR,
    MOST_VIEWS,
    REACH,
    SHAPES_OF,
    Profile,
    ProfiledClassifier,
    distances,
    load_profile,
    log_odds,
    profile_name,
    save_profile,
    shape_probability,
    whitened,
)
from handsteer.recognition.shipped_signs import SURE, ShippedClassifier
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

Array = NDArray[np.float64]

FEWEST_HANDS: Final = 4
"""Minimum number of hands that show a sign."""

HOLD: Final[Mapping[str, str]] = {
    STOP: "hold your palm to the camera, all fingers straight and up",
    FORWARD: "point up with your index finger alone, in the plane of the picture",
    BACKWARD: "point down with your index finger alone, in the plane of the picture",
    TURN_LEFT: "stretch your thumb to your left, level, the fingers closed",
    TURN_RIGHT: "stretch your thumb to your right, level, the fingers closed",
    GO: "close your hand to a fist, the thumb over the fingers",
}
"""How to hold each sign, as the end of a sentence."""

_LEAST_DIRECTED: Final = 0.5
_LEAST_USABLE: Final = 0.3
"""Minimum share of the hands of a sign from which the profile can learn it."""
_MOST_HANDS: Final = 300
_SPREADS: Final = 1.6
"""Reach in distances between neighbouring views of a person."""
_EVERYBODYS_REACH: Final = 0.52
_EVERYBODYS_WEIGHT: Final = 8
"""Weight of everybody's reach, in views."""
_SHORTER: Final = 0.9
_MARGIN: Final = 4
"""A profile is to take so many times more motions away from hands that mean nothing than it adds."""
_MADE, _DRAWN, _SEED = 10_000, 8_000, 23


@dataclass(frozen=True)
class SignResult:
    """How one sign was shown, and what became of it.

    Attributes:
        sign: The sign.
        before: How many of the hands that showed it the shipped classifier reads as it.
        after: The same with the profile, each half of the hands judged by the other half's; None if not adapted.
        read_as: What the others were read as most often; empty if none.
        why_not: Why the sign was not adapted, as a sentence without a full stop; empty if it was.
    """

    sign: str
    before: Share
    after: Share | None
    read_as: str
    why_not: str


@dataclass(frozen=True)
class Calibration:
    """A profile, and the result for each sign that was shown."""

    profile: Profile
    results: tuple[SignResult, ...]


def calibrate(name: str, shown: Mapping[str, Sequence[Hand]], shipped: ShippedClassifier) -> Calibration:
    """Return a profile of the person who showed these hands.

    A sign is adapted where at least three of ten hands point as it should, and have its shape with at least the
    probability :data:`~handsteer.recognition.profile.FLOOR`. Its reach is that of the person's own views, shrunk to
    everybody's. It is shortened until, of synthetic hands that mean nothing, fewer move the robot than without the
    profile.

    Args:
        name: Of the profile.
        shown: The hands that showed each sign, in the order in which they were seen.
        shipped: Reads the hands as everybody shows them.

    Raises:
        ProfileError: The name is none, or no sign can be adapted.
    """
    name = profile_name(name)
    hands = {sign: _thinned([hand for hand in shown.get(sign, ()) if _is_finite(hand)]) for sign in SIGNS}
    usable = {sign: [hand for hand in some if not why_unusable(hand, sign, shipped)] for sign, some in hands.items()}
    why_not = {sign: _why_not(sign, hands[sign], usable[sign], shipped) for sign in SIGNS}
    views, reach = _learnt({sign: some for sign, some in usable.items() if not why_not[sign]}, shipped)
    for sign in [sign for sign in views if sign not in reach]:
        why_not[sign] = f"hands of others that mean nothing look like it: {HOLD[sign]}"
        del views[sign]
    results = tuple(
        SignResult(sign, before, _held_out(sign, hands, usable, reach, shipped), read_as, why_not[sign])
        for sign in SIGNS
        if hands[sign]
        for before, read_as in [_read(hands[sign], sign, shipped)]
    )
    if not reach:
        raise ProfileError("; ".join(f"{sign}: {why_not[sign]}" for sign in SIGNS))
    made = {"handsteer": __version__, "signs": {each.sign: _facts(each) for each in results}}
    return Calibration(Profile(name, views, reach, made), results)


def shown_hand(hands: Sequence[Hand], sign: str, shipped: ShippedClassifier) -> Hand | None:
    """Return which of the ``hands`` of a frame shows ``sign``: the likeliest, of unlikely ones the largest."""
    likelihoods = [shipped.classify(hand).likelihoods[sign] for hand in hands]
    order = sorted(range(len(hands)), key=lambda at: (round(likelihoods[at], 2), hands[at].longer_side_px))
    return hands[order[-1]] if order else None


def why_unusable(hand: Hand, sign: str, shipped: ShippedClassifier) -> str:
    """Return why ``hand``, which is to show ``sign``, does not: ``read``, ``direction`` or ``shape``; empty if it does.

    ``read`` means that the shipped classifier is sure of another sign.
    """
    guess = shipped.classify(hand)
    if guess.sign not in (NONE, sign) and guess.confidence >= SURE:
        return "read"
    shapes = shipped.model.probabilities(_features([hand])[0])
    if shipped.likelihoods(dict.fromkeys(shapes, 1.0), hand)[sign] < _LEAST_DIRECTED:
        return "direction"
    return "shape" if shape_probability(shapes, sign) < FLOOR else ""


def _why_not(sign: str, hands: Sequence[Hand], usable: Sequence[Hand], shipped: ShippedClassifier) -> str:
    if len(hands) < FEWEST_HANDS:
        return f"only {len(hands)} hands were seen, and {FEWEST_HANDS} are needed: come nearer, in more light"
    if len(usable) >= max(FEWEST_HANDS, _LEAST_USABLE * len(hands)):
        return ""
    why = Counter(reason for hand in hands if (reason := why_unusable(hand, sign, shipped))).most_common(1)[0][0]
    words = {
        "read": f"it is read as {_read(hands, sign, shipped)[1]}",
        "direction": "it points elsewhere, or is far away",
        "shape": "it looks too different from everybody's",
    }
    return f"{words[why]}: {HOLD[sign]}"


def _learnt(
    usable: Mapping[str, Sequence[Hand]], shipped: ShippedClassifier, *, checked: bool = True
) -> tuple[dict[str, Array], dict[str, float]]:
    """Return the views of each sign, and their reach; none where hands of others are too similar."""
    views = {sign: _typical(_features(hands), shipped) for sign, hands in usable.items()}
    reach: dict[str, float] = {}
    for sign, mine in views.items():
        wanted = _wanted_reach(whitened(shipped, mine))
        allowed = _checked_reach(sign, mine, wanted, shipped) if checked else wanted
        if allowed is not None:
            reach[sign] = allowed
    return views, reach


def _typical(features: Array, shipped: ShippedClassifier) -> Array:
    """Return at most MOST_VIEWS of (n, features), chosen so that the others are near them."""
    rows = whitened(shipped, features)
    gaps = np.linalg.norm(rows[:, None] - rows[None], axis=2)
    nearest = np.full(len(rows), np.inf)
    chosen: list[int] = []
    while len(chosen) < min(MOST_VIEWS, len(rows)):
        costs = np.minimum(gaps, nearest[None]).sum(axis=1)
        costs[chosen] = np.inf
        chosen.append(int(costs.argmin()))
        nearest = np.minimum(nearest, gaps[chosen[-1]])
    typical: Array = features[sorted(chosen)].astype(np.float32).astype(np.float64)
    return typical


def _wanted_reach(rows: Array) -> float:
    """Return the reach of (k, features) views, whitened: from their own distances, shrunk to everybody's."""
    gaps = np.linalg.norm(rows[:, None] - rows[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    own = _SPREADS * float(np.median(gaps.min(axis=1))) if len(rows) > 1 else _EVERYBODYS_REACH
    count = len(rows)
    reach = (count * own + _EVERYBODYS_WEIGHT * _EVERYBODYS_REACH) / (count + _EVERYBODYS_WEIGHT)
    return float(np.clip(reach, *REACH))


def _checked_reach(sign: str, views: Array, reach: float, shipped: ShippedClassifier) -> float | None:
    """Return ``reach``, shortened as much as synthetic hands that mean nothing require; None if that is too much."""
    features, shapes = _others()
    features = features[~np.isin(shapes, [SHAPES.index(shape) for shape in SHAPES_OF[sign]])]
    columns = [shipped.model.shapes.index(shape) for shape in SHAPES_OF[sign]]
    before = _chances(features, shipped)[:, columns].sum(axis=1)
    away = distances(whitened(shipped, features), whitened(shipped, views))
    threshold = _threshold(sign, shipped)
    was_read = before >= threshold
    while reach >= REACH[0]:
        added = log_odds(away, reach)
        added[(added > 0.0) & (before < FLOOR)] = 0.0
        odds = before * np.exp(added)
        is_read = odds / (1.0 - before + odds) >= threshold
        if _MARGIN * int((is_read & ~was_read).sum()) <= int((was_read & ~is_read).sum()):
            return reach
        reach = reach * _SHORTER if reach * _SHORTER >= REACH[0] or reach == REACH[0] else REACH[0]
    return None


def _threshold(sign: str, shipped: ShippedClassifier) -> float:
    """Return the likelihood at which ``shipped`` is sure of ``sign``."""
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (low, middle) if shipped.confidence(sign, middle) >= SURE else (middle, high)
    return high


@lru_cache(maxsize=1)
def _others() -> tuple[Array, NDArray[np.int64]]:
    """Return the features and the shapes of synthetic hands of everybody, in any direction."""
    random = np.random.default_rng(_SEED)
    made = make_hands(_MADE, random)
    image, space, shapes = draw_people(_DRAWN, random, load_people())
    features = np.concatenate([shape_features(made.pixels, made.world), shape_features(image, space)])
    return features, np.concatenate([made.shapes, shapes])


def _chances(features: Array, shipped: ShippedClassifier) -> Array:
    """Return the (n, shapes) probabilities that ``shipped`` uses for (n, features)."""
    model = shipped.model
    chances = model.network.probabilities(features)
    is_new = model.novelty.distances(features, chances.argmax(axis=1)) > model.novelty.limit
    chances[is_new] = np.eye(len(model.shapes))[model.shapes.index("other")]
    return chances


def _held_out(
    sign: str,
    hands: Mapping[str, Sequence[Hand]],
    usable: Mapping[str, Sequence[Hand]],
    reach: Mapping[str, float],
    shipped: ShippedClassifier,
) -> Share | None:
    """Return how many of the hands of ``sign`` are read as it by a profile of hands of other moments."""
    if sign not in reach:
        return None
    right, known = 0, {id(hand) for each in reach for hand in usable[each]}
    for part in (0, 1):
        rest = {each: [hand for hand in _part(hands[each], 1 - part) if id(hand) in known] for each in reach}
        views, _ = _learnt({each: some for each, some in rest.items() if some}, shipped, checked=False)
        classifier = ProfiledClassifier(shipped, Profile("half", views, {each: reach[each] for each in views}, {}))
        right += _read(_part(hands[sign], part), sign, classifier)[0].count
    return Share(right, len(hands[sign]))


def _part(hands: Sequence[Hand], part: int) -> list[Hand]:
    """Return one half of ``hands``: their first and third quarter, or the others."""
    quarters = np.array_split(np.arange(len(hands)), 4)
    return [hands[at] for at in np.concatenate([quarters[part], quarters[part + 2]])]


def _read(hands: Sequence[Hand], sign: str, classifier: Classifier) -> tuple[Share, str]:
    """Return how many of ``hands`` are read as ``sign``, and what the others are read as most often."""
    guesses = [classifier.classify(hand) for hand in hands]
    seen = Counter(guess.sign if guess.confidence >= SURE else NONE for guess in guesses)
    right = seen.pop(sign, 0)
    return Share(right, len(hands)), seen.most_common(1)[0][0] if seen else ""


def _features(hands: Sequence[Hand]) -> Array:
    if not hands:
        return np.zeros((0, COUNT))
    pixels = np.array([hand.pixels[:, :2] for hand in hands], np.float64)
    return shape_features(pixels, np.array([hand.world for hand in hands], np.float64))


def _thinned(hands: Sequence[Hand]) -> list[Hand]:
    """Return at most _MOST_HANDS of ``hands``, evenly."""
    if len(hands) <= _MOST_HANDS:
        return list(hands)
    return [hands[at] for at in np.linspace(0, len(hands) - 1, _MOST_HANDS).round().astype(int)]


def _is_finite(hand: Hand) -> bool:
    return bool(np.isfinite(hand.points[:, :2]).all() and np.isfinite(hand.world).all())


def _facts(result: SignResult) -> dict[str, Any]:
    return {name: value for name, value in asdict(result).items() if name != "sign"}


def save_calibrated(profile: Profile, path: Path) -> tuple[str, ...]:
    """Write ``profile`` to ``path``; return the signs that it lacks and were kept of a profile there.

    Who shows only some signs again loses none of the others. A damaged profile is replaced.

    Raises:
        ProfileError: It cannot be written.
    """
    try:
        older = load_profile(path)
    except ProfileError:
        older = profile
    views, reach = {**older.views, **profile.views}, {**older.reach, **profile.reach}
    save_profile(replace(profile, views=views, reach=reach), path)
    return tuple(sign for sign in older.views if sign not in profile.views)
