"""The recogniser, put to the test on photos and videos whose signs are known."""

from collections.abc import Iterable, Iterator, Mapping

from handsteer.cameras.files import read_photo
from handsteer.cameras.protocol import Frame
from handsteer.errors import EvaluationError, LabelError
from handsteer.signs.figures import PhotoResult
from handsteer.signs.labelled import LabelledPhoto
from handsteer.signs.protocol import Classifier
from handsteer.signs.recognizer import Recognizer
from handsteer.signs.teaching.dataset import Dataset
from handsteer.signs.video_figures import FrameVerdict
from handsteer.signs.views import View
from handsteer.signs.vocabulary import NONE


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
        size = round(recognition.hand.longer_side_px, 1) if recognition.hand else None
        yield PhotoResult(str(photo.path), kind, truth, recognition.seen, round(recognition.confidence, 4), size)


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
    """Yield what is seen in each hand of a dataset, with nothing kept from one to the next; its kind is the person.

    Hands that cannot be scored when they are seen as ``view`` does are left out.

    Raises:
        EvaluationError: The dataset has a sign that the classifier doesn't know.
    """
    unknown = [label for label in dataset.labels if label not in (*classifier.signs, NONE)]
    if unknown:
        known = ", ".join((*classifier.signs, NONE))
        raise EvaluationError(
            f"the sign {unknown[0]!r} is not known; the signs are {known}: name a model that knows it by --signs.model"
        )
    for number, take in enumerate(dataset.takes, start=1):
        truth, _ = view.truth(take.label)
        if truth is None:
            continue
        for row, hand in enumerate(take.hands):
            guess = classifier.classify(view.hand(hand))
            seen = guess.sign if guess.confidence >= min_confidence else NONE
            confidence = round(guess.confidence, 4)
            name = f"take {number}, hand {row + 1}"
            yield PhotoResult(name, take.person, truth, seen, confidence, round(hand.longer_side_px, 1))
