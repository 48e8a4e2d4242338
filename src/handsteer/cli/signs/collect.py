"""``handsteer signs collect`` and ``import``: examples of a sign to be learnt."""

import datetime
import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from handsteer.cameras.choose import open_camera
from handsteer.cli.app import ConfigFile, Flag, Parameters
from handsteer.cli.running import say, settings
from handsteer.cli.signs.tables import dataset_table
from handsteer.cli.terminal import Keys, TerminalPicture
from handsteer.clock import RealClock
from handsteer.config import Config, TeachConfig
from handsteer.errors import DatasetError
from handsteer.recognition.custom_signs import label_for
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import draw_hand, open_landmarker
from handsteer.training.custom.collect import Collector, Facts, Status, collect_live, collect_moment, collect_recorded
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.training.custom.keypoint_csv import read_class_names, read_keypoints

_DEFAULTS = TeachConfig()
_AROUND_S = 0.25


def collect(
    *,
    label: str | None = None,
    dataset: Path = _DEFAULTS.dataset,
    camera: str | None = None,
    person: str = "me",
    session: str | None = None,
    takes: int = _DEFAULTS.takes,
    take_time: float = _DEFAULTS.take_time,
    countdown: float = _DEFAULTS.countdown,
    from_: Annotated[Path | None, Parameter(name="--from")] = None,
    at: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    hold: Flag = False,
    undo: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Collect examples (takes) of a new sign, from a camera or a recording.

    Example: handsteer signs collect --label Hi

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
    takes
        Number of takes; a recording is used as a whole.
    take_time
        Duration of each take, in seconds.
    countdown
        Countdown before each take, in seconds.
    from_
        Recording of a drive: each moment that --at names becomes a take.
    at
        Times in the recording, in seconds since it began, as `handsteer replay` and `report` print them: 12.4, which
        takes half a second around it, or 12.4-13.0.
    hold
        Record while the space key is held, without a countdown.
    undo
        Remove the last take from the file.
    config_file
        YAML file with parameters; options override it.
    """
    config = settings(config_file, parameters, {"camera": {"source": camera}})
    known = load_dataset(dataset) if dataset.exists() else Dataset()
    if undo:
        gone = known.takes[-1:]
        save_dataset(known.without_last(), dataset)
        say(f"removed the last take: {len(gone[0].hands)} hands of {gone[0].label}")
        print(dataset_table(known.without_last()))
        return 0
    if label is None:
        raise DatasetError("--label is missing: name the sign, as in --label Hi")
    _check(takes, take_time, countdown, dataset)
    when = session or f"{datetime.datetime.now():%Y-%m-%d %H:%M}"
    facts = Facts(label_for(label, known.labels), person, when, _source_name(config.camera.source))
    if (from_ is None) != (at is None):
        raise DatasetError("--from needs --at and --at needs --from: a recording, and its moments in seconds")
    recorded = Path(config.camera.source).expanduser()
    if from_ is not None and at is not None:
        moments = [_part(word) for word in at]
        facts = replace(facts, source=from_.name)
        landmarker = open_landmarker(config)
        takes_of_moments = [collect_moment(from_, landmarker, facts, *moment) for moment in moments]
        known = known.with_takes(takes_of_moments)
        save_dataset(known, dataset)
    elif recorded.exists() and not recorded.is_char_device():
        new = collect_recorded(recorded, open_landmarker(config), facts, take_time)
        known = known.with_takes(new)
        save_dataset(known, dataset)
    else:
        if hold and not Keys.possible():
            raise DatasetError("--hold needs a terminal to read keys from; without it, a countdown starts each take")
        collector = Collector(facts, takes=takes, take_s=take_time, countdown_s=countdown, hold=hold)
        known = _live(config, collector, known, dataset, facts.label)
    print(dataset_table(known))
    return 0


def _live(config: Config, collector: Collector, known: Dataset, path: Path, label: str) -> Dataset:
    clock = RealClock()
    landmarker = open_landmarker(config)
    camera = open_camera(config.camera, config.virtual_hand, clock)
    view = _View(label)
    began = len(known.takes)
    try:
        with Keys() as keys:

            def show(image: NDArray[np.uint8], hand: Hand | None, status: Status) -> None:
                nonlocal known
                if keys.pressed("q"):
                    raise KeyboardInterrupt
                if keys.pressed("u") and len(known.takes) > began:
                    known = known.without_last()
                    save_dataset(known, path)
                    collector.again()
                view.show(image, hand, status, len(known.takes) - began)

            for take in collect_live(camera, landmarker, collector, clock, show=show, key_age=keys.space_age_s):
                known = known.with_takes([take])
                save_dataset(known, path)
    except KeyboardInterrupt:
        say("ended; the takes so far are in the file")
    finally:
        camera.close()
    return known


class _View:
    """Shows the progress of collecting: a picture in a terminal, otherwise a line for each change."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._picture = TerminalPicture() if TerminalPicture.possible() else None
        self._last = ""

    def show(self, image: NDArray[np.uint8], hand: Hand | None, status: Status, takes: int) -> None:
        if self._picture is not None:
            help_text = "u undoes the last take, q ends" if Keys.possible() else ""
            self._picture.draw(
                draw_hand(image, hand), _sentence(status, self._label, hand), f"takes: {takes}  {help_text}"
            )
        elif status.phase != self._last or status.finished or status.failed:
            say(_sentence(status, self._label, hand))
        self._last = status.phase


def _sentence(status: Status, label: str, hand: Hand | None) -> str:
    seen = "" if hand else " - no hand is in view"
    if status.failed:
        return "too few hands were seen: this take is repeated"
    if status.finished:
        return f"take finished: {len(status.finished.hands)} hands"
    return {
        "ready": f"hold the space key while you show {label}{seen}",
        "countdown": f"show {label} in {math.ceil(status.left_s)} s{seen}",
        "recording": f"recording {label}: {status.hands} hands{seen}",
        "done": "all takes are done",
    }[status.phase]


def _part(word: str) -> tuple[float, float]:
    """Return begin and end of the part of a recording that ``word`` names: ``12.4`` or ``12.4-13.0``."""
    begin, dash, end = word.partition("-")
    try:
        begin_s, end_s = float(begin), float(end) if dash else float(begin)
    except ValueError:
        begin_s = end_s = math.nan
    if not 0 <= begin_s <= end_s < math.inf:
        raise DatasetError(f"--at: {word!r} should be a time in seconds, as 12.4, or two, as 12.4-13.0")
    return (begin_s, end_s) if dash else (max(0.0, begin_s - _AROUND_S), begin_s + _AROUND_S)


def _source_name(source: str) -> str:
    return Path(source).name if Path(source).expanduser().exists() else source


def _check(takes: int, take_s: float, countdown_s: float, path: Path) -> None:
    if not 1 <= takes <= 1000:
        raise DatasetError(f"--takes: {takes} should be from 1 to 1000")
    if not 0.2 <= take_s <= 60:
        raise DatasetError(f"--take-time: {take_s:g} should be from 0.2 to 60 seconds")
    if not 0 <= countdown_s <= 60:
        raise DatasetError(f"--countdown: {countdown_s:g} should be from 0 to 60 seconds")
    # Checked before the work, not after it.
    if not path.absolute().parent.is_dir():
        raise DatasetError(f"--dataset: there is no folder {path.absolute().parent} for {path.name}")


def import_keypoints(
    source: Path,
    /,
    *,
    labels: Annotated[list[str], Parameter(consume_multiple=True)],
    dataset: Path = Path("signs.npz"),
    person: str | None = None,
    not_mirrored: Flag = False,
) -> int:
    """Add rows of landmarks to a dataset, from a CSV file: a class number, then x and y of the 21 landmarks.

    Example: handsteer signs import keypoint.csv --labels 2=Pointer 3=OK

    Coordinates are relative to the wrist and divided by the largest of them, as
    several hand sign projects write them. They have no depth, so signs learnt
    with them use the image coordinates only.

    Parameters
    ----------
    source
        CSV file, or gzipped (.csv.gz).
    labels
        The sign of each class, as 3=OK; other classes are skipped. Or a file with one name per line, from class 0.
    dataset
        File to add the rows to; created if missing.
    person
        Who showed them; by default the name of the file.
    not_mirrored
        The rows come from unmirrored images; most such projects mirror them first.
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
