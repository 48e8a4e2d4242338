from pathlib import Path
from urllib.parse import quote

import cv2
import numpy as np
import pytest

from handsteer.dashboard.sign_pictures import sign_picture
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import SIGNS
from tests.dashboard.served import Site


@pytest.mark.parametrize("sign", SIGNS)
def test_the_picture_of_a_sign_shows_that_sign_in_a_mirror(sign: str) -> None:
    still = cv2.imdecode(np.frombuffer(sign_picture(sign, still=True), np.uint8), cv2.IMREAD_COLOR)
    assert still is not None
    unmirrored = np.asarray(cv2.flip(cv2.resize(still, (480, 480)), 1), np.uint8)
    assert Recognizer().recognize(unmirrored).seen == sign


def test_in_the_animation_the_hand_rises_and_then_holds_the_sign(tmp_path: Path) -> None:
    data = sign_picture("Stop")
    path = tmp_path / "stop.webp"
    path.write_bytes(data)
    done, animation = cv2.imreadanimation(str(path))
    assert done
    assert len(data) < 20_000
    first, last = animation.frames[0].astype(int), animation.frames[-1].astype(int)
    assert np.abs(first - last).max() > 50
    assert sum(animation.durations) < 5000, "it repeats soon"


def test_only_shipped_signs_have_pictures() -> None:
    site = Site()
    try:
        answer = site.get(f"/signs/{quote('Turn Left')}.webp")
        assert (answer.status, answer.getheader("content-type")) == (200, "image/webp")
        assert site.get("/signs/Peace.webp").status == 404
        assert site.get("/signs/NONE.webp").status == 404
    finally:
        site.close()
