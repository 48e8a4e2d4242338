"""Profiles: how one person shows the shipped signs, and a classifier that adapts to it."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import platformdirs
from numpy.typing import NDArray

from handsteer.errors import ProfileError
from handsteer.recognition.features import COUNT, shape_features
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.npz import Arrays, NpzFormat
from handsteer.recognition.shipped_signs import ShippedClassifier
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

Array = NDArray[np.float64]

FORMAT: Final = 1
"""Version of the file format and of the features."""

SHAPES_OF: Final[Mapping[str, tuple[str, ...]]] = {
    STOP: ("open",),
    GO: ("fist",),
    FORWARD: ("index",),
    BACKWARD: ("index", "index_down"),
    TURN_LEFT: ("thumb",),
    TURN_RIGHT: ("thumb",),
}
"""The shapes of the shipped model that each sign may have."""

MOST_VIEWS: Final = 16
"""Maximum number of views of a sign."""
REACH: Final = (0.3, 0.55)
"""Smallest and largest distance of a hand from a view at which the view speaks for it.

Distances are root mean squares of features whitened by the spread of everybody's hands of one shape.
"""
FLOOR: Final = 0.005
"""Least probability, in the shipped model, of the shape of a sign that views speak for."""

_GAIN: Final = 10.0
"""Log-odds that a view adds for a hand that equals it; at its reach it adds none."""
_LOSS: Final = 1.0
"""Log-odds that a sign loses at most for a hand that is far from all its views."""
_LONGEST_NAME: Final = 40
_LARGEST_BYTES: Final = 1_000_000
_LARGEST_FEATURE: Final = 5.0
_NAME: Final = re.compile(r"\w[\w .-]*")

_FILE: Final = NpzFormat(
    "profile of the signs",
    FORMAT,
    missing=ProfileError,
    corrupt=ProfileError,
    remedy="give one that `handsteer signs calibrate` has written, or calibrate again",
)


@dataclass(frozen=True)
class Profile:
    """How one person shows the shipped signs; has features of hands, no pictures.

    Attributes:
        name: The person, or what they call it.
        views: (k, :data:`~handsteer.recognition.features.COUNT`) features of k typical hands for each adapted sign.
        reach: The distance from a view up to which it speaks for a hand, for each of these signs.
        made: How it was made, as plain values.
    """

    name: str
    views: Mapping[str, Array]
    reach: Mapping[str, float]
    made: Mapping[str, Any]


class ProfiledClassifier:
    """A :class:`~handsteer.recognition.hand.Classifier` that reads the shipped signs as one person shows them.

    The odds of a sign's shape increase for hands near the person's own views of that sign, and decrease for hands far
    from all of them. Where another person's hands move the robot, this narrows it:

    - It reads a sign other than ``Stop`` with at least some confidence only if the shipped classifier reads the same
      sign with at least that confidence, or the hand is within :attr:`Profile.reach` of a view of that sign and has its
      shape with at least the probability :data:`FLOOR`.
    - A hand that the shipped classifier reads as ``Stop`` is read unchanged.

    Args:
        shipped: Reads the hands as everybody shows them.
        profile: The person's views.
    """

    def __init__(self, shipped: ShippedClassifier, profile: Profile) -> None:
        self._shipped = shipped
        self._views = {sign: whitened(shipped, views) for sign, views in profile.views.items()}
        self._reach = dict(profile.reach)

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        return self._shipped.signs

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows; ``NONE`` if that is likelier."""
        known = self._shipped.classify(hand)
        if known.sign == STOP or not (np.isfinite(hand.points[:, :2]).all() and np.isfinite(hand.world).all()):
            return known
        features = shape_features(hand.pixels[None, :, :2].astype(np.float64), hand.world[None])
        shapes = self._shipped.model.probabilities(features[0])
        evidence = self._evidence(features, shapes)
        likelihoods = self._adapted(hand, shapes, evidence, known.likelihoods)
        best = max(likelihoods, key=likelihoods.__getitem__)
        none = max(0.0, 1.0 - sum(likelihoods.values()))
        if none >= likelihoods[best] or (best != known.sign and evidence[best] <= 0.0):
            return SignGuess(NONE, none, likelihoods)
        return SignGuess(best, self.confidence(best, likelihoods[best]), likelihoods)

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign`` with this ``likelihood``."""
        return self._shipped.confidence(sign, likelihood)

    def _evidence(self, features: Array, shapes: Mapping[str, float]) -> dict[str, float]:
        """Return the log-odds that the views of each sign add for a hand of (1, features); 0 without views."""
        row = whitened(self._shipped, features)
        found = dict.fromkeys(SIGNS, 0.0)
        for sign, views in self._views.items():
            added = float(log_odds(distances(row, views), self._reach[sign])[0])
            if added > 0.0 and shape_probability(shapes, sign) < FLOOR:
                added = 0.0
            found[sign] = added
        return found

    def _adapted(
        self, hand: Hand, shapes: Mapping[str, float], evidence: Mapping[str, float], known: Mapping[str, float]
    ) -> dict[str, float]:
        """Return the likelihoods of the signs by the shipped ``shapes`` and the ``evidence`` of the views."""
        directed = self._shipped.likelihoods(dict.fromkeys(shapes, 1.0), hand)
        weights = dict(shapes)
        for shape in {shape for several in SHAPES_OF.values() for shape in several}:
            # Of two signs of a shape, the hand's direction determines the one in question.
            sign = max((each for each in SIGNS if shape in SHAPES_OF[each]), key=directed.__getitem__)
            weights[shape] *= math.exp(evidence[sign])
        total = sum(weights.values())
        likelihoods = self._shipped.likelihoods({name: weight / total for name, weight in weights.items()}, hand)
        for sign, likelihood in likelihoods.items():
            if sign == STOP:
                likelihoods[sign] = max(likelihood, known[sign])
            elif evidence[sign] <= 0.0:
                likelihoods[sign] = min(likelihood, known[sign])
        return likelihoods


def shape_probability(shapes: Mapping[str, float], sign: str) -> float:
    """Return the probability, 0 to 1, that a hand has a shape of ``sign``, by those of all shapes."""
    return sum(shapes[shape] for shape in SHAPES_OF[sign])


def whitened(shipped: ShippedClassifier, features: Array) -> Array:
    """Return (n, features) of hands as (n, features) whose Euclidean distances are those of :data:`REACH`."""
    novelty = shipped.model.novelty
    rows: Array = (features - novelty.mean) * novelty.scale @ novelty.whitening / math.sqrt(COUNT)
    return rows


def distances(rows: Array, views: Array) -> Array:
    """Return the (n,) distances of (n, features) from the nearest of (k, features), both whitened."""
    squares = (rows**2).sum(axis=1)[:, None] - 2.0 * rows @ views.T + (views**2).sum(axis=1)
    nearest: Array = np.sqrt(np.maximum(squares, 0.0)).min(axis=1)
    return nearest


def log_odds(away: Array, reach: float) -> Array:
    """Return the (n,) log-odds that views add for hands (n,) ``away`` from them: positive within their reach only."""
    added: Array = np.maximum(_GAIN * (1.0 - (away / reach) ** 2), -_LOSS)
    return added


def profiles_dir() -> Path:
    """Return the folder of the profiles that are chosen by name, in the user's data directory."""
    return platformdirs.user_data_path("handsteer", appauthor=False) / "profiles"


def profile_path(name: Path) -> Path:
    """Return the file of a profile: a path that ends in ``.npz`` or has a folder, or a name in :func:`profiles_dir`."""
    if name.suffix == ".npz" or len(name.parts) != 1:
        return name.expanduser()
    return profiles_dir() / f"{name}.npz"


def profile_names() -> list[str]:
    """Return the names of the profiles in :func:`profiles_dir`, sorted; damaged files are not noticed."""
    try:
        return sorted(path.stem for path in profiles_dir().glob("*.npz") if not path.name.startswith("."))
    except OSError:
        return []


def profile_name(text: str) -> str:
    """Return ``text`` as the name of a profile.

    Raises:
        ProfileError: It is none.
    """
    name = " ".join(text.split())
    if not _NAME.fullmatch(name) or len(name) > _LONGEST_NAME or name.endswith(".npz"):
        raise ProfileError(
            f"{name[:60]!r} is not a valid name for a profile: give 1 to {_LONGEST_NAME} letters, digits, spaces, - . "
            "or _, "
            "as 'Anna'"
        )
    return name


def save_profile(profile: Profile, path: Path) -> None:
    """Write ``profile`` to ``path``, atomically; its folder is made if it is :func:`profiles_dir`.

    Raises:
        ProfileError: It cannot be written.
    """
    signs = tuple(profile.views)
    content = {
        "name": np.array(profile.name),
        "signs": np.array(signs, dtype="U20"),
        "reach": np.array([profile.reach[sign] for sign in signs], np.float64),
        "sign": np.repeat(np.arange(len(signs)), [len(profile.views[sign]) for sign in signs]).astype(np.int32),
        "views": np.concatenate([np.zeros((0, COUNT)), *profile.views.values()]).astype(np.float32),
        "made": np.array(json.dumps(profile.made, sort_keys=True)),
    }
    try:
        if path.parent == profiles_dir():
            path.parent.mkdir(parents=True, exist_ok=True)
        _FILE.write(path, content)
    except OSError as error:
        raise ProfileError(f"cannot write the profile {path}: {error.strerror}") from None


def load_profile(path: Path) -> Profile:
    """Return the profile in the file ``path``, which may be untrusted: loading executes nothing.

    Raises:
        ProfileError: It cannot be read, is not a profile, is damaged, or has another format.
    """
    return _FILE.read(path, _built, _LARGEST_BYTES)


def _built(arrays: Arrays) -> Profile:
    signs = tuple(str(sign) for sign in arrays["signs"])
    views, of = arrays["views"].astype(np.float64), arrays["sign"]
    reach = arrays["reach"].astype(np.float64)
    if len(set(signs)) < len(signs) or not set(signs) <= set(SIGNS):
        raise ValueError("its signs are not those of handsteer")
    if views.shape != (len(of), COUNT) or of.shape != (len(of),) or reach.shape != (len(signs),):
        raise ValueError("its parts do not fit together")
    if not (np.abs(views) <= _LARGEST_FEATURE).all():
        raise ValueError(f"some of its numbers are beyond {_LARGEST_FEATURE:g}, or none")
    # Bounds, so that no file lets hands far from its views move the robot.
    if not ((reach >= REACH[0]) & (reach <= REACH[1])).all():
        raise ValueError(f"a reach is not from {REACH[0]:g} to {REACH[1]:g}")
    counts = [int((of == number).sum()) for number in range(len(signs))]
    if sum(counts) < len(of) or not all(1 <= count <= MOST_VIEWS for count in counts):
        raise ValueError(f"a sign has no view, or more than {MOST_VIEWS}")
    return Profile(
        profile_name(str(arrays["name"])),
        {sign: views[of == number] for number, sign in enumerate(signs)},
        dict(zip(signs, reach.tolist(), strict=True)),
        dict(json.loads(str(arrays["made"]))),
    )
