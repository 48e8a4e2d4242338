import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import FrameError
from handsteer.picture_files import decode, size_of
from tests.fuzz import corpus

PHOTO = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8), (0, 0), 3)
FILES = {suffix: cv2.imencode(suffix, PHOTO)[1].tobytes() for suffix in (".jpg", ".png")}
PROGRESSIVE = cv2.imencode(".jpg", PHOTO, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1])[1].tobytes()


@given(width=st.integers(1, 300), height=st.integers(1, 300))
def test_the_size_is_read_from_the_head(width: int, height: int) -> None:
    assert size_of(corpus.jpeg(width, height)) == ("JPEG", width, height)
    assert size_of(corpus.png(width, height)) == ("PNG", width, height)


@pytest.mark.parametrize("data", [*FILES.values(), PROGRESSIVE], ids=["jpg", "png", "progressive"])
def test_decodes_what_opencv_decodes_whatever_stands_behind_it(data: bytes) -> None:
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(decode(data), expected)
    np.testing.assert_array_equal(decode(data + bytes(99)), expected)


@pytest.mark.parametrize("data", [*FILES.values(), PROGRESSIVE], ids=["jpg", "png", "progressive"])
@pytest.mark.parametrize("part", [0.001, 0.1, 0.5, 0.9, 0.999])
def test_a_torn_picture_is_refused(data: bytes, part: float) -> None:
    with pytest.raises(FrameError, match=r"torn|not a JPEG or PNG"):
        decode(data[: int(len(data) * part)])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (corpus.png(10000, 10000), "a PNG picture of 10000x10000: it should have 1 to 16777216 pixels"),
        (corpus.resized_jpeg(10000, 10000), "a JPEG picture of 10000x10000"),
        (corpus.two_faced_jpeg(), "not a JPEG picture, or a torn one"),
        (corpus.resized_jpeg(0, 10), "0x10"),
        (PROGRESSIVE.replace(b"\xff\xda", b"\xff\xda" * 40, 1), "of more than 32 scans"),
        (FILES[".png"].replace(b"IDAT", b"acTL", 1), "animated"),
        (corpus.png(20, 20).replace(b"\x00\x00\x00\x00IEND", b"{{{{{{{{\x00\x00\x00\x00IEND"), "a torn PNG picture"),
        (FILES[".jpg"][:2] + b"\xff\xe0\x00\x02" * 3000 + FILES[".jpg"][2:], "not a JPEG picture"),
        (b"GIF89a" + bytes(50), "56 bytes that are not a JPEG or PNG picture"),
        (cv2.imencode(".bmp", PHOTO)[1].tobytes(), "not a JPEG or PNG"),
        (cv2.imencode(".webp", PHOTO)[1].tobytes(), "not a JPEG or PNG"),
        (b"", "0 bytes"),
    ],
    ids=[
        "png",
        "jpeg",
        "two faces",
        "no width",
        "scans",
        "animated",
        "long chunk",
        "segments",
        "gif",
        "bmp",
        "webp",
        "empty",
    ],
)
def test_what_would_cost_much_is_refused_before_it_is_decoded(
    data: bytes, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    with pytest.raises(FrameError, match=words):
        decode(data)


def test_the_file_that_did_harm_is_as_small_as_it_was() -> None:
    assert len(corpus.png(10000, 10000)) < 13_000
    assert len(corpus.ALIASES) < 520
