"""Evaluates signs, prints the tables and draws the plots, for ``handsteer signs evaluate``."""

import json as json_format
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tqdm import tqdm

from handsteer.cli.installation import fetch_missing
from handsteer.config import Config
from handsteer.errors import EvaluationError, needing
from handsteer.plugins.teach.evaluation.labels import labels_of
from handsteer.plugins.teach.evaluation.report import Evaluation
from handsteer.plugins.teach.evaluation.sources import (
    LabelledFolder,
    LabelledHands,
    LabelledVideo,
    PhotoRun,
    Source,
    open_source,
)
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.verbs.tables import evaluation_tables
from handsteer.recognition.hand import Classifier
from handsteer.recognition.recognizer import Recognizer, open_classifier
from handsteer.types import motion_signs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def print_evaluation(
    config: Config,
    sources: Iterable[Path],
    views: Sequence[View],
    pictures: Mapping[str, Path | None],
    *,
    grace_s: float,
    sweep: bool,
    json: bool,
) -> None:
    """Evaluate folders of photos, videos and datasets, write the plots, and print the result.

    Args:
        config: Thresholds and models.
        sources: What to evaluate.
        views: How each is seen.
        pictures: Files of the plots, by the option that asks for each.
        grace_s: For how long a sign may still count in a video after it is no longer shown.
        sweep: Whether to print the results for other thresholds.
        json: Whether to print one JSON object instead of tables.

    Raises:
        HandsteerError: A source, an option or a file to write is wrong.
    """
    _check(grace_s, pictures)
    classifier = open_classifier(config.signs)
    opened = _open(sources, classifier)
    _check_figures(opened, {**pictures, "--sweep": sweep})
    evaluation = _evaluate(opened, views, config, classifier, grace_s)
    runs = evaluation.stills or evaluation.videos
    names = ", ".join(dict.fromkeys(Path(run.source).resolve().name for run in runs))
    for option, path in pictures.items():
        if path is not None:
            _write_plot(option, path, _plot(option, evaluation, names))
    with_sweep = sweep or pictures["--sweep-png"] is not None
    if json:
        print(json_format.dumps(evaluation.as_dict(with_sweep=with_sweep)))
        return
    with_reliability = pictures["--reliability"] is not None
    print(evaluation_tables(evaluation, with_reliability=with_reliability, with_sweep=with_sweep))


def views_of(rotate: str, *, flip: bool, enlarge: bool) -> list[View]:
    """Return the views: one for a single angle; for several, one for each, and with ``flip`` also each flipped."""
    try:
        angles = [float(angle) for angle in rotate.split(",") if angle.strip()]
    except ValueError:
        angles = []
    if not angles:
        raise EvaluationError(f"--rotate: {rotate!r} should be degrees, or several separated by commas, as -15,0,15")
    for angle in angles:
        if not -360 <= angle <= 360:
            raise EvaluationError(f"--rotate: {angle:g} should be from -360 to 360 degrees")
    flips = [flip] if "," not in rotate else [False, True] if flip else [False]
    return list(dict.fromkeys(View(flipped, angle, enlarge) for flipped in flips for angle in angles))


def _open(paths: Iterable[Path], classifier: Classifier) -> list[Source]:
    """Return all sources, checked as far as possible before the evaluation, which takes a while."""
    unique = list(dict.fromkeys(paths))
    if not unique:
        raise EvaluationError("there is nothing to evaluate: give folders of labelled photos, videos, or datasets")
    return [open_source(path, classifier) for path in unique]


def _evaluate(
    sources: Sequence[Source], views: Sequence[View], config: Config, classifier: Classifier, grace_s: float
) -> Evaluation:
    folders = [source for source in sources if isinstance(source, LabelledFolder)]
    datasets = [source for source in sources if isinstance(source, LabelledHands)]
    videos = [source for source in sources if isinstance(source, LabelledVideo)]
    least = config.signs.min_confidence
    hands = [data.run(classifier, least, view, _with_progress) for data in datasets for view in views]
    _check_scored(hands)
    # Datasets contain landmarks, so the landmark models are not needed for them.
    if folders or videos:
        fetch_missing(config)
    recognizer = Recognizer(config) if folders or videos else None
    photos = [folder.run(recognizer, view, _with_progress) for folder in folders for view in views if recognizer]
    _check_scored(photos)
    return Evaluation(
        signs=classifier.signs,
        motion=motion_signs(config.control.actions, classifier.signs),
        photos=tuple(photos),
        hands=tuple(hands),
        videos=tuple(video.run(recognizer, view, _with_progress) for video in videos for view in views if recognizer),
        grace_s=grace_s,
    )


def _check_scored(runs: Sequence[PhotoRun]) -> None:
    for source in dict.fromkeys(run.source for run in runs):
        if not any(run.results for run in runs if run.source == source):
            raise EvaluationError(
                f"{source}: nothing in it shows a sign or NONE at this rotation; try another --rotate"
            )


def _with_progress(things: Iterable[Any], unit: str) -> Iterable[Any]:
    return tqdm(things, unit=f" {unit}", file=sys.stderr, disable=not sys.stderr.isatty())


def _check(grace_s: float, pictures: Mapping[str, Path | None]) -> None:
    if not 0 <= grace_s <= 10:
        raise EvaluationError(f"--grace: {grace_s:g} should be from 0 to 10 seconds")
    # Checked before the evaluation, which takes a while.
    for option, png in pictures.items():
        if png is not None and (png.suffix.lower() != ".png" or not png.parent.is_dir()):
            raise EvaluationError(f"{option}: {png} should be a file name that ends in .png, in an existing folder")
    if any(pictures.values()):
        with needing("a plot", "plots", "matplotlib"):
            pass


def _check_figures(sources: Sequence[Source], wanted: Mapping[str, object]) -> None:
    """Refuse options that need more than videos."""
    videos = [source for source in sources if isinstance(source, LabelledVideo)]
    if len(videos) < len(sources):
        return
    if wanted["--png"] and all(video.truths is None for video in videos):
        path = videos[0].path
        raise EvaluationError(
            f"--png: there are no labels for {path}, so no confusion matrix: expected {labels_of(path)}"
        )
    for option in ("--reliability", "--sweep", "--sweep-png"):
        if wanted[option]:
            raise EvaluationError(f"{option} needs photos or a dataset, not only videos")


def _plot(option: str, evaluation: Evaluation, names: str) -> "Figure":
    # Loaded only when asked for: it is an extra.
    from handsteer.plugins.teach.evaluation.plots import draw_confusion, draw_reliability, draw_sweep

    if option == "--reliability":
        return draw_reliability(evaluation.calibration, f"{names}: reliability of likelihoods")
    if option == "--sweep-png":
        return draw_sweep(evaluation.sweep, f"{names}: thresholds")
    assert evaluation.confusion is not None
    return draw_confusion(evaluation.confusion, f"{names}: signs shown and seen")


def _write_plot(option: str, path: Path, plot: "Figure") -> None:
    try:
        plot.savefig(path)
    except OSError as error:
        raise EvaluationError(f"{option}: cannot write {path}: {error.strerror}") from None
