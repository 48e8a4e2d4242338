"""Evaluates the recognizer on labelled photos and videos."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from handsteer.cameras.files import read_photo
from handsteer.cameras.protocol import Frame
from handsteer.errors import LabelError
from handsteer.landmarks.hand import Hand
from handsteer.signs.classifier import Classifier
from handsteer.signs.labelled import LabelledPhoto
from handsteer.signs.metrics import PhotoResult
from handsteer.signs.recognizer import Recognizer
from handsteer.signs.teaching.dataset import Dataset
from handsteer.signs.teaching.taught import TaughtClassifier
from handsteer.signs.video_metrics import FrameVerdict
from handsteer.signs.views import View
from handsteer.types import NONE


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
        recognizer.reset()
        recognition = recognizer.step(view.picture(read_photo(photo.path)), 0.0)
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


def evaluate_takes(
    dataset: Dataset, classifier: Classifier, min_confidence: float, view: View
) -> Iterator[PhotoResult]:
    """Yield the recognition of each hand of a dataset, independently of the others.

    The person becomes the result's kind and person set. Hands that cannot be scored in this ``view``, or lack the
    required depth (:func:`lacks_depth`), are left out.

    Args:
        dataset: Contains only signs of the classifier, and ``NONE``.
        classifier: The classifier to evaluate.
        min_confidence: Minimum confidence of a sign, 0 to 1.
        view: How the hands are transformed.
    """
    for number, take in enumerate(dataset.takes, start=1):
        truth, _ = view.truth(take.label)
        if truth is None:
            continue
        for row, hand in enumerate(take.hands, start=1):
            if lacks_depth(hand, take.label, classifier):
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


def lacks_depth(hand: Hand, label: str, classifier: Classifier) -> bool:
    """Return whether ``hand`` has no depth, but recognising ``label`` requires it, so that it cannot be scored.

    Only signs taught from flat landmarks can be recognised without depth. ``NONE`` requires recognising the shipped
    signs.
    """
    if np.isfinite(hand.world).all():
        return False
    return not (isinstance(classifier, TaughtClassifier) and label in classifier.signs_without_depth)
