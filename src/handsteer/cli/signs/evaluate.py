"""``handsteer signs evaluate``: how well are the signs told?"""

import json as json_format
import sys
from pathlib import Path
from typing import Annotated, Any

import cv2
from cyclopts import Parameter
from tqdm import tqdm

from handsteer.cameras.files import PHOTO_SUFFIXES, video_frames
from handsteer.cli.options import ConfigFile, Flag, Parameters, settings
from handsteer.cli.signs.tables import photo_tables, video_tables
from handsteer.config import Config
from handsteer.control.actions import motion_signs
from handsteer.errors import EvaluationError
from handsteer.signs.confusion_picture import draw_confusion
from handsteer.signs.evaluate import evaluate_frames, evaluate_photos, evaluate_takes
from handsteer.signs.figures import Confusion, PhotoReport, photo_report
from handsteer.signs.labelled import labels_of, read_photo_labels, read_video_labels
from handsteer.signs.opening import open_classifier, open_recognizer
from handsteer.signs.teaching.dataset import load_dataset
from handsteer.signs.video_figures import VideoReport, video_report
from handsteer.signs.views import View


def evaluate(
    source: Path,
    /,
    *,
    json: Flag = False,
    png: Path | None = None,
    flip: Flag = False,
    rotate: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0,
    as_is: Flag = False,
    grace: float = 0.3,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Print how well the signs are told in labelled photos, in a video, or in a dataset of landmarks.

    Example: handsteer signs evaluate photos/ --flip --png confusion.png

    A folder has an index.csv (columns path, sign, and kind if wanted), or a subfolder for each sign and one called
    negatives. A video may have a file VIDEO.labels.csv beside it (columns frame, sign), VIDEO without its ending.

    Parameters
    ----------
    source
        A folder of labelled photos, a video file, or a dataset (.npz) of `signs collect`.
    json
        Print one JSON object.
    png
        Write the confusion matrix as a picture to this file.
    flip
        Look at everything flipped left to right: the other hand, and left for right.
    rotate
        Turn everything clockwise by so many degrees; by 180, Forward is Backward.
    as_is
        Don't pad and enlarge photos below 400 px.
    grace
        In a video, how many seconds a sign may go on to count when it is no longer shown.
    config_file
        YAML file with parameters; those given here go before it.
    """
    config = settings(config_file, parameters)
    _check(rotate, grace, png)
    view = View(flip=flip, rotate_deg=rotate, enlarge=not as_is)
    report: PhotoReport | VideoReport
    confusion: Confusion | None
    if source.suffix.lower() == ".npz":
        report = _dataset(source, config, view)
        text, confusion = photo_tables(report, "hands"), report.confusion
    elif source.is_file():
        report = _video(source, config, view, grace, wants_confusion=png is not None)
        text, confusion = video_tables(report), report.labels.confusion if report.labels else None
    else:
        report = _photos(source, config, view)
        text, confusion = photo_tables(report), report.confusion
    if png is not None and confusion is not None:
        _write_picture(png, confusion, f"{source.resolve().name}: signs shown and seen")
    asked = {"source": str(source), "flip": flip, "rotate": rotate}
    print(json_format.dumps({**asked, **report.as_dict()}) if json else text)
    return 0


def _photos(folder: Path, config: Config, view: View) -> PhotoReport:
    signs = open_classifier(config.signs).signs
    photos = read_photo_labels(folder, signs)
    results = list(evaluate_photos(_with_progress(photos, "photos"), open_recognizer(config), view))
    if not results:
        raise EvaluationError(f"{folder}: no photo shows a sign or NONE when it is turned so; try another --rotate")
    return photo_report(
        results, signs, motion_signs(config.control.actions, signs), unscored=len(photos) - len(results)
    )


def _dataset(path: Path, config: Config, view: View) -> PhotoReport:
    dataset = load_dataset(path)
    classifier = open_classifier(config.signs)
    results = list(evaluate_takes(dataset, classifier, config.signs.min_confidence, view))
    if not results:
        raise EvaluationError(f"{path}: no hand shows a sign or NONE when it is turned so; try another --rotate")
    unscored = sum(len(take.hands) for take in dataset.takes) - len(results)
    return photo_report(results, classifier.signs, motion_signs(config.control.actions, classifier.signs), unscored)


def _video(path: Path, config: Config, view: View, grace_s: float, *, wants_confusion: bool) -> VideoReport:
    if path.suffix.lower() in PHOTO_SUFFIXES:
        raise EvaluationError(f"{path} is a photo: give the folder of labelled photos that it is in, or a video")
    signs = open_classifier(config.signs).signs
    truths = read_video_labels(path, signs)
    if wants_confusion and truths is None:
        raise EvaluationError(
            f"--png: there are no labels for {path}, so no confusion matrix: expected {labels_of(path)}"
        )
    frames = _with_progress(video_frames(path), "frames")
    verdicts = list(evaluate_frames(frames, truths, open_recognizer(config), view))
    return video_report(verdicts, signs, motion_signs(config.control.actions, signs), grace_s)


def _with_progress(things: Any, unit: str) -> Any:
    return tqdm(things, unit=f" {unit}", file=sys.stderr, disable=not sys.stderr.isatty())


def _check(rotate: float, grace_s: float, png: Path | None) -> None:
    if not -360 <= rotate <= 360:
        raise EvaluationError(f"--rotate: {rotate:g} should be from -360 to 360 degrees")
    if not 0 <= grace_s <= 10:
        raise EvaluationError(f"--grace: {grace_s:g} should be from 0 to 10 seconds")
    # Before the work, which takes a while, not after it.
    if png is not None and (png.suffix.lower() != ".png" or not png.parent.is_dir()):
        raise EvaluationError(f"--png: {png} should be a file name that ends in .png, in a folder that is there")


def _write_picture(path: Path, confusion: Confusion, title: str) -> None:
    _, data = cv2.imencode(".png", draw_confusion(confusion, title))
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise EvaluationError(f"--png: cannot write {path}: {error.strerror}") from None
