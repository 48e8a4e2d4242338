"""Conversions between numpy pictures and ROS image messages, without cv_bridge."""

from collections.abc import Mapping
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.errors import FrameError, quoted
from handsteer.messages import CompressedImage, Header, Image
from handsteer.picture_files import MOST_PIXELS, decode

# Encodings of ROS's sensor_msgs/image_encodings.h: bytes per pixel, and the OpenCV conversion to BGR. ROS 1 names the
# byte order of yuv422 after OpenCV (UYVY), or yuv422_yuy2; ROS 2 also has the names of the byte orders.
_ENCODINGS: Final[Mapping[str, tuple[int, int | None]]] = {
    "bgr8": (3, None),
    "rgb8": (3, cv2.COLOR_RGB2BGR),
    "mono8": (1, cv2.COLOR_GRAY2BGR),
    "bgra8": (4, cv2.COLOR_BGRA2BGR),
    "rgba8": (4, cv2.COLOR_RGBA2BGR),
    "8UC3": (3, None),
    "8UC1": (1, cv2.COLOR_GRAY2BGR),
    "yuv422": (2, cv2.COLOR_YUV2BGR_UYVY),
    "uyvy": (2, cv2.COLOR_YUV2BGR_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2BGR_YUY2),
    "yuyv": (2, cv2.COLOR_YUV2BGR_YUY2),
    # OpenCV names a pattern after the pixels of its second row and column.
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2BGR),
    "bayer_bggr8": (1, cv2.COLOR_BayerRG2BGR),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2BGR),
    "bayer_grbg8": (1, cv2.COLOR_BayerGB2BGR),
}
# A plane of brightness, then one of half its height with both colours of each 2x2 pixels in turn.
_TWO_PLANES: Final[Mapping[str, int]] = {"nv12": cv2.COLOR_YUV2BGR_NV12, "nv21": cv2.COLOR_YUV2BGR_NV21}


def image_message(bgr: NDArray[np.uint8], header: Header) -> Image:
    """Return ``bgr``, (height, width, 3) uint8, as a ``bgr8`` message; contiguous data is shared."""
    height, width = bgr.shape[:2]
    data = np.ascontiguousarray(bgr).reshape(-1)
    return Image(header=header, height=height, width=width, encoding="bgr8", is_bigendian=0, step=3 * width, data=data)


def bgr_image(message: Image) -> NDArray[np.uint8]:
    """Return the picture of ``message`` as (height, width, 3) uint8, BGR; a view of the message if possible.

    Raises:
        FrameError: The encoding is not a supported one of 8 bits, or the data does not fit the size.
    """
    if message.encoding in _TWO_PLANES:
        return _from_two_planes(message)
    if message.encoding not in _ENCODINGS:
        deep = "16" in message.encoding or "32" in message.encoding or "64" in message.encoding
        why = "has more than 8 bits a channel" if deep else "is not known"
        raise FrameError(
            f"image encoding {quoted(message.encoding)} {why}: use one of {', '.join((*_ENCODINGS, *_TWO_PLANES))}"
        )
    pixel_bytes, to_bgr = _ENCODINGS[message.encoding]
    picture = _pixels(message, pixel_bytes)
    if to_bgr is None:
        return picture
    if pixel_bytes == 2 and message.width % 2:
        raise FrameError(f"a {message.encoding} image has pairs of pixels, it cannot be {message.width} wide")
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(picture), to_bgr), np.uint8)


def _from_two_planes(message: Image) -> NDArray[np.uint8]:
    if message.width % 2 or message.height % 2:
        raise FrameError(
            f"a {message.encoding} image has squares of pixels, it cannot be of {message.width}x{message.height}"
        )
    planes = np.ascontiguousarray(_pixels(message, 1, message.height * 3 // 2))
    return np.asarray(cv2.cvtColor(planes, _TWO_PLANES[message.encoding]), np.uint8)


def _pixels(message: Image, pixel_bytes: int, rows: int | None = None) -> NDArray[np.uint8]:
    """Return a view of ``message`` as (rows, width, pixel_bytes), without the padding at the end of each row.

    ``rows`` is the height by default.
    """
    height, width, step = message.height if rows is None else rows, message.width, message.step
    row = width * pixel_bytes
    if not (height > 0 and width > 0):
        raise FrameError(f"an image of {width}x{height} has no pixels")
    if message.height * width > MOST_PIXELS:
        raise FrameError(f"an image of {width}x{height}: it should have at most {MOST_PIXELS} pixels")
    # The last row needs no padding after it.
    if step < row or not step * (height - 1) + row <= message.data.size <= step * height:
        raise FrameError(
            f"a {width}x{height} {message.encoding} image needs a step of at least {row} and step x {height} bytes, "
            f"got a step of {step} and {message.data.size} bytes"
        )
    shape, strides = (height, width, pixel_bytes), (step, pixel_bytes, 1)
    return np.lib.stride_tricks.as_strided(message.data, shape, strides, writeable=False)


def jpeg_message(bgr: NDArray[np.uint8], header: Header, quality: int = 80) -> CompressedImage:
    """Return ``bgr``, (height, width, 3) uint8, as a JPEG message; ``quality`` is 0 to 100."""
    return CompressedImage(header=header, format="bgr8; jpeg compressed bgr8", data=encode_jpeg(bgr, quality))


class _DecodedJpeg(CompressedImage):
    """A JPEG message and its picture, which was decoded before; other processes get the message alone."""

    picture: NDArray[np.uint8]

    def __reduce__(self) -> tuple[type[CompressedImage], tuple[Header, str, NDArray[np.uint8]]]:
        return CompressedImage, (self.header, self.format, self.data)


def camera_jpeg_message(jpeg: bytes, bgr: NDArray[np.uint8], header: Header) -> CompressedImage:
    """Return the message of a camera's own JPEG file.

    Args:
        jpeg: The file.
        bgr: Its picture, (height, width, 3) uint8, which :func:`jpeg_picture` returns within this process.
        header: The message's header.
    """
    message = _DecodedJpeg(header=header, format="bgr8; jpeg compressed bgr8", data=np.frombuffer(jpeg, np.uint8))
    object.__setattr__(message, "picture", bgr)
    return message


def jpeg_picture(message: CompressedImage) -> NDArray[np.uint8]:
    """Return the picture of ``message``, a JPEG or PNG file, as (height, width, 3) uint8, BGR.

    Raises:
        FrameError: The data is not such a picture, is truncated, or has more than :data:`MOST_PIXELS`.
    """
    if isinstance(message, _DecodedJpeg):
        return message.picture
    try:
        return decode(message.data.tobytes())
    except FrameError as error:
        raise FrameError(f"a compressed image, format {message.format[:60]!r}: {error}") from None


def mirrored(bgr: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a copy of ``bgr``, (height, width, 3) uint8, with left and right swapped."""
    return np.asarray(cv2.flip(bgr, 1), np.uint8)


def encode_jpeg(bgr: NDArray[np.uint8], quality: int = 80) -> NDArray[np.uint8]:
    """Return ``bgr``, (height, width, 3) uint8, as the bytes of a JPEG file in an (n,) uint8 array."""
    done, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise FrameError(f"an image of shape {bgr.shape} cannot be written as JPEG")
    encoded: NDArray[Any] = data
    return encoded.reshape(-1)
