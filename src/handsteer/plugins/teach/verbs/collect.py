"""``handsteer signs collect`` and ``import``: examples of a sign to be learnt."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Flag, Parameters, Whole, loads
from handsteer.cli.running import check_writable, settings
from handsteer.errors import DatasetError

# Some tables have all numbers with decimals.
_NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?")


@Parameter(name="*")
@dataclass(frozen=True)
class Takes:
    """How takes are recorded from a camera.

    Parameters
    ----------
    takes
        Number of takes; a recording is used as a whole.
    take_time
        Duration of each take, in seconds.
    countdown
        Countdown before each take, in seconds.
    hold
        Record while the space key is held, without a countdown.
    """

    takes: Whole = 5
    take_time: float = 3.0
    countdown: float = 3.0
    hold: Flag = False

    def check(self) -> None:
        """Raise a DatasetError for a value beyond its range."""
        if not 1 <= self.takes <= 1000:
            raise DatasetError(f"--takes: {self.takes} should be from 1 to 1000")
        if not 0.2 <= self.take_time <= 60:
            raise DatasetError(f"--take-time: {self.take_time:g} should be from 0.2 to 60 seconds")
        if not 0 <= self.countdown <= 60:
            raise DatasetError(f"--countdown: {self.countdown:g} should be from 0 to 60 seconds")


@Parameter(name="*")
@dataclass(frozen=True)
class Moments:
    """Parts of a recording that become takes.

    Parameters
    ----------
    from_
        Recording of a drive: each moment that --at names becomes a take.
    at
        Times in the recording, in seconds since it began, as `handsteer replay` and `report` print them: 12.4, which
        takes half a second around it, or 12.4-13.0.
    """

    from_: Annotated[Path | None, Parameter(name="--from")] = None
    at: Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")] = None

    def check(self) -> None:
        """Raise a DatasetError if one was given without the other, or without a value."""
        if (self.from_ is None) != (self.at is None):
            raise DatasetError("--from needs --at and --at needs --from: a recording, and its moments in seconds")
        if self.at is not None and not self.at:
            raise DatasetError("--at needs a value: the seconds of each moment, as in --at 12.4")


@loads("handsteer.plugins.teach.verbs.collecting")
def collect(
    *,
    label: str | None = None,
    dataset: Path = Path("signs.npz"),
    camera: str | None = None,
    person: str = "me",
    session: str | None = None,
    takes: Takes = Takes(),
    moments: Moments = Moments(),
    undo: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Collect examples (takes) of a new sign, from a camera or a recording.

    For example:
      handsteer signs collect --label Hi
      handsteer signs collect --label Hi --camera photos/
      handsteer signs collect --label Hi --from drive.mcap --at 12.4
      handsteer signs collect --undo

    A countdown precedes each take, and each is saved as soon as it ends.
    In the terminal, u undoes the last take and q ends.
    Show the sign as you will when driving, and move the hand a little: nearer,
    farther, tilted. With the label NONE, collect hands that show no sign.

    Parameters
    ----------
    label
        Name of the sign, such as Hi.
    dataset
        File to add the takes to; created if missing.
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address, a video file or a folder of photos. A video is
        divided into takes; each photo is a take.
    person
        Who shows it. With several persons, the signs are tested on persons that they were not learnt from.
    session
        Name of the session; by default the date and time.
    undo
        Remove the last take from the file.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
    """
    from handsteer.plugins.teach.verbs.collecting import Plan, collect_takes, undo_last

    config = settings(config_file, parameters, {"camera": {"source": camera}})
    if undo:
        if label is not None:
            raise DatasetError("--undo removes the last take, whatever its sign: leave out --label")
        undo_last(dataset)
        return 0
    if label is None:
        raise DatasetError("--label is missing: name the sign, as in --label Hi")
    moments.check()
    takes.check()
    check_writable("--dataset", dataset, DatasetError)
    plan = Plan(label, dataset, person, session, takes.takes, takes.take_time, takes.countdown, hold=takes.hold)
    collect_takes(config, plan, moments.from_, moments.at or [])
    return 0


@loads("handsteer.plugins.teach.verbs.collecting", "handsteer.plugins.teach.exchange")
def import_keypoints(
    source: Path,
    /,
    *,
    labels: Annotated[list[str], Parameter(consume_multiple=True, negative="")],
    dataset: Path = Path("signs.npz"),
    person: str | None = None,
    not_mirrored: Flag = False,
) -> int:
    """Add rows of landmarks to a dataset, from a CSV file: a class number, then x and y of the 21 landmarks.

    For example:
      handsteer signs import keypoint.csv --labels 2=Pointer 3=OK
      handsteer signs import keypoint.csv --labels names.csv

    Coordinates are relative to the wrist and divided by the largest of them, as
    several hand sign projects write them. They have no depth, so signs learnt
    with them use the image coordinates only.

    Parameters
    ----------
    source
        CSV file, or gzipped (.csv.gz).
    labels
        The sign of each class, as 3=OK; other classes are skipped, and each of these needs a row. Or a file
        with one name per line, from class 0; classes without a row are skipped.
    dataset
        File to add the rows to; created if missing.
    person
        Who showed them; by default the name of the file.
    not_mirrored
        The rows come from unmirrored images; most such projects mirror them first.
    """
    from handsteer.plugins.teach.dataset import Dataset, add_takes, load_dataset
    from handsteer.plugins.teach.exchange import read_class_names, read_keypoints
    from handsteer.plugins.teach.verbs.tables import dataset_table
    from handsteer.recognition.custom_signs import label_for

    if not labels:
        raise DatasetError("--labels needs a value: the number of a class and its sign, as in --labels 3=OK")
    check_writable("--dataset", dataset, DatasetError)
    known = load_dataset(dataset) if dataset.exists() else Dataset()
    listed = len(labels) == 1 and "=" not in labels[0]
    given = read_class_names(Path(labels[0])) if listed else _names(labels)
    names = {number: label_for(name, known.labels) for number, name in given.items()}
    person = person or source.name.split(".")[0]
    # A file lists all classes of a project, some without rows here; what is typed is meant.
    takes = read_keypoints(source, names, person, mirrored=not not_mirrored, needs_all=not listed)
    print(dataset_table(add_takes(takes, dataset)))
    return 0


def _names(labels: list[str]) -> dict[str, str]:
    names: dict[str, str] = {}
    for pair in labels:
        number, equals, name = pair.partition("=")
        if not equals or not _NUMBER.fullmatch(number.strip()) or not name.strip() or number.strip() in names:
            raise DatasetError(f"--labels: {pair!r} should be the number of a class and its sign, each once, as 3=OK")
        names[number.strip()] = name.strip()
    return names
