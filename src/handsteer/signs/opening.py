"""Opens the landmarker and the classifier of a configuration."""

from handsteer.config import Config, SignsConfig
from handsteer.landmarks.hand import Landmarker
from handsteer.landmarks.mediapipe import MediaPipeLandmarker
from handsteer.signs.classifier import Classifier
from handsteer.signs.model import load_model
from handsteer.signs.teaching.taught import TaughtClassifier, load_taught
from handsteer.signs.trained import TrainedClassifier


def open_landmarker(config: Config) -> Landmarker:
    """Return the hand landmarker.

    Raises:
        ModelError: A landmark model is missing or broken.
    """
    return MediaPipeLandmarker(config.landmarks)


def open_classifier(config: SignsConfig) -> Classifier:
    """Return the classifier of the shipped and taught signs of ``config``.

    Raises:
        ModelError: A sign model is missing or broken.
    """
    shipped = TrainedClassifier(load_model())
    return TaughtClassifier(shipped, load_taught(config.model.expanduser())) if config.model else shipped
