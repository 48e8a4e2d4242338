"""The dataset file for teaching signs: raw landmarks with labels and persons, described in ``docs/dataset.md``."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import DatasetError
from handsteer.recognition.custom_signs import is_label
from handsteer.recognition.hand import Hand
from handsteer.recognition.npz import Arrays, NpzFormat

FORMAT: Final = 1
"""Version of the file format."""

_FILE: Final = NpzFormat(
    "dataset of signs",
    FORMAT,
    missing=DatasetError,
    corrupt=DatasetError,
    remedy="give a file that `handsteer signs collect` or `handsteer signs import` has written",
)
# A hand may be partly outside the picture, and nearer than it looks.
_LARGEST_PX: Final = 65_535
_FARTHEST_PX: Final = 4 * _LARGEST_PX
_FARTHEST_M: Final = 10.0
_LONGEST_S: Final = 1e7

_FACTS: Final = ("label", "person", "session", "source")


@dataclass(frozen=True, eq=False)
class Take:
    """A sign shown by one person without a break.

    Attributes:
        label: The sign.
        person: The person who showed it.
        session: Time or place: takes of one session are similar.
        source: Origin of the frames.
        hands: The hand in each frame with one, as the landmark model reported it.
        times_s: (n,) seconds since the first.
    """

    label: str
    person: str
    session: str
    source: str
    hands: tuple[Hand, ...]
    times_s: tuple[float, ...]

    @property
    def is_flat(self) -> bool:
        """Whether the landmarks have no depth, as imported ones do."""
        return not all(np.isfinite(hand.world).all() for hand in self.hands)

    @cached_property
    def pixels(self) -> NDArray[np.float64]:
        """(n, 21, 2) landmarks in pixels."""
        return np.array([hand.pixels[:, :2] for hand in self.hands], np.float64).reshape(-1, 21, 2)

    @cached_property
    def world(self) -> NDArray[np.float64]:
        """(n, 21, 3) landmarks in metres; NaN if the take is flat."""
        return np.array([hand.world for hand in self.hands], np.float64).reshape(-1, 21, 3)


@dataclass(frozen=True)
class Dataset:
    """Takes in the order in which they were added.

    Attributes:
        takes: The takes.
        disabled: Labels of signs that are not to be learnt; their takes are kept.
    """

    takes: tuple[Take, ...] = ()
    disabled: frozenset[str] = frozenset()

    @property
    def labels(self) -> tuple[str, ...]:
        """Its signs, in order of first occurrence."""
        return tuple(dict.fromkeys(take.label for take in self.takes))

    def of(self, label: str) -> tuple[Take, ...]:
        """Return the takes of ``label``."""
        return tuple(take for take in self.takes if take.label == label)

    def with_takes(self, takes: Iterable[Take]) -> "Dataset":
        """Return this dataset with ``takes`` added."""
        return Dataset((*self.takes, *takes), self.disabled)

    def without_last(self) -> "Dataset":
        """Return this dataset without its last take.

        Raises:
            DatasetError: It is empty.
        """
        if not self.takes:
            raise DatasetError("there is no take to undo")
        return Dataset(self.takes[:-1], self.disabled)


def load_dataset(path: Path) -> Dataset:
    """Return the dataset in the file ``path``, which may be untrusted: loading executes nothing.

    Raises:
        DatasetError: It cannot be read, is damaged, or has another version.
    """
    return _FILE.read(path, dataset_from)


def add_takes(takes: Iterable[Take], path: Path) -> Dataset:
    """Add ``takes`` to the file ``path``, which another program may have changed, or which may not exist; return it.

    Raises:
        DatasetError: It cannot be read or written.
    """
    known = (load_dataset(path) if path.exists() else Dataset()).with_takes(takes)
    save_dataset(known, path)
    return known


def save_dataset(dataset: Dataset, path: Path) -> None:
    """Write ``dataset`` to ``path`` atomically: an older file exists until the new one does.

    Raises:
        DatasetError: It cannot be written.
    """
    try:
        _FILE.write(path, dataset_arrays(dataset))
    except OSError as error:
        raise DatasetError(f"cannot write the dataset {path}: {error.strerror}") from None


def dataset_arrays(dataset: Dataset) -> Arrays:
    """Return the arrays of the file of ``dataset``, without its format."""
    hands = [hand for take in dataset.takes for hand in take.hands]
    facts = [{name: getattr(take, name) for name in _FACTS} for take in dataset.takes]
    disabled = {"disabled": np.array(sorted(dataset.disabled))} if dataset.disabled else {}
    return disabled | {
        "takes": np.array(json.dumps(facts, ensure_ascii=False)),
        "take": np.repeat(np.arange(len(facts)), [len(take.hands) for take in dataset.takes]).astype(np.int32),
        "time_s": np.array([time_s for take in dataset.takes for time_s in take.times_s], np.float32),
        "points": _stacked([hand.points for hand in hands]),
        "world": _stacked([hand.world for hand in hands]),
        "handedness": np.array([hand.handedness for hand in hands], "<U5"),
        "handedness_score": np.array([hand.handedness_score for hand in hands], np.float32),
        "presence": np.array([hand.presence for hand in hands], np.float32),
        "image_size": np.array([hand.image_size for hand in hands], np.int32).reshape(-1, 2),
    }


def dataset_from(arrays: Arrays) -> Dataset:
    """Return the dataset of the arrays of an untrusted file; errors of many types are raised for damaged ones."""
    disabled = frozenset(str(label) for label in arrays.get("disabled", ()))
    if not all(map(is_label, disabled)):
        raise ValueError("a disabled sign is not named as signs are")
    return Dataset(tuple(_takes(arrays)), disabled)


def typical_hand(hands: Sequence[Hand], *, sided: bool = False) -> int:
    """Return the index of the hand of ``hands`` that is nearest to their mean shape in the image.

    Args:
        hands: At least one.
        sided: Whether left hands are to be compared as they are, instead of mirrored.
    """
    points = np.array([hand.pixels[:, :2] for hand in hands], np.float64)
    if not sided:
        points[[hand.handedness == "Left" for hand in hands], :, 0] *= -1
    points -= points.mean(axis=1, keepdims=True)
    points /= np.maximum(np.linalg.norm(points, axis=(1, 2), keepdims=True), 1e-9)
    return int(np.linalg.norm(points - points.mean(axis=0), axis=(1, 2)).argmin())


def _stacked(points: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return np.array(points, np.float32).reshape(-1, 21, 3)


def _takes(arrays: Arrays) -> Iterable[Take]:
    facts = json.loads(str(arrays["takes"]))
    hands = _hands(arrays)
    rows, times_s = arrays["take"], arrays["time_s"].astype(float)
    if not (rows.shape == times_s.shape == (len(hands),)) or (
        len(hands) and not 0 <= rows.min() <= rows.max() < len(facts)
    ):
        raise ValueError("its takes and rows do not fit together")
    order = np.argsort(rows, kind="stable")
    bounds = np.searchsorted(rows[order], np.arange(len(facts) + 1))
    for number, fact in enumerate(facts):
        mine = order[bounds[number] : bounds[number + 1]]
        named = {name: str(fact[name]) for name in _FACTS}
        if not is_label(named["label"]):
            raise ValueError(f"take {number} has the label {named['label']!r}")
        yield Take(**named, hands=tuple(hands[row] for row in mine), times_s=tuple(times_s[mine].tolist()))


def _hands(arrays: Arrays) -> list[Hand]:
    points, world = arrays["points"].astype(np.float32), arrays["world"].astype(np.float32)
    sizes, handedness = arrays["image_size"], arrays["handedness"]
    count = len(points)
    fits = (
        points.shape == world.shape == (count, 21, 3)
        and sizes.shape == (count, 2)
        and all(arrays[name].shape == (count,) for name in ("handedness", "handedness_score", "presence"))
    )
    if not fits:
        raise ValueError("its arrays do not fit together")
    if not set(handedness.tolist()) <= {"Left", "Right"}:
        raise ValueError("a handedness is neither Left nor Right")
    _check_range("points", points, _FARTHEST_PX)
    _check_range("world", world, _FARTHEST_M)
    _check_range("image_size", sizes, _LARGEST_PX, lowest=1)
    for name, highest in (("handedness_score", 1.0), ("presence", 1.0), ("time_s", _LONGEST_S)):
        _check_range(name, arrays[name], highest, lowest=0)
    if not np.isfinite(points[..., :2]).all():
        raise ValueError("some of its landmarks are not finite")
    return [
        Hand(
            points=points[row],
            world=world[row],
            handedness="Left" if handedness[row] == "Left" else "Right",
            handedness_score=float(arrays["handedness_score"][row]),
            presence=float(arrays["presence"][row]),
            image_size=(int(sizes[row, 0]), int(sizes[row, 1])),
        )
        for row in range(count)
    ]


def _check_range(name: str, values: NDArray[Any], highest: float, lowest: float | None = None) -> None:
    """Raise for values that no camera produces, and with which training would not end; unknown ones are NaN."""
    low = -highest if lowest is None else lowest
    if (values < low).any() or (values > highest).any():
        raise ValueError(f"some of its {name} are not from {low:g} to {highest:g}")


@dataclass(frozen=True)
class LabelSummary:
    """The amount of data of one sign in a dataset."""

    label: str
    takes: int
    rows: int
    persons: int
    sessions: int


def summarise(dataset: Dataset) -> list[LabelSummary]:
    """Return the amount of data of each sign."""
    return [
        LabelSummary(
            label=label,
            takes=len(takes),
            rows=sum(len(take.hands) for take in takes),
            persons=len({take.person for take in takes}),
            sessions=len({(take.person, take.session) for take in takes}),
        )
        for label in dataset.labels
        for takes in [dataset.of(label)]
    ]
