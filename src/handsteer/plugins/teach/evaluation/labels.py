"""Reads the labels of photos and videos."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from handsteer.cameras.files import PHOTO_SUFFIXES
from handsteer.errors import LabelError, reason_of
from handsteer.regular_files import open_regular
from handsteer.types import NONE, find_sign

INDEX = "index.csv"
NEGATIVES = "negatives"
UNSCORED = "ambiguous"


@dataclass(frozen=True)
class LabelledPhoto:
    """A photo and its label.

    Attributes:
        path: The file.
        truth: The correct sign, or ``NONE``; None if it is not to be scored.
        kind: A further description, such as ``thumb_up`` for a hand that is not a sign; may be empty.
        person_set: The person, or the set of photos; may be empty.
    """

    path: Path
    truth: str | None
    kind: str = ""
    person_set: str = ""


_LARGEST_BYTES = 100_000_000


def read_photo_labels(folder: Path, signs: Sequence[str]) -> list[LabelledPhoto]:
    """Return the photos of ``folder`` with their labels, which are ``NONE`` or of ``signs``.

    The folder has an ``index.csv`` with the columns ``path`` (relative to the folder) and ``sign`` (empty: not scored),
    and optionally ``kind`` and ``person_set``; or a subfolder for each sign. Photos under ``negatives`` show no sign,
    and their subfolder is their kind; photos under ``ambiguous`` are not scored. Names may be in any case, with spaces,
    ``_``, ``-`` or nothing between words.

    Raises:
        LabelError: The folder or a photo does not exist, a sign is unknown, or there are no labels or nothing to score.
    """
    if not folder.is_dir():
        raise LabelError(f"there is no folder {folder}: give a folder of labelled photos or a video")
    index = folder / INDEX
    photos = _from_index(index, signs) if index.is_file() else _from_subfolders(folder, signs)
    if not any(photo.truth for photo in photos):
        raise LabelError(f"{folder}: there is no photo to score; expected at least one with a sign or NONE")
    return photos


def read_video_labels(video: Path, signs: Sequence[str]) -> dict[int, str] | None:
    """Return the sign of each frame of ``video``, by number from 0; None if there is no labels file.

    The labels file has the video's name with the suffix ``.labels.csv``, and the columns ``frame`` and ``sign``. Frames
    without a line, or with an empty sign, are left out.

    Raises:
        LabelError: The file cannot be read, or a line in it is wrong.
    """
    path = labels_of(video)
    if not path.is_file():
        return None
    truths: dict[int, str] = {}
    for where, row in _rows(path, ("frame", "sign")):
        if not row["frame"].isdecimal() or int(row["frame"]) in truths:
            raise LabelError(f"{where}: expected the number of a frame, each once, found {row['frame'][:60]!r}")
        truth = _truth(row["sign"], signs, where)
        if truth is not None:
            truths[int(row["frame"])] = truth
    if not truths:
        raise LabelError(f"{path}: there is no frame with a sign or NONE")
    return truths


def labels_of(video: Path) -> Path:
    """Return the path of the labels of ``video``: its name with the suffix ``.labels.csv``."""
    return video.with_name(f"{video.stem}.labels.csv")


def _from_index(index: Path, signs: Sequence[str]) -> list[LabelledPhoto]:
    photos = []
    for where, row in _rows(index, ("path", "sign")):
        path = index.parent / row["path"]
        truth = _truth(row["sign"], signs, where)
        if truth is not None and not path.is_file():
            raise LabelError(f"{where}: there is no photo {_shown(str(path))}")
        kind = row.get("kind") or _kind_of(Path(row["path"]))
        photos.append(LabelledPhoto(path, truth, kind, row.get("person_set", "")))
    return photos


def _from_subfolders(folder: Path, signs: Sequence[str]) -> list[LabelledPhoto]:
    photos = []
    for path in sorted(file for file in folder.rglob("*") if file.suffix.lower() in PHOTO_SUFFIXES):
        below = path.relative_to(folder)
        if len(below.parts) == 1:
            raise LabelError(
                f"{folder}: no label for {below}; put it into a subfolder named as its sign, or in {INDEX}"
            )
        name = below.parts[0].lower()
        if name == UNSCORED:
            truth = None
        else:
            truth = NONE if name == NEGATIVES else _truth(name, signs, f"folder {folder / below.parts[0]}")
        photos.append(LabelledPhoto(path, truth, _kind_of(below)))
    if not photos:
        raise LabelError(
            f"{folder}: no labels; expected an {INDEX}, or subfolders of photos such as stop and {NEGATIVES}"
        )
    return photos


def _kind_of(below: Path) -> str:
    is_negative = below.parts[:1] != () and below.parts[0].lower() == NEGATIVES
    return below.parts[1] if is_negative and len(below.parts) > 2 else ""


def _truth(name: str, signs: Sequence[str], where: str) -> str | None:
    if not name:
        return None
    sign = find_sign(name, (*signs, NONE))
    if sign is None:
        raise LabelError(f"{where}: there is no sign {name[:60]!r}; the signs are {', '.join((*signs, NONE))}")
    return sign


def _rows(path: Path, needed: tuple[str, ...]) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield each line of a CSV file: its place, for messages, and its fields without surrounding spaces."""
    try:
        with io.TextIOWrapper(open_regular(path, _LARGEST_BYTES), "utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            missing = [column for column in needed if column not in (reader.fieldnames or ())]
            if missing:
                raise LabelError(f"{path}, line 1: expected the columns {', '.join(needed)}; {missing[0]} is missing")
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                if any(row[column] is None for column in needed):
                    raise LabelError(f"{where}: expected {len(needed)} or more fields")
                yield where, {name: (value or "").strip() for name, value in row.items() if isinstance(name, str)}
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise LabelError(f"cannot read the labels {path}: {reason_of(error)}") from None


def _shown(path: str) -> str:
    return path if path.isprintable() else repr(path)
