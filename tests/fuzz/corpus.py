"""Small files that once did harm, made by code: what a picture, a world or a dataset from anywhere may be."""

import io
import json
import struct
import zipfile
import zlib

import cv2
import numpy as np

ALIASES = "\n".join(
    ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    + ["obstacles: *a8"]
)
"""517 bytes that stand for 9^9 texts."""

MERGES = "a0: &a0 {x: 1}\n" + "\n".join(f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}" for n in range(1, 12))
"""Tables of tables, merged for ever."""

YAMLS = (
    ALIASES,
    MERGES,
    "[" * 5000,
    "a: " + "9" * 5000,
    "a: 1" + ":1" * 2000,
    "a: !!float x",
    "a: !!timestamp x",
    "a: 2001-99-99",
    "? [1]\n: 2",
    "a: 0b_",
)


def jpeg(width: int = 32, height: int = 24, value: int = 90) -> bytes:
    """Return a JPEG file of one colour."""
    return cv2.imencode(".jpg", np.full((height, width, 3), value, np.uint8))[1].tobytes()


def png(width: int, height: int) -> bytes:
    """Return a black PNG file of one bit a pixel: 12 kB for 10000x10000."""
    rows = bytes(height * (1 + (width + 7) // 8))
    header = struct.pack(">2L5B", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(name, data) for name, data in ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    )


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">L", len(data)) + name + data + struct.pack(">L", zlib.crc32(name + data))


def resized_jpeg(width: int, height: int) -> bytes:
    """Return a small JPEG file that says that it is of another size."""
    data = jpeg()
    at = data.index(b"\xff\xc0")
    return data[: at + 5] + struct.pack(">2H", height, width) + data[at + 9 :]


def two_faced_jpeg() -> bytes:
    """Return a JPEG file that is small for who takes a marker without a length for one with it."""
    big = resized_jpeg(10000, 10000)
    small_frame = b"\xff\xc0\x00\x11\x08\x00\x08\x00\x08\x03\x01\x22\x00\x02\x11\x01\x03\x11\x01"
    # After FF 01 a decoder reads the next marker, FE with a comment; another reads a length of 65534.
    hidden = b"\xff\x01\xff\xfe\x00\x04ab" + big[2:]
    return b"\xff\xd8" + hidden + bytes(max(0, 65534 - len(hidden) + 2)) + small_frame + big[big.index(b"\xff\xda") :]


def npz(**arrays: bytes) -> bytes:
    """Return an .npz file of these .npy files, packed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in arrays.items():
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()


def npy(shape: tuple[int, ...], kind: str = "<f4", content: bytes = b"") -> bytes:
    """Return an .npy file whose header says ``shape``, whatever is in it."""
    header = repr({"descr": kind, "fortran_order": False, "shape": shape}).encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content


def saved(array: object) -> bytes:
    """Return an .npy file."""
    file = io.BytesIO()
    np.save(file, np.asarray(array))
    return file.getvalue()


def dataset(count: int = 1, value: float = 1.0, **others: bytes) -> bytes:
    """Return a dataset of ``count`` hands that are all ``value``; ``others`` go before what is right."""
    points = np.full((count, 21, 3), value, np.float32)
    arrays = {
        "format": saved(1),
        "takes": saved(json.dumps([{"label": "Hi", "person": "p", "session": "s", "source": "f"}])),
        "take": saved(np.zeros(count, np.int32)),
        "time_s": saved(np.zeros(count, np.float32)),
        "points": saved(points),
        "world": saved(points),
        "handedness": saved(np.full(count, "Right")),
        "handedness_score": saved(np.ones(count, np.float32)),
        "presence": saved(np.ones(count, np.float32)),
        "image_size": saved(np.full((count, 2), 240, np.int32)),
    }
    return npz(**(arrays | others))
