"""Sources of an evaluation: folders of labelled photos, datasets of landmarks, videos."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handsteer.cameras import Frame
from handsteer.cameras.files import PHOTO_SUFFIXES, read_photo, video_frames
from handsteer.errors import EvaluationError, LabelError
from handsteer.plugins.teach.dataset import Dataset, load_dataset
from handsteer.plugins.teach.evaluation.labels import LabelledPhoto, read_photo_labels, read_video_labels
from handsteer.plugins.teach.evaluation.photo_metrics import PhotoResult
from handsteer.plugins.teach.evaluation.video_metrics import FrameVerdict
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.custom_signs import CustomClassifier
from handsteer.recognition.hand import Classifier, Hand
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import NONE

Watch = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items through, given their unit; may show the progress."""


def evaluate_photos(photos: Iterable[LabelledPhoto], recognizer: Recognizer, view: View) -> Iterator[PhotoResult]:
    """Yield the recognition of each photo, independently of the others.

    Photos that are not to be scored, or cannot be in this ``view``, are left out.

    Raises:
        CameraUnreadable: A photo cannot be decoded.
    """
    for photo in photos:
        truth, kind = view.truth(photo.truth, photo.kind)
        if truth is None:
            continue
        recognition = recognizer.recognize(view.picture(read_photo(photo.path)))
        hand = recognition.hand
        yield PhotoResult(
            path=str(photo.path),
            kind=kind,
            truth=truth,
            seen=recognition.seen,
            confidence=recognition.confidence,
            hand_px=hand.longer_side_px if hand else None,
            presence=hand.presence if hand else None,
            person_set=photo.person_set,
            likelihoods=recognition.likelihoods,
        )


def evaluate_frames(
    frames: Iterable[Frame], truths: Mapping[int, str] | None, recognizer: Recognizer, view: View
) -> Iterator[FrameVerdict]:
    """Yield the recognised and the confirmed sign of each frame of a video, processed as a camera's stream.

    Args:
        frames: The frames in order.
        truths: The sign of each frame by its number, from 0; missing frames are not scored. None without labels.
        recognizer: The recognizer to evaluate.
        view: How the frames are transformed.

    Raises:
        LabelError: There are labels for more frames than there are.
    """
    recognizer.reset()
    last_s: float | None = None
    number = -1
    for number, frame in enumerate(frames):
        dt_s = 0.0 if last_s is None else frame.captured_s - last_s
        last_s = frame.captured_s
        recognition = recognizer.step(view.picture(frame.image), dt_s)
        truth, _ = view.truth((truths or {}).get(number))
        yield FrameVerdict(frame.captured_s, truth, recognition.seen, recognition.sign)
    if truths and max(truths) > number:
        raise LabelError(f"there is a label for frame {max(truths)}, but the last frame of the video is {number}")


def lacks_depth(hand: Hand, label: str, classifier: Classifier) -> bool:
    """Return whether ``hand`` has no depth, but recognising ``label`` requires it, so that it cannot be scored.

    Only signs taught from flat landmarks can be recognised without depth. ``NONE`` requires recognising the shipped
    signs.
    """
    if np.isfinite(hand.world).all():
        return False
    return not (isinstance(classifier, CustomClassifier) and label in classifier.signs_without_depth)


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
        results = tuple(watch(self._results(classifier, min_confidence, view), "hands"))
        unscored = len(hands) - len(results) - without_depth
        return PhotoRun(str(self.path), view, results, unscored, without_depth)

    def _results(self, classifier: Classifier, min_confidence: float, view: View) -> Iterator[PhotoResult]:
        """Yield the recognition of each hand that can be scored; the person is its kind and person set."""
        for number, take in enumerate(self.dataset.takes, start=1):
            truth, _ = view.truth(take.label)
            for row, hand in enumerate(take.hands, start=1):
                if truth is None or lacks_depth(hand, take.label, classifier):
                    continue
                guess = classifier.classify(view.hand(hand))
                yield PhotoResult(
                    path=f"take {number}, hand {row}",
                    kind=take.person,
                    truth=truth,
                    seen=guess.sign if guess.confidence >= min_confidence else NONE,
                    confidence=guess.confidence,
                    hand_px=hand.longer_side_px,
                    presence=hand.presence,
                    person_set=take.person,
                    likelihoods=guess.likelihoods,
                )


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
            "recognised: give hands of `handsteer signs collect`, or photos; only signs that were taught from rows "
            "without depth can be recognised in such rows (--signs.model)"
        )
    return LabelledHands(path, dataset)
