"""Sources of an evaluation: folders of labelled photos, datasets of landmarks, videos."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handsteer.cameras.files import PHOTO_SUFFIXES, video_frames
from handsteer.errors import EvaluationError
from handsteer.signs.classifier import Classifier
from handsteer.signs.evaluate import evaluate_frames, evaluate_photos, evaluate_takes, lacks_depth
from handsteer.signs.labelled import LabelledPhoto, read_photo_labels, read_video_labels
from handsteer.signs.metrics import PhotoResult
from handsteer.signs.recognizer import Recognizer
from handsteer.signs.teaching.dataset import Dataset, load_dataset
from handsteer.signs.video_metrics import FrameVerdict
from handsteer.signs.views import View
from handsteer.types import NONE

Watch = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items through, given their unit; may show the progress."""


@dataclass(frozen=True)
class PhotoRun:
    """The results of the photos of a folder, or of the hands of a dataset.

    Attributes:
        source: The folder or file.
        view: How it was transformed.
        results: The results of all scored items.
        unscored: Number of items left out.
        without_depth: Number of hands left out for missing depth.
    """

    source: str
    view: View
    results: tuple[PhotoResult, ...]
    unscored: int
    without_depth: int = 0


@dataclass(frozen=True)
class VideoRun:
    """The results of the frames of a video."""

    source: str
    view: View
    frames: tuple[FrameVerdict, ...]


@dataclass(frozen=True)
class LabelledFolder:
    """A folder of labelled photos."""

    path: Path
    photos: tuple[LabelledPhoto, ...]

    def run(self, recognizer: Recognizer, view: View, watch: Watch) -> PhotoRun:
        """Return the results of ``recognizer`` on the photos, transformed by ``view``.

        Raises:
            CameraUnreadable: A photo cannot be decoded.
        """
        results = tuple(evaluate_photos(watch(self.photos, "photos"), recognizer, view))
        return PhotoRun(str(self.path), view, results, len(self.photos) - len(results))


@dataclass(frozen=True)
class LabelledHands:
    """A dataset of landmarks with known signs only."""

    path: Path
    dataset: Dataset

    def run(self, classifier: Classifier, min_confidence: float, view: View, watch: Watch) -> PhotoRun:
        """Return the results of ``classifier`` on the hands, transformed by ``view``."""
        hands = [(take.label, hand) for take in self.dataset.takes for hand in take.hands]
        without_depth = sum(lacks_depth(hand, label, classifier) for label, hand in hands)
        results = tuple(watch(evaluate_takes(self.dataset, classifier, min_confidence, view), "hands"))
        unscored = len(hands) - len(results) - without_depth
        return PhotoRun(str(self.path), view, results, unscored, without_depth)


@dataclass(frozen=True)
class LabelledVideo:
    """A video, and the sign of each labelled frame; None without labels."""

    path: Path
    truths: dict[int, str] | None

    def run(self, recognizer: Recognizer, view: View, watch: Watch) -> VideoRun:
        """Return the results of ``recognizer`` on the frames, transformed by ``view``.

        Raises:
            CameraUnreadable: It is not a video, or cannot be decoded.
            LabelError: There are labels for more frames than there are.
        """
        frames = watch(video_frames(self.path), "frames")
        return VideoRun(str(self.path), view, tuple(evaluate_frames(frames, self.truths, recognizer, view)))


Source = LabelledFolder | LabelledHands | LabelledVideo


def open_source(path: Path, classifier: Classifier) -> Source:
    """Return the source at ``path``, with its labels: a folder, a dataset (``.npz``), or else a video.

    Raises:
        EvaluationError: It does not exist, its labels are wrong or name signs unknown to ``classifier``, or nothing in
            it can be scored.
        CameraUnreadable: It is not a video, or cannot be decoded.
        DatasetError: It is not a dataset, or cannot be read.
    """
    if path.suffix.lower() == ".npz":
        return _open_dataset(path, classifier)
    if not path.is_file():
        return LabelledFolder(path, tuple(read_photo_labels(path, classifier.signs)))
    if path.suffix.lower() in PHOTO_SUFFIXES:
        raise EvaluationError(f"{path} is a photo: give the folder of labelled photos that it is in, or a video")
    next(video_frames(path))  # fail now, not after an hour of evaluating other sources
    return LabelledVideo(path, read_video_labels(path, classifier.signs))


def _open_dataset(path: Path, classifier: Classifier) -> LabelledHands:
    dataset = load_dataset(path)
    known = (*classifier.signs, NONE)
    unknown = [label for label in dataset.labels if label not in known]
    if unknown:
        raise EvaluationError(
            f"{path}: the sign {unknown[0]!r} is not known; the signs are {', '.join(known)}: "
            "name a model that knows it by --signs.model"
        )
    hands = [(take.label, hand) for take in dataset.takes for hand in take.hands]
    if not hands:
        raise EvaluationError(f"{path}: there is no hand in it")
    if all(lacks_depth(hand, label, classifier) for label, hand in hands):
        raise EvaluationError(
            f"{path}: none of its {len(hands)} hands has depth, and without it {', '.join(dataset.labels)} cannot be "
            "told: give hands of `handsteer signs collect`, or photos; only signs that were taught from rows without "
            "depth are told from such rows (--signs.model)"
        )
    return LabelledHands(path, dataset)
