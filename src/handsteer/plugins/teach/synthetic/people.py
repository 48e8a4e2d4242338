"""Statistics of people's hand landmarks, and random hands drawn from them.

Hands of one kind (fists, thumbs, ...) are described in *canonical coordinates*: the landmarks in the image and in
space, rotated in the image so that the palm points up, mirrored so that the index finger's knuckle is left of the
little finger's, in palm lengths. In these, they are a mixture of normal distributions, each with its mean, its
principal directions and the residual variance (probabilistic principal component analysis, M. Tipping and C. Bishop, J.
R. Statist. Soc. B 61(3), 1999). So they combine how people hold their fingers with the landmark model's errors. They
contain no person's landmarks: each distribution is computed from :data:`LEAST_HANDS` hands or more.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.plugins.teach.synthetic.hands import FIST, SHAPES, THUMB
from handsteer.plugins.virtual_hand.kinematics import Array, turn_x, turn_y
from handsteer.recognition.features import INDEX_BASE, KNUCKLES, LITTLE_BASE, WRIST
from handsteer.recognition.npz import Arrays, NpzFormat

Random = np.random.Generator

LEAST_HANDS: Final = 30
REST: Final = "rest"
"""The kind of hands without a sign: hanging, resting or holding something."""
COORDINATES: Final = 21 * 2 + 21 * 3
FILE: Final = Path(__file__).parent / "people.npz"
"""The shipped statistics, written by :mod:`handsteer.plugins.teach.synthetic.fit`."""

_WIDER: Final = 1.2
"""Factor on the measured spread, because other people differ more from these people than these among themselves."""
_CHOICES: Final = 24
_THUMB: Final = slice(1, 5)
_TURNED_RAD: Final = np.radians(18.0)
"""Standard deviation of the turn sideways, up or down that is applied to half of the hands, in radians."""

_NPZ: Final = NpzFormat(
    "file of hand statistics", 1, missing=ModelMissing, corrupt=ModelCorrupt, remedy="use the one that is shipped"
)


@dataclass(frozen=True)
class Distribution:
    """A normal distribution of hands in canonical coordinates.

    Attributes:
        kind: What the hands show, such as ``fist``.
        shape: Index into :data:`~handsteer.plugins.teach.synthetic.hands.SHAPES`.
        hands: Number of hands it was fitted to.
        mean: (105,) palm lengths: 21 points in the image (x, y), then 21 in space (x, y, z).
        directions: (k, 105) principal directions, with lengths of one standard deviation.
        rest: (105,) standard deviation of the residuals.
    """

    kind: str
    shape: int
    hands: int
    mean: Array
    directions: Array
    rest: Array

    def draw(self, count: int, random: Random) -> Array:
        """Return (count, 105) random hands."""
        along = random.normal(0, _WIDER, (count, len(self.directions))) @ self.directions
        drawn: Array = self.mean + along + self.rest * random.normal(0, 1, (count, len(self.mean)))
        return drawn


def draw_people(count: int, random: Random, people: tuple[Distribution, ...]) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return about ``count`` hands like people's: each kind equally often, and within a kind as often as measured.

    Returns:
        (n, 21, 2) and (n, 21, 3) landmarks in the image and in space, palm lengths; (n,) indices into ``SHAPES``.
    """
    kinds = sorted({each.kind for each in people})
    totals = {kind: sum(each.hands for each in people if each.kind == kind) for kind in kinds}
    drawn = [(each, each.draw(round(count / len(kinds) * each.hands / totals[each.kind]), random)) for each in people]
    drawn.sort(key=lambda pair: pair[0].kind)
    by_kind = {kind: np.concatenate([hands for each, hands in drawn if each.kind == kind]) for kind in kinds}
    closed = _closed_like(by_kind[THUMB][::2], np.concatenate([by_kind[FIST], by_kind[REST]]), random)
    image, space = _seen_from_elsewhere(*from_canonical(np.concatenate([*by_kind.values(), closed])), random)
    named = [np.full(len(hands), each.shape) for each, hands in drawn] + [np.full(len(closed), SHAPES.index(FIST))]
    return image, space, np.concatenate(named)


def _closed_like(hands: Array, others: Array, random: Random) -> Array:
    """Return (n, 105) hands with their thumb out as fists: each with the thumb of the most similar of ``others``.

    People show their fists to a camera from the front; the backs and sides of closed fingers appear on hands with the
    thumb out, and thumbs along the fingers on the backs of hands at rest.
    """
    image, space = (points.copy() for points in from_canonical(hands))
    choices = random.integers(0, len(others), (len(hands), _CHOICES))
    other_image, other_space = from_canonical(others)
    palm, other_palm = space[:, KNUCKLES] - space[:, [WRIST]], other_space[:, KNUCKLES] - other_space[:, [WRIST]]
    unlike = ((other_palm[choices] - palm[:, None]) ** 2).sum(axis=(2, 3))
    chosen = choices[np.arange(len(hands)), unlike.argmin(axis=1)]
    for points, theirs in ((image, other_image[chosen]), (space, other_space[chosen])):
        points[:, _THUMB] = points[:, [WRIST]] + theirs[:, _THUMB] - theirs[:, [WRIST]]
    return np.concatenate([image.reshape(len(hands), -1), space.reshape(len(hands), -1)], axis=1)


def to_canonical(pixels: Array, world: Array) -> Array:
    """Return the (n, 105) canonical coordinates of n hands.

    Args:
        pixels: (n, 21, 2) landmarks in pixels.
        world: (n, 21, 3) landmarks in metres, with the image's axes.
    """
    space = np.asarray(world - world.mean(axis=1, keepdims=True), np.float64)
    image = np.asarray(pixels - pixels.mean(axis=1, keepdims=True), np.float64)
    flat = (space[..., :2] ** 2).sum(axis=(1, 2), keepdims=True)
    image = image * np.sqrt(flat / np.maximum((image**2).sum(axis=(1, 2), keepdims=True), 1e-12))
    palm = np.linalg.norm(space[:, KNUCKLES] - space[:, [WRIST]], axis=2).mean(axis=1)[:, None, None]
    image, space = image / np.maximum(palm, 1e-6), space / np.maximum(palm, 1e-6)
    up = image[:, KNUCKLES].mean(axis=1) - image[:, WRIST]
    angle = np.arctan2(up[:, 0], -up[:, 1])
    cos, sin = np.cos(angle), np.sin(angle)
    upright = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    image, space[..., :2] = image @ upright, space[..., :2] @ upright
    side = np.where(image[:, LITTLE_BASE, 0] < image[:, INDEX_BASE, 0], -1.0, 1.0)[:, None]
    image[..., 0] *= side
    space[..., 0] *= side
    return np.concatenate([image.reshape(len(image), -1), space.reshape(len(space), -1)], axis=1)


def from_canonical(coordinates: Array) -> tuple[Array, Array]:
    """Return (n, 21, 2) landmarks in the image and (n, 21, 3) in space, palm lengths, of (n, 105) coordinates."""
    return coordinates[:, :42].reshape(-1, 21, 2), coordinates[:, 42:].reshape(-1, 21, 3)


def _seen_from_elsewhere(image: Array, space: Array, random: Random) -> tuple[Array, Array]:
    """Return the hands, half of them turned; their errors in the image stay the same."""
    count = len(space)
    amount = _TURNED_RAD * (random.random((2, count)) < 0.5)
    turned = space @ (turn_x(amount[0] * random.normal(0, 1, count)) @ turn_y(amount[1] * random.normal(0, 1, count)))
    return image - space[..., :2] + turned[..., :2], turned


def save_people(people: tuple[Distribution, ...], path: Path) -> None:
    """Write ``people`` to ``path``, deterministically and rounded to three digits."""
    content = {
        "kinds": np.array([each.kind for each in people]),
        "shapes": np.array([SHAPES[each.shape] for each in people]),
        "hands": np.array([each.hands for each in people]),
        "counts": np.array([len(each.directions) for each in people]),
        "means": np.stack([each.mean for each in people]).astype(np.float16),
        "directions": np.concatenate([each.directions for each in people]).astype(np.float16),
        "rests": np.stack([each.rest for each in people]).astype(np.float16),
    }
    _NPZ.write(path, content)


def load_people(path: Path = FILE) -> tuple[Distribution, ...]:
    """Return the distributions in the file ``path``.

    Raises:
        ModelMissing: It cannot be read.
        ModelCorrupt: It is not such a file, or is damaged.
    """
    return _NPZ.read(path, _built)


def _built(arrays: Arrays) -> tuple[Distribution, ...]:
    ends = np.cumsum(arrays["counts"])
    directions = np.split(arrays["directions"].astype(np.float64), ends[:-1])
    rows = zip(
        arrays["kinds"], arrays["shapes"], arrays["hands"], arrays["means"], directions, arrays["rests"], strict=True
    )
    return tuple(
        Distribution(
            str(kind), SHAPES.index(str(shape)), int(hands), mean.astype(np.float64), along, rest.astype(np.float64)
        )
        for kind, shape, hands, mean, along, rest in rows
    )
