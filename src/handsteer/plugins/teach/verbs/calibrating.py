"""Asks for the signs of one person and makes a profile, for ``handsteer signs calibrate``."""

import json as json_format
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import EndOfStream
from handsteer.cameras.choose import open_camera
from handsteer.cameras.files import read_photo
from handsteer.cli.installation import fetch_missing
from handsteer.cli.running import say, table
from handsteer.clock import RealClock
from handsteer.config import Config
from handsteer.errors import ProfileError
from handsteer.plugins.teach.calibration import HOLD, Calibration, SignResult, calibrate, save_calibrated, shown_hand
from handsteer.plugins.teach.collect import Collector, Facts, Status, collect_live
from handsteer.plugins.teach.dataset import load_dataset
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.terminal import Keys, TerminalPicture
from handsteer.plugins.teach.verbs.calibrate import Timing
from handsteer.recognition.drawing import draw_hand
from handsteer.recognition.hand import Hand
from handsteer.recognition.profile import profile_path
from handsteer.recognition.recognizer import open_landmarker
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import NONE, SIGNS

_MOST_TRIES = 3
"""Takes of a sign that may fail for too few hands before it is skipped."""

Shown = dict[str, list[Hand]]


@dataclass(frozen=True)
class Plan:
    """What to make: see the options of ``handsteer signs calibrate``.

    Attributes:
        name: Of the profile.
        path: The file to write.
        timing: How the signs are shown to the camera.
        source: Labelled photos or a dataset, instead of the camera.
    """

    name: str
    path: Path
    timing: Timing
    source: Path | None


def make_profile(config: Config, plan: Plan, *, json: bool) -> None:
    """Write the profile of a person, and print what was read.

    Args:
        config: The camera and the landmark model.
        plan: What to make.
        json: Whether to print one JSON object.

    Raises:
        HandsteerError: The source cannot be used, or no sign can be adapted.
    """
    shipped, source, path = ShippedClassifier(load_model()), plan.source, plan.path
    hands = plan.timing.check()
    if source is not None and source.suffix.lower() == ".npz":
        shown = _of_dataset(source)
    else:
        fetch_missing(config)
        shown = _of_photos(config, source, shipped) if source is not None else _live(config, hands, plan.timing)
    made = calibrate(plan.name, shown, shipped)
    kept = save_calibrated(made.profile, path)
    if json:
        print(json_format.dumps({"profile": str(path), "signs": [_as_dict(each) for each in made.results]}))
    else:
        print(result_table(made))
    for each in made.results:
        if each.why_not:
            say(f"{each.sign} was not adapted: {each.why_not}")
    missing = [sign for sign in SIGNS if sign not in {each.sign for each in made.results}]
    if kept:
        say(f"kept from the profile that was there: {', '.join(kept)}")
    if missing := [sign for sign in missing if sign not in kept]:
        say(f"not shown, so read as everybody's: {', '.join(missing)}")
    chosen = plan.name if path == profile_path(Path(plan.name)) else path
    say(f"the profile is in {path}: drive with --signs.profile {shlex.quote(str(chosen))}")


def result_table(made: Calibration) -> str:
    """Return what was read of each sign, as text."""
    rows = [
        [each.sign, *_cells(each.before), *(_cells(each.after)[1:] if each.after else ["-"]), each.read_as or "-"]
        for each in made.results
    ]
    return table(["sign", "hands", "read before", "with the profile", "otherwise read as"], rows)


def _cells(share: Share) -> list[str]:
    return [str(share.of), f"{share.rate or 0.0:.0%}"]


def _as_dict(result: SignResult) -> Mapping[str, object]:
    shares = {"before": result.before.as_dict(), "after": result.after.as_dict() if result.after else None}
    return {**asdict(result), **shares}


def _of_dataset(path: Path) -> Shown:
    shown: Shown = {sign: [] for sign in SIGNS}
    for take in load_dataset(path).takes:
        if take.label in shown and not take.is_flat:
            shown[take.label] += take.hands
    if not any(shown.values()):
        raise ProfileError(f"{path}: none of its hands shows one of {', '.join(SIGNS)}")
    return shown


def _of_photos(config: Config, folder: Path, shipped: ShippedClassifier) -> Shown:
    """Return the hands of labelled photos; each is looked at as it is and mirrored, as the other hand."""
    if not folder.is_dir():
        problem = f"{folder} is a file" if folder.exists() else f"there is no folder {folder}"
        raise ProfileError(f"--from: {problem}: give a folder of labelled photos or a dataset (.npz)")
    landmarker = open_landmarker(config)
    shown: Shown = {sign: [] for sign in SIGNS}
    for photo in read_photo_labels(folder, SIGNS):
        if photo.truth in (None, NONE):
            continue
        for view in (View(), View(flip=True)):
            sign = view.truth(photo.truth)[0] or NONE
            landmarker.reset()
            hand = shown_hand(landmarker.detect(view.picture(read_photo(photo.path))), sign, shipped)
            if hand is not None:
                shown[sign].append(hand)
    return shown


def _live(config: Config, hands: Sequence[str], timing: Timing) -> Shown:
    clock = RealClock()
    landmarker = open_landmarker(config)
    camera = open_camera(config, clock)
    shown: Shown = {sign: [] for sign in SIGNS}
    # As the recognition sees them: its frames may be mirrored first.
    view = View(flip=config.signs.swap_sides)
    try:
        with Keys() as keys:
            for sign in SIGNS:
                for hand in hands:
                    step = _Step(sign, hand, timing, keys)
                    for take in collect_live(camera, landmarker, step.collector, clock, show=step.show):
                        shown[sign] += [view.hand(each) for each in take.hands]
    except KeyboardInterrupt:
        say("ended; the signs that were shown so far are used")
    except EndOfStream:
        say("the camera's file has ended; the signs that were shown so far are used")
    finally:
        camera.close()
    return shown


class _Step:
    """One sign with one hand; shows what to show: a picture in a terminal, otherwise a line for each change."""

    def __init__(self, sign: str, hand: str, timing: Timing, keys: Keys) -> None:
        facts = Facts(sign, "", "", "")
        self.collector = Collector(facts, takes=1, take_s=timing.seconds, countdown_s=timing.countdown)
        self._sign, self._hand, self._keys = sign, hand, keys
        self._picture = TerminalPicture() if TerminalPicture.possible() else None
        self._phase = ""
        self._tries = 0

    def show(self, image: NDArray[np.uint8], found: Hand | None, status: Status) -> None:
        """Show the progress; end the step after too many failures, or by a key."""
        self._tries += status.failed
        if self._keys.pressed("q"):
            raise KeyboardInterrupt
        if self._keys.pressed("s") or self._tries == _MOST_TRIES:
            self.collector.finish()
        words = self._sentence(status, found)
        if self._picture is not None:
            self._picture.draw(draw_hand(image, found), words, HOLD[self._sign], "s skips the sign, q ends")
        elif self._phase != status.phase or status.failed:
            say(f"{words}: {HOLD[self._sign]}")
        self._phase = status.phase

    def _sentence(self, status: Status, found: Hand | None) -> str:
        what, seen = f"{self._sign} with your {self._hand} hand", "" if found else " - no hand is in view"
        if status.failed:
            return f"too few hands were seen of {what}"
        if status.phase == "countdown":
            return f"show {what} in {math.ceil(status.left_s)} s{seen}"
        return f"hold {what}, {status.hands} hands{seen}" if status.phase == "recording" else f"{what} is done"
