"""Exchanges takes with other people and programs: shared files, tables, and rows of keypoints.

A shared file has takes and model together, and is both a dataset and a model: ``handsteer run --signs.model`` and
``handsteer signs train`` read it too.

Rows of keypoints are the format of several hand sign projects: a class number, then 42 numbers. The numbers are x and y
of the 21 landmarks in the *mirrored* image, relative to the wrist, divided by the largest absolute value among them.
Size, position and depth are lost.
"""

import csv
import gzip
import io
import itertools
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, Final, TextIO, cast

import numpy as np

from handsteer.errors import DatasetError, reason_of
from handsteer.plugins.teach.dataset import Dataset, Take, dataset_arrays, dataset_from
from handsteer.recognition.custom_signs import CustomModel, model_arrays, model_from
from handsteer.recognition.hand import Hand
from handsteer.recognition.npz import Arrays, NpzFormat
from handsteer.regular_files import open_regular

LARGEST_SHARED_BYTES: Final = 24_000_000
"""Maximum size of a shared file: some 40 000 hands, which are 400 takes of three seconds."""

_FILE: Final = NpzFormat(
    "file of taught signs",
    1,
    missing=DatasetError,
    corrupt=DatasetError,
    remedy="give a file that was downloaded under Teach, or one of `handsteer signs`",
)
_RISKY: Final = ("=", "+", "-", "@", "\t", "\r")

_COLUMNS: Final = 43
_LONGEST_TAKE: Final = 100
_LONGEST_LINE: Final = 10_000
_MOST_ROWS: Final = 1_000_000
_SIZE_PX: Final = 240
_FARTHEST: Final = 1.001  # allows for rounding in the files


def save_shared(path: Path, dataset: Dataset, model: CustomModel | None) -> None:
    """Write ``dataset`` and ``model`` to one file.

    Raises:
        DatasetError: It cannot be written.
    """
    try:
        _FILE.write(path, dataset_arrays(dataset) | (model_arrays(model) if model is not None else {}))
    except OSError as error:
        raise DatasetError(f"cannot write {path}: {error.strerror}") from None


def load_shared(path: Path) -> tuple[Dataset, CustomModel | None]:
    """Return the takes and the model in the file ``path``, which may be untrusted: loading executes nothing.

    A dataset has no model, and a model no takes.

    Raises:
        DatasetError: It cannot be read, is too large, is damaged, or contains neither.
    """
    return _FILE.read(path, _built, LARGEST_SHARED_BYTES)


def _built(arrays: Arrays) -> tuple[Dataset, CustomModel | None]:
    dataset = dataset_from(arrays) if "takes" in arrays else Dataset()
    model = model_from(arrays) if "taught" in arrays else None
    if not dataset.takes and model is None:
        raise ValueError("there is neither a take nor a model in it")
    return dataset, model


def takes_as_csv(dataset: Dataset) -> Iterator[str]:
    """Yield the parts of a table with a row for each hand of ``dataset``: its head, then each take.

    Landmarks are ``x0`` to ``z20``, image-normalised as in the dataset's file; an unknown depth is ``nan``.
    """
    names = [f"{axis}{joint}" for joint in range(21) for axis in "xyz"]
    yield _line(["label", "person", "session", "take", "time_s", "handedness", "width", "height", *names])
    for number, take in enumerate(dataset.takes):
        facts = [_text(take.label), _text(take.person), _text(take.session), number]
        yield "".join(
            _line([*facts, f"{time_s:.3f}", hand.handedness, *hand.image_size, *_landmarks(hand)])
            for hand, time_s in zip(take.hands, take.times_s, strict=True)
        )


def _landmarks(hand: Hand) -> list[str]:
    return [f"{value:.6g}" for value in hand.points.ravel().tolist()]


def _text(words: str) -> str:
    """Return ``words``, which a spreadsheet must not take for a formula."""
    return f"'{words}" if words.startswith(_RISKY) else words


def _line(cells: list[object]) -> str:
    line = io.StringIO()
    csv.writer(line).writerow(cells)
    return line.getvalue()


def read_keypoints(
    path: Path, labels: Mapping[str, str], person: str, *, mirrored: bool = True, needs_all: bool = False
) -> list[Take]:
    """Return the takes in a file of keypoints, which may be compressed with gzip (``.gz``).

    Such files do not mark takes: up to 100 consecutive rows of one class form one.

    Args:
        path: The file.
        labels: The sign of each class; rows of other classes are left out.
        person: The person who showed them.
        mirrored: Whether the rows come from mirrored images, as is usual.
        needs_all: Whether each of these classes must have a row; otherwise, one of them must.

    Raises:
        DatasetError: The file cannot be read, a row in it is wrong, or there is no row of these classes.
    """
    session = path.name.split(".")[0]
    found = [
        (number, Take(labels[number], person, session, path.name, hands, (0.0,) * len(hands)))
        for number, group in itertools.groupby(_rows(path, mirrored=mirrored), key=lambda row: row[0])
        if number in labels
        for hands in _parts(hand for _, hand in group)
    ]
    present = {number for number, _ in found}
    missing = [number for number in labels if number not in present]
    if missing and (needs_all or not found):
        raise DatasetError(f"{path}: there is no row of class {', '.join(missing)}")
    return [take for _, take in found]


def read_class_names(path: Path) -> dict[str, str]:
    """Return the sign of each class from a file that lists their names, one per line, from class 0 on.

    Raises:
        DatasetError: The file cannot be read, or a line is empty.
    """
    try:
        with io.TextIOWrapper(open_regular(path), "utf-8-sig") as file:
            names = file.read(_LONGEST_LINE).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"cannot read the names of the classes {path}: {reason_of(error)}") from None
    if not names or not all(name.strip() for name in names):
        raise DatasetError(f"{path}: expected the name of one class per line, found an empty line")
    return {str(number): name.strip() for number, name in enumerate(names)}


def _parts(hands: Iterable[Hand]) -> Iterator[tuple[Hand, ...]]:
    rest = iter(hands)
    while part := tuple(itertools.islice(rest, _LONGEST_TAKE)):
        yield part


def _rows(path: Path, *, mirrored: bool) -> Iterator[tuple[str, Hand]]:
    try:
        with open_regular(path) as content, _lines_of(content, path.suffix) as file:
            for number, row in enumerate(csv.reader(_lines(file, path)), start=1):
                if row:
                    yield row[0].strip(), _hand(row, f"{path}, line {number}", mirrored=mirrored)
    except (OSError, EOFError, UnicodeDecodeError, csv.Error, zlib.error) as error:
        raise DatasetError(f"cannot read the keypoints {path}: {reason_of(error)}") from None


def _lines_of(content: BinaryIO, suffix: str) -> TextIO:
    plain = gzip.GzipFile(fileobj=content) if suffix == ".gz" else content
    return io.TextIOWrapper(cast(BinaryIO, plain), "utf-8-sig", newline="")


def _lines(file: TextIO, path: Path) -> Iterator[str]:
    """Yield the lines of ``file``, with a limit on its decompressed size."""
    for _ in range(_MOST_ROWS):
        line = file.readline(_LONGEST_LINE)
        if not line:
            return
        if len(line) == _LONGEST_LINE:
            raise DatasetError(f"{path}: a line has more than {_LONGEST_LINE} characters; 43 fields need fewer")
        yield line
    raise DatasetError(f"{path}: has more than {_MOST_ROWS} lines")


def _hand(row: list[str], where: str, *, mirrored: bool) -> Hand:
    if len(row) != _COLUMNS:
        raise DatasetError(f"{where}: expected a class and 42 numbers, found {len(row)} fields")
    try:
        points = np.array([float(number) for number in row[1:]]).reshape(21, 2)
    except ValueError as error:
        raise DatasetError(f"{where}: expected a class and 42 numbers, {str(error)[:80]}") from None
    if not np.isfinite(points).all() or np.abs(points).max() > _FARTHEST or not np.ptp(points, axis=0).any():
        raise DatasetError(f"{where}: these are not the landmarks of a hand, relative to its wrist and up to 1")
    if mirrored:
        points[:, 0] *= -1
    unknown = np.full((21, 3), np.nan, np.float32)
    flat = unknown.copy()
    flat[:, :2] = points
    # Handedness and size are not recorded.
    return Hand(flat, unknown, "Right", handedness_score=0.5, presence=1.0, image_size=(_SIZE_PX, _SIZE_PX))
