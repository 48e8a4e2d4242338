"""The recogniser, put to the test on photos and videos whose signs are known."""

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
    """Yield what is seen in each photo, with nothing kept from one to the next.

    Photos that are not to be scored, or cannot be when they are seen as ``view`` does, are left out.

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
    """Yield what is seen in each frame of a video, as a camera would give it, and which sign counts then.

    Args:
        frames: The frames in their order.
        truths: The sign of each frame, by its number from 0; a frame that is not there is not scored. None when
            nothing is known.
        recognizer: What is tested.
        view: How the frames are looked at.

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
    """Yield what is seen in each hand of a dataset, with nothing kept from one to the next.

    Its kind and its set of persons are the person. Hands that cannot be scored when they are seen as ``view`` does are
    left out, and so are those without the depth that it takes to tell them (:func:`lacks_depth`).

    Args:
        dataset: Whose signs are all known to the classifier, or ``NONE``.
        classifier: What is tested.
        min_confidence: 0 to 1, from which a sign is seen.
        view: How the hands are looked at.
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
    """Return whether ``hand`` has no depth and ``label`` cannot be told without it, so that it cannot be scored.

    Only signs that were taught from such landmarks can. For ``NONE`` the shipped signs would have to be told too.
    """
    if np.isfinite(hand.world).all():
        return False
    return not (isinstance(classifier, TaughtClassifier) and label in classifier.signs_without_depth)
