from pathlib import Path

import pytest

from handsteer.cameras.files import read_photo
from handsteer.config import Config
from handsteer.plugins.teach.collect import largest
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import open_landmarker
from handsteer.types import SIGNS


@pytest.fixture(scope="module")
def real_hands(data_dir: Path) -> list[tuple[str, Hand]]:
    """A fifth of the real photos' hands, with the signs that they show."""
    landmarker, view = open_landmarker(Config()), View()
    found = []
    for photo in read_photo_labels(data_dir / "photos", SIGNS)[::5]:
        landmarker.reset()
        hand = largest(landmarker.detect(view.picture(read_photo(photo.path))))
        if hand is not None and photo.truth is not None:
            found.append((photo.truth, hand))
    assert len(found) > 100
    return found
