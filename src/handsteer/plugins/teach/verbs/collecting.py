"""Collects takes of a sign from a camera, files or a recording, for ``handsteer signs collect``."""

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.choose import open_camera
from handsteer.cli.installation import fetch_missing
from handsteer.cli.running import say
from handsteer.clock import RealClock
from handsteer.config import Config
from handsteer.errors import DatasetError
from handsteer.plugins.teach.collect import Collector, Facts, Status, collect_live, collect_moment, collect_recorded
from handsteer.plugins.teach.dataset import Dataset, Take, add_takes, load_dataset, save_dataset
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.terminal import Keys, TerminalPicture
from handsteer.plugins.teach.verbs.tables import dataset_table
from handsteer.recognition.custom_signs import label_for
from handsteer.recognition.drawing import draw_hand
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import open_landmarker

_AROUND_S = 0.25


@dataclass(frozen=True)
class Plan:
    """What to collect: see the options of ``handsteer signs collect``."""

    label: str
    dataset: Path
    person: str
    session: str | None
    takes: int
    take_s: float
    countdown_s: float
    hold: bool


def undo_last(dataset: Path) -> None:
    """Remove the last take from the file ``dataset``, and print what is left.

    Raises:
        DatasetError: The file has none, or cannot be read or written.
    """
    known = load_dataset(dataset) if dataset.exists() else Dataset()
    gone = known.takes[-1:]
    save_dataset(known.without_last(), dataset)
    say(f"removed the last take: {len(gone[0].hands)} hands of {gone[0].label}")
    print(dataset_table(known.without_last()))


def collect_takes(config: Config, plan: Plan, recording: Path | None, moments: Sequence[str]) -> None:
    """Add takes to the file of ``plan``, and print what it contains.

    Args:
        config: The parameters; ``camera.source`` may name files.
        plan: What to collect.
        recording: A drive; each of its ``moments``, as ``12.4`` or ``12.4-13.0`` in seconds, becomes a take.
        moments: Empty without a recording.

    Raises:
        HandsteerError: A source, a moment or the dataset cannot be used.
    """
    known = load_dataset(plan.dataset) if plan.dataset.exists() else Dataset()
    when = plan.session or f"{datetime.datetime.now():%Y-%m-%d %H:%M}"
    source = config.camera.source if recording is None else str(recording)
    facts = Facts(label_for(plan.label, known.labels), plan.person, when, _source_name(source))
    file = Path(source).expanduser()
    is_file = file.exists() and not file.is_char_device()
    parts = [_part(word) for word in moments]
    if plan.hold and not is_file and not Keys.possible():
        raise DatasetError("--hold needs a terminal to read keys from; without it, a countdown starts each take")
    fetch_missing(config)
    if recording is not None:
        landmarker = open_landmarker(config)
        takes = [collect_moment(recording, landmarker, facts, *part) for part in parts]
        known = add_takes(_as_recognised(config, takes), plan.dataset)
    elif is_file:
        without: list[Path] = []
        takes = collect_recorded(file, open_landmarker(config), facts, plan.take_s, without.append)
        known = add_takes(_as_recognised(config, takes), plan.dataset)
        _say_without_hand(without)
    else:
        known = _live(config, plan, facts, known)
    print(dataset_table(known))


def _as_recognised(config: Config, takes: Sequence[Take]) -> list[Take]:
    """Return ``takes`` with the hands that recognition sees: its frames may be mirrored first."""
    if not config.signs.swap_sides:
        return list(takes)
    view = View(flip=True)
    return [replace(take, hands=tuple(view.hand(hand) for hand in take.hands)) for take in takes]


def _say_without_hand(photos: Sequence[Path]) -> None:
    if photos:
        say(f"no hand was found in {len(photos)} photos, which were left out: {', '.join(map(str, photos))}")


def _live(config: Config, plan: Plan, facts: Facts, known: Dataset) -> Dataset:
    collector = Collector(facts, takes=plan.takes, take_s=plan.take_s, countdown_s=plan.countdown_s, hold=plan.hold)
    clock = RealClock()
    landmarker = open_landmarker(config)
    camera = open_camera(config, clock)
    view = _View(facts.label)
    added = 0
    try:
        with Keys() as keys:

            def show(image: NDArray[np.uint8], hand: Hand | None, status: Status) -> None:
                nonlocal known, added
                if keys.pressed("q"):
                    raise KeyboardInterrupt
                if keys.pressed("u") and added:
                    if len(load_dataset(plan.dataset).takes) > len(known.takes):
                        raise DatasetError(f"another program adds takes to {plan.dataset}: nothing was undone")
                    known = known.without_last()
                    save_dataset(known, plan.dataset)
                    added -= 1
                    collector.again()
                view.show(image, hand, status, added)

            for take in collect_live(camera, landmarker, collector, clock, show=show, key_age=keys.space_age_s):
                known = add_takes(_as_recognised(config, [take]), plan.dataset)
                added += 1
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
