"""One file to share taught signs: takes and model together; and the takes as a table for other programs.

Such a file is both a dataset and a model: ``handsteer run --signs.model`` and ``handsteer signs train`` read it too.
"""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from handsteer.errors import DatasetError
from handsteer.recognition.custom_signs import CustomModel, model_arrays, model_from
from handsteer.recognition.hand import Hand
from handsteer.recognition.npz import Arrays, NpzFormat
from handsteer.training.custom.dataset import Dataset, dataset_arrays, dataset_from

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
