"""Decodes JPEG and PNG files from untrusted sources, after checking their size and their end.

A PNG file of 12 kB can expand to 10000x10000 pixels, so the size in its header is checked before decoding. The end is
checked because a decoder fills the missing part of a truncated file with grey or with the previous picture.
"""

from typing import Final, Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.errors import FrameError

MOST_PIXELS: Final = 4096 * 4096
"""Limit for a camera's picture; handsteer's cameras have at most 4096 pixels a side."""

_JPEG, _PNG = b"\xff\xd8", b"\x89PNG\r\n\x1a\n"
_START_OF_SCAN, _END_OF_IMAGE = b"\xff\xda", b"\xff\xd9"
_START_OF_FRAME = frozenset({*range(0xC0, 0xC4), *range(0xC5, 0xC8), *range(0xC9, 0xCC), *range(0xCD, 0xD0)})
_SEGMENTS = frozenset({*_START_OF_FRAME, 0xC4, 0xCC, *range(0xDA, 0xE0), *range(0xE0, 0xF0), 0xFE})
# The decoder processes the whole picture for each scan; the finest progressive files have a dozen.
_MOST_SCANS = 32
_MOST_SEGMENTS = 2000
_IMAGE_HEADER = b"\x00\x00\x00\rIHDR"
_ANIMATION = frozenset({b"acTL", b"fcTL", b"fdAT"})
_AROUND_A_CHUNK = 12  # bytes: its length, its name, its checksum
_MOST_CHUNKS = 50_000


class FileSize(NamedTuple):
    """What a file's header contains: the kind of file, width and height in pixels."""

    kind: Literal["JPEG", "PNG"]
    width: int
    height: int


def is_jpeg(data: bytes) -> bool:
    """Return whether ``data`` begins as a JPEG file does."""
    return data.startswith(_JPEG)


def size_of(data: bytes) -> FileSize:
    """Return the size of the picture in a JPEG or PNG file, without decoding it.

    Raises:
        FrameError: It is neither, or is truncated.
    """
    if data.startswith(_JPEG):
        return _jpeg_size(data)
    if data.startswith(_PNG):
        return _png_size(data)
    raise FrameError(f"{len(data)} bytes that are not a JPEG or PNG picture")


def decode(data: bytes, most_pixels: int = MOST_PIXELS) -> NDArray[np.uint8]:
    """Return the picture in a JPEG or PNG file as (height, width, 3) uint8, BGR, rotated by its EXIF orientation.

    Args:
        data: The file.
        most_pixels: Maximum number of pixels.

    Raises:
        FrameError: It is neither, is truncated or damaged, or has more pixels.
    """
    kind, width, height = size_of(data)
    if not 0 < width * height <= most_pixels:
        raise FrameError(f"a {kind} picture of {width}x{height}: it should have 1 to {most_pixels} pixels")
    try:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        picture = None
    if picture is None:
        raise FrameError(f"a damaged {kind} picture of {width}x{height}")
    return np.asarray(picture, np.uint8)


def _jpeg_size(data: bytes) -> FileSize:
    """Return the size in the frame header (ITU-T T.81, annex B)."""
    size, at = None, 2
    for _ in range(_MOST_SEGMENTS):
        marker, length = data[at : at + 2], int.from_bytes(data[at + 2 : at + 4], "big")
        # This parser would skip a segment without a length that the decoder reads: one file with two meanings.
        if marker[:1] != b"\xff" or marker[1:] == b"" or marker[1] not in _SEGMENTS or length < 2:
            break
        if marker == _START_OF_SCAN:
            if size is None:
                break
            _check_scans(data, at)
            return size
        if marker[1] in _START_OF_FRAME:
            if size is not None or length < 8:
                break
            height, width = (int.from_bytes(data[at + 5 + 2 * n : at + 7 + 2 * n], "big") for n in (0, 1))
            size = FileSize("JPEG", width, height)
        at += 2 + length
    raise FrameError(f"{len(data)} bytes that are not a JPEG picture, or a torn one")


def _check_scans(data: bytes, begin: int) -> None:
    end = data.find(_END_OF_IMAGE, begin)  # not part of pixel data, where FF is followed by 00
    if end < 0:
        raise FrameError(f"a torn JPEG picture: {len(data)} bytes without its end")
    if data.count(_START_OF_SCAN, begin, end) > _MOST_SCANS:
        raise FrameError(f"a JPEG picture of more than {_MOST_SCANS} scans")


def _png_size(data: bytes) -> FileSize:
    """Return the size in the first chunk (PNG, third edition, 11.2.1)."""
    begin = len(_PNG) + len(_IMAGE_HEADER)
    if data[len(_PNG) : begin] != _IMAGE_HEADER:
        raise FrameError(f"a torn PNG picture: {len(data)} bytes without its header")
    _check_chunks(data)
    width, height = (int.from_bytes(data[begin + 4 * n : begin + 4 * n + 4], "big") for n in (0, 1))
    return FileSize("PNG", width, height)


def _check_chunks(data: bytes) -> None:
    """Check each chunk's length, because a decoder allocates that much, even gigabytes."""
    at = len(_PNG)
    for _ in range(_MOST_CHUNKS):
        length, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if name in _ANIMATION:
            raise FrameError("an animated PNG picture, whose size is unknown")
        at += length + _AROUND_A_CHUNK
        if at > len(data):
            break
        if name == b"IEND":
            return
    raise FrameError(f"a torn PNG picture: {len(data)} bytes without its end")
