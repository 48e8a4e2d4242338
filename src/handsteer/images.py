"""Between numpy pictures and ROS image messages, without cv_bridge."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.errors import FrameError
from handsteer.messages import CompressedImage, Header, Image

_CHANNELS = {"bgr8": 3, "rgb8": 3, "mono8": 1, "bgra8": 4, "rgba8": 4}
_TO_BGR = {
    "rgb8": cv2.COLOR_RGB2BGR,
    "mono8": cv2.COLOR_GRAY2BGR,
    "bgra8": cv2.COLOR_BGRA2BGR,
    "rgba8": cv2.COLOR_RGBA2BGR,
}


def image_message(bgr: NDArray[np.uint8], header: Header) -> Image:
    """Return ``bgr``, (height, width, 3) uint8, as a ``bgr8`` message; the data is shared when it is contiguous."""
    height, width = bgr.shape[:2]
    data = np.ascontiguousarray(bgr).reshape(-1)
    return Image(header=header, height=height, width=width, encoding="bgr8", is_bigendian=0, step=3 * width, data=data)


def bgr_image(message: Image) -> NDArray[np.uint8]:
    """Return the picture of ``message`` as (height, width, 3) uint8, BGR; a view of the message where it can be.

    Raises:
        FrameError: The encoding is not one of bgr8, rgb8, mono8, bgra8, rgba8, or the data does not fit the size.
    """
    channels = _CHANNELS.get(message.encoding)
    if channels is None:
        raise FrameError(f"image encoding {message.encoding!r} is not supported: use one of {', '.join(_CHANNELS)}")
    height, width, row = message.height, message.width, message.width * channels
    if message.step < row or message.data.size < message.step * height:
        raise FrameError(
            f"a {width}x{height} {message.encoding} image needs a step of at least {row} and step x {height} bytes, "
            f"got a step of {message.step} and {message.data.size} bytes"
        )
    rows = message.data[: message.step * height].reshape(height, message.step)[:, :row]
    picture: NDArray[np.uint8] = rows.reshape(height, width, channels)
    if message.encoding == "bgr8":
        return picture
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(picture), _TO_BGR[message.encoding]), np.uint8)


def jpeg_message(bgr: NDArray[np.uint8], header: Header, quality: int = 80) -> CompressedImage:
    """Return ``bgr``, (height, width, 3) uint8, as a JPEG message; ``quality`` is 0 to 100."""
    return CompressedImage(header=header, format="bgr8; jpeg compressed bgr8", data=encode_jpeg(bgr, quality))


def jpeg_picture(message: CompressedImage) -> NDArray[np.uint8]:
    """Return the picture of ``message`` as (height, width, 3) uint8, BGR; any format that OpenCV reads.

    Raises:
        FrameError: The data is not a picture.
    """
    picture = cv2.imdecode(message.data, cv2.IMREAD_COLOR) if message.data.size else None
    if picture is None:
        raise FrameError(f"a compressed image of {message.data.size} bytes, format {message.format!r}, is no picture")
    return np.asarray(picture, np.uint8)


def encode_jpeg(bgr: NDArray[np.uint8], quality: int = 80) -> NDArray[np.uint8]:
    """Return ``bgr``, (height, width, 3) uint8, as the bytes of a JPEG file in an (n,) uint8 array."""
    done, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise FrameError(f"an image of shape {bgr.shape} cannot be written as JPEG")
    encoded: NDArray[Any] = data
    return encoded.reshape(-1)
