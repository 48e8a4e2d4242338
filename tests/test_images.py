import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import FrameError
from handsteer.images import bgr_image, image_message, jpeg_message
from handsteer.messages import Header, Image, Time

HEADER = Header(stamp=Time(1, 2), frame_id="camera")
BGR = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)


def message(encoding: str, pixels: np.ndarray, padding: int = 0) -> Image:
    rows = pixels.reshape(pixels.shape[0], -1)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    return Image(HEADER, pixels.shape[0], pixels.shape[1], encoding, 0, padded.shape[1], padded.reshape(-1))


def test_there_and_back_shares_the_data() -> None:
    sent = image_message(BGR, HEADER)
    assert (sent.height, sent.width, sent.step, sent.encoding) == (48, 64, 192, "bgr8")
    assert np.shares_memory(bgr_image(sent), BGR)
    np.testing.assert_array_equal(bgr_image(sent), BGR)


@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("bgr8", BGR),
        ("rgb8", cv2.cvtColor(BGR, cv2.COLOR_BGR2RGB)),
        ("bgra8", cv2.cvtColor(BGR, cv2.COLOR_BGR2BGRA)),
        ("rgba8", cv2.cvtColor(BGR, cv2.COLOR_BGR2RGBA)),
    ],
)
@pytest.mark.parametrize("padding", [0, 16])
def test_colours_and_padded_rows(encoding: str, pixels: np.ndarray, padding: int) -> None:
    np.testing.assert_array_equal(bgr_image(message(encoding, pixels, padding)), BGR)


def test_grey_becomes_three_equal_channels() -> None:
    grey = BGR[:, :, 0].copy()
    np.testing.assert_array_equal(bgr_image(message("mono8", grey)), np.repeat(grey[:, :, None], 3, axis=2))


def test_an_encoding_that_is_not_known() -> None:
    with pytest.raises(FrameError, match="image encoding '16UC1' is not supported: use one of bgr8, rgb8"):
        bgr_image(message("16UC1", BGR))


@given(st.integers(0, 300), st.integers(0, 40), st.integers(0, 40), st.integers(0, 200))
def test_sizes_that_do_not_fit_are_refused(size: int, height: int, width: int, step: int) -> None:
    wrong = Image(HEADER, height, width, "bgr8", 0, step, np.zeros(size, np.uint8))
    if step >= 3 * width and size >= step * height:
        assert bgr_image(wrong).shape == (height, width, 3)
    else:
        with pytest.raises(FrameError, match="needs a step of at least"):
            bgr_image(wrong)


def test_jpeg() -> None:
    smooth = cv2.GaussianBlur(BGR, (0, 0), 5)
    compressed = jpeg_message(smooth, HEADER, quality=95)
    decoded = cv2.imdecode(compressed.data, cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.abs(decoded.astype(int) - smooth).mean() < 3
    assert "jpeg" in compressed.format
