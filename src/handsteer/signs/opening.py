"""What a configuration describes, opened: what finds hands, what tells signs, and the recogniser of both.

This is all that it takes to recognise signs in pictures. It loads nothing of graphs, messages or robots.
"""

from handsteer.config import Config, SignsConfig
from handsteer.landmarks.mediapipe import MediaPipeLandmarker
from handsteer.landmarks.protocol import Landmarker
from handsteer.signs.model import load_model
from handsteer.signs.protocol import Classifier
from handsteer.signs.recognizer import Recognizer
from handsteer.signs.teaching.taught import TaughtClassifier, load_taught
from handsteer.signs.trained import TrainedClassifier


def open_recognizer(config: Config) -> Recognizer:
    """Return the recogniser that ``config`` describes.

    Raises:
        ModelError: A landmark model or the sign model is missing or broken.
    """
    return Recognizer(open_landmarker(config), open_classifier(config.signs), config.signs)


def open_landmarker(config: Config) -> Landmarker:
    """Return what finds the hands in frames.

    Raises:
        ModelError: A landmark model is missing or broken.
    """
    return MediaPipeLandmarker(config.landmarks)


def open_classifier(config: SignsConfig) -> Classifier:
    """Return the classifier that ``config`` describes: the signs that are shipped, and those that were taught.

    Raises:
        ModelError: A sign model is missing or broken.
    """
    shipped = TrainedClassifier(load_model())
    return TaughtClassifier(shipped, load_taught(config.model.expanduser())) if config.model else shipped
