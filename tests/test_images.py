import pickle

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import FrameError
from handsteer.images import bgr_image, camera_jpeg_message, image_message, jpeg_message, jpeg_picture
from handsteer.messages import CompressedImage, Header, Image, Time
from handsteer.picture_files import decode
from handsteer.transports.encoding import encode
from tests.fuzz import corpus

HEADER = Header(stamp=Time(1, 2), frame_id="camera")
BGR = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)


BT_601 = [[65.481, 128.553, 24.966], [-37.797, -74.203, 112.0], [112.0, -93.786, -18.214]]


def message(encoding: str, pixels: np.ndarray, padding: int = 0, width: int | None = None) -> Image:
    rows = pixels.reshape(pixels.shape[0], -1)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    return Image(HEADER, pixels.shape[0], width or pixels.shape[1], encoding, 0, padded.shape[1], padded.reshape(-1))


def test_there_and_back_shares_the_data() -> None:
    sent = image_message(BGR, HEADER)
    assert (sent.height, sent.width, sent.step, sent.encoding) == (48, 64, 192, "bgr8")
    assert np.shares_memory(bgr_image(sent), BGR)
    np.testing.assert_array_equal(bgr_image(sent), BGR)


def packed(encoding: str, bgr: np.ndarray) -> np.ndarray:
    """Return ``bgr`` in ``encoding``, worked out here and not by OpenCV, but for YUV's colours."""
    blue, green, red = bgr[..., 0], bgr[..., 1], bgr[..., 2]
    opaque = np.full_like(blue, 255)
    orders = {
        "bgr8": (blue, green, red),
        "8UC3": (blue, green, red),
        "rgb8": (red, green, blue),
        "bgra8": (blue, green, red, opaque),
        "rgba8": (red, green, blue, opaque),
        "mono8": (blue,),
        "8UC1": (blue,),
    }
    return np.stack(orders[encoding], axis=2)


@st.composite
def pictures(draw: st.DrawFn) -> np.ndarray:
    """Return small pictures, (height, width, 3) uint8, BGR, of noise."""
    height, width, seed = draw(st.integers(1, 9)), draw(st.integers(1, 9)), draw(st.integers(0, 99))
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)


@given(pictures(), st.sampled_from(["bgr8", "8UC3", "rgb8", "bgra8", "rgba8"]), st.integers(0, 20))
def test_colours_and_padded_rows(bgr: np.ndarray, encoding: str, padding: int) -> None:
    np.testing.assert_array_equal(bgr_image(message(encoding, packed(encoding, bgr), padding)), bgr)


@given(pictures(), st.sampled_from(["mono8", "8UC1"]), st.integers(0, 20))
def test_grey_becomes_three_equal_channels(bgr: np.ndarray, encoding: str, padding: int) -> None:
    grey = np.repeat(bgr[:, :, :1], 3, axis=2)
    np.testing.assert_array_equal(bgr_image(message(encoding, packed(encoding, bgr), padding)), grey)


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("yuv422", "UYVY"), ("uyvy", "UYVY"), ("yuv422_yuy2", "YUYV"), ("yuyv", "YUYV")],
)
@given(st.tuples(*[st.integers(0, 255)] * 3), st.integers(1, 5), st.sampled_from([0, 6]))
def test_both_byte_orders_of_yuv422(
    encoding: str, order: str, rgb: tuple[int, int, int], pairs: int, padding: int
) -> None:
    # BT.601, as video has it: Y from 16 to 235, U and V from 16 to 240.
    y, u, v = np.array([16, 128, 128]) + np.array(BT_601) @ rgb / 255
    pair = np.array([round({"Y": y, "U": u, "V": v}[letter]) for letter in order], np.uint8)
    picture = bgr_image(message(encoding, np.tile(pair, (2, pairs)), padding, width=2 * pairs))
    assert picture.shape == (2, 2 * pairs, 3)
    assert np.abs(picture[..., ::-1].astype(int) - rgb).max() <= 3


def test_the_last_row_needs_no_padding() -> None:
    padded = message("bgr8", BGR, padding=8)
    padded.data = padded.data[:-8]
    np.testing.assert_array_equal(bgr_image(padded), BGR)


@pytest.mark.parametrize("encoding", ["16UC1", "mono16", "rgb16", "32FC1"])
def test_more_than_8_bits_are_refused(encoding: str) -> None:
    with pytest.raises(FrameError, match=rf"'{encoding}' has more than 8 bits a channel: use one of bgr8, rgb8"):
        bgr_image(message(encoding, BGR))


@pytest.mark.parametrize("encoding", ["", "yuv420", "BGR8"])
def test_an_encoding_that_is_not_known(encoding: str) -> None:
    with pytest.raises(FrameError, match=rf"'{encoding}' is not known: use one of bgr8, rgb8"):
        bgr_image(message(encoding, BGR))


def test_half_a_pair_of_pixels_is_refused() -> None:
    with pytest.raises(FrameError, match="yuv422 image has pairs of pixels, it cannot be 3 wide"):
        bgr_image(message("yuv422", np.zeros((2, 3, 2), np.uint8)))


@given(st.integers(0, 300), st.integers(0, 40), st.integers(0, 40), st.integers(0, 200))
def test_sizes_that_do_not_fit_are_refused(size: int, height: int, width: int, step: int) -> None:
    wrong = Image(HEADER, height, width, "bgr8", 0, step, np.zeros(size, np.uint8))
    if height and width and step >= 3 * width and step * (height - 1) + 3 * width <= size <= step * height:
        assert bgr_image(wrong).shape == (height, width, 3)
    else:
        with pytest.raises(FrameError, match=r"needs a step of at least|has no pixels"):
            bgr_image(wrong)


def test_jpeg() -> None:
    smooth: np.ndarray = cv2.GaussianBlur(BGR, (0, 0), 5)
    compressed = jpeg_message(smooth, HEADER, quality=95)
    decoded = cv2.imdecode(compressed.data, cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.abs(decoded.astype(int) - smooth).mean() < 3
    assert "jpeg" in compressed.format
    np.testing.assert_array_equal(jpeg_picture(compressed), decoded)


def test_a_cameras_own_jpeg_is_passed_on_and_not_decoded_again() -> None:
    data = corpus.jpeg()
    picture = decode(data)
    message = camera_jpeg_message(data, picture, HEADER)
    assert message.data.tobytes() == data
    assert jpeg_picture(message) is picture
    elsewhere = pickle.loads(pickle.dumps(message))
    assert type(elsewhere) is CompressedImage
    assert len(pickle.dumps(message)) < len(data) + 500
    np.testing.assert_array_equal(jpeg_picture(elsewhere), picture)
    assert encode(message) == encode(elsewhere)


@given(st.binary(max_size=64))
def test_what_is_no_picture_is_refused(data: bytes) -> None:
    with pytest.raises(FrameError, match=r"a compressed image, format 'jpeg': .* picture"):
        jpeg_picture(CompressedImage(HEADER, "jpeg", np.frombuffer(data, np.uint8)))


def test_a_small_file_of_a_large_picture_is_refused() -> None:
    data = np.frombuffer(corpus.png(10000, 10000), np.uint8)
    with pytest.raises(FrameError, match="a PNG picture of 10000x10000"):
        jpeg_picture(CompressedImage(HEADER, "png", data))
    with pytest.raises(FrameError, match="a torn JPEG picture"):
        jpeg_picture(CompressedImage(HEADER, "jpeg", np.frombuffer(corpus.jpeg()[:-9], np.uint8)))


def test_a_raw_image_beyond_all_cameras_is_refused() -> None:
    with pytest.raises(FrameError, match="an image of 8192x4096: it should have at most"):
        bgr_image(Image(HEADER, 4096, 8192, "mono8", 0, 8192, np.zeros(4096 * 8192, np.uint8)))
    for height, width in ((-1, 4), (4, -1)):
        with pytest.raises(FrameError, match="has no pixels"):
            bgr_image(Image(HEADER, height, width, "mono8", 0, 4, np.zeros(16, np.uint8)))


BAYER = {"rggb": ((2, 1), (1, 0)), "bggr": ((0, 1), (1, 2)), "gbrg": ((1, 0), (2, 1)), "grbg": ((1, 2), (0, 1))}
COLOURS = ((10, 200, 60), (250, 20, 120), (90, 90, 240))


@pytest.mark.parametrize("bgr", COLOURS)
@pytest.mark.parametrize("pattern", BAYER)
@pytest.mark.parametrize("padding", [0, 3])
def test_bayer_patterns(pattern: str, bgr: tuple[int, int, int], padding: int) -> None:
    tile = np.array([[bgr[channel] for channel in row] for row in BAYER[pattern]], np.uint8)
    picture = bgr_image(message(f"bayer_{pattern}8", np.tile(tile, (6, 8))[..., None], padding))
    assert picture.shape == (12, 16, 3)
    np.testing.assert_array_equal(picture[2:-2, 2:-2], np.broadcast_to(np.array(bgr, np.uint8), (8, 12, 3)))


@pytest.mark.parametrize(("encoding", "order"), [("nv12", (1, 2)), ("nv21", (2, 1))])
@pytest.mark.parametrize("bgr", COLOURS)
@pytest.mark.parametrize("padding", [0, 5])
def test_two_planes(encoding: str, order: tuple[int, int], bgr: tuple[int, int, int], padding: int) -> None:
    blue, green, red = bgr
    luma = 16 + 0.257 * red + 0.504 * green + 0.098 * blue  # ITU-R BT.601
    u, v = 128 - 0.148 * red - 0.291 * green + 0.439 * blue, 128 + 0.439 * red - 0.368 * green - 0.071 * blue
    yuv = np.round((luma, u, v)).astype(np.uint8)
    planes = np.full((12, 16), yuv[0], np.uint8)
    planes[8:] = np.tile(yuv[list(order)], (4, 8))
    padded = np.pad(planes, ((0, 0), (0, padding)))
    sent = Image(HEADER, 8, 16, encoding, 0, 16 + padding, padded.reshape(-1))
    picture = bgr_image(sent)
    assert picture.shape == (8, 16, 3)
    np.testing.assert_allclose(picture.astype(int), np.broadcast_to(bgr, (8, 16, 3)), atol=4)
    with pytest.raises(FrameError, match="needs a step"):
        bgr_image(Image(HEADER, 8, 16, encoding, 0, 16, planes[:8].reshape(-1)))
    with pytest.raises(FrameError, match="squares of pixels"):
        bgr_image(Image(HEADER, 7, 16, encoding, 0, 16, planes.reshape(-1)))
