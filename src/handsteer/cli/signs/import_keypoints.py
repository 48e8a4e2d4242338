"""``handsteer signs import``: landmark rows that others have collected."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer.cli.options import Flag
from handsteer.cli.signs.tables import dataset_table
from handsteer.errors import DatasetError
from handsteer.recognition.custom_signs import label_for
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.training.custom.keypoint_csv import read_class_names, read_keypoints


def import_keypoints(
    source: Path,
    /,
    *,
    labels: Annotated[list[str], Parameter(consume_multiple=True)],
    dataset: Path = Path("signs.npz"),
    person: str | None = None,
    not_mirrored: Flag = False,
) -> int:
    """Add landmark rows to a dataset: a CSV file with a class number, then x and y of the 21 landmarks, in each line.

    Example: handsteer signs import keypoint.csv --labels 2=Pointer 3=OK

    The numbers count from the wrist and are divided by the largest of them, as projects that recognise hand signs write
    them. There is no depth in them, so what is learnt with them is learnt from the image alone.

    Parameters
    ----------
    source
        The CSV file; one that ends in .gz is unpacked.
    labels
        The sign of each class, as 3=OK; other classes are left out. Or a file with the name of class 0 in its first
        line, and so on.
    dataset
        File that the rows are added to; it is made when it is not there.
    person
        Who showed them; by default the name of the file.
    not_mirrored
        The rows come from images as the camera saw them; such projects usually mirror them first.
    """
    known = load_dataset(dataset) if dataset.exists() else Dataset()
    names = {number: label_for(name, known.labels) for number, name in _names(labels).items()}
    takes = read_keypoints(source, names, person or source.name.split(".")[0], mirrored=not not_mirrored)
    known = known.with_takes(takes)
    save_dataset(known, dataset)
    print(dataset_table(known))
    return 0


def _names(labels: list[str]) -> dict[str, str]:
    if len(labels) == 1 and "=" not in labels[0]:
        return read_class_names(Path(labels[0]))
    names: dict[str, str] = {}
    for pair in labels:
        number, equals, name = pair.partition("=")
        if not equals or not number.strip() or not name.strip() or number.strip() in names:
            raise DatasetError(f"--labels: {pair!r} should be the number of a class and its sign, each once, as 3=OK")
        names[number.strip()] = name.strip()
    return names
