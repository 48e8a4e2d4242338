"""Detects frozen cameras, which go on delivering old pictures with new stamps."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_BLACK = 6.0

_PICTURES = 4096
"""Remembered pictures: those of the last minute at 60 frames a second."""
_RECENT = 8
"""Of a recording, which may be looped, only so many: a frozen camera may share its topic with working ones."""

_ROWS = 240
"""A codec repeats blocks of at least 8 rows, so a third of the rows of 720 shows what all of them do."""
_GRID = (30, 40)
_TILED_PICTURES = 2048
_FEW_TILES = 4
_TILES_OF_A_HAND = 64
"""Of a hand that covers more tiles, these many are compared."""

Box = tuple[int, int, int, int]
_Sums = NDArray[np.uint64]


class Freshness:
    """Compares each picture with those of the last minute.

    No two pictures of a real camera are equal, because its sensor has noise. A picture that equals an earlier one in
    each pixel is not new, however many came between them. Compressed video repeats parts that hardly change, so equal
    parts are evidence only if they are nearly the whole region of the hand: then the picture is torn, or only something
    else in it, such as a clock, still changes.

    Args:
        rows: Of a picture that has at least twice as many, every second, third, ... row is compared.

    Attributes:
        frozen_s: How long old pictures have been received, in seconds; 0 after a new one.
    """

    def __init__(self, rows: int = _ROWS) -> None:
        self._rows = rows
        self.frozen_s = 0.0
        self._known = _Memory()
        self._passed_over = _Memory()
        self._tiles = _Tiles()
        self._unseen: tuple[_Sums, tuple[int, ...], int] | None = None
        self._hand_frozen_s = 0.0

    def why_refused(self, image: NDArray[np.uint8], dt_s: float, *, recorded: bool = False) -> str | None:
        """Return why ``image`` is not a new picture, in words; None if it is new.

        Args:
            image: (height, width, 3) uint8.
            dt_s: Seconds since the previous picture, >= 0.
            recorded: Whether it is from a recording, which may start again: it is compared with the last few only.
        """
        sums = _tile_sums(image, self._rows)
        print_ = _print_of(sums)
        most = _RECENT if recorded else _PICTURES
        if self._known.add(print_, most) or self._passed_over.has(print_, most):
            self.frozen_s += dt_s
            return f"the camera is frozen: the same picture for {self.frozen_s:.1f} s"
        self.frozen_s = 0.0
        self._unseen = sums, image.shape, min(most, _TILED_PICTURES)
        if image[:: max(1, len(image) // _GRID[0]), ::8].mean() < _BLACK:
            return "the picture is black: is the lens covered?"
        return None

    def pass_over(self, image: NDArray[np.uint8]) -> None:
        """Record a picture that is skipped: it is not new either when it comes again.

        Skipped pictures are stored separately, so any number of them does not displace the others.
        """
        self._passed_over.add(_print_of(_tile_sums(image, self._rows)), _PICTURES)

    def why_hand_refused(self, box: Box, dt_s: float) -> str | None:
        """Return why the hand in ``box`` of the last picture counts as stale, in words; None if it is current.

        Args:
            box: Left, top, right and bottom in pixels; the last two are exclusive.
            dt_s: Seconds since the previous picture, >= 0.
        """
        if self._unseen is not None:
            self._tiles.add(*self._unseen)
            self._unseen = None
        if not self._tiles.repeats(box):
            self._hand_frozen_s = 0.0
            return None
        self._hand_frozen_s += dt_s
        return f"the picture is torn: the hand's part of it is the same for {self._hand_frozen_s:.1f} s"


class _Memory:
    """The newest pictures, by their fingerprints."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self._next = 0

    def has(self, print_: int, most: int) -> bool:
        """Return whether the picture is among the last ``most``."""
        number = self._numbers.get(print_)
        return number is not None and self._next - number <= most

    def add(self, print_: int, most: int) -> bool:
        """Add the picture as the newest; return whether it was among the last ``most``."""
        is_known = self.has(print_, most)
        self._numbers.pop(print_, None)
        self._numbers[print_] = self._next
        self._next += 1
        if len(self._numbers) > _PICTURES:
            del self._numbers[next(iter(self._numbers))]
        return is_known


class _Tiles:
    """Fingerprints of each tile of the newest pictures, 16 bits each."""

    def __init__(self) -> None:
        self._of_all = np.zeros((0, 0), np.uint16)
        self._shape: tuple[int, ...] = ()
        self._grid = (0, 0)
        self._count = self._most = 0

    def add(self, sums: _Sums, shape: tuple[int, ...], most: int) -> None:
        """Add a picture of ``shape``, to be compared with the last ``most``."""
        if shape != self._shape:
            self._shape, self._grid, self._count = shape, (sums.shape[0], sums.shape[1]), 0
            self._of_all = np.zeros((sums.size, _TILED_PICTURES), np.uint16)
        self._of_all[:, self._count % _TILED_PICTURES] = (sums >> np.uint64(48)).ravel()
        self._count += 1
        self._most = most

    def repeats(self, box: Box) -> bool:
        """Return whether nearly all tiles of ``box`` in the newest picture equal those of one earlier picture."""
        tiles = self._in(box)
        if not tiles or self._count < 2:
            return False
        tiles = tiles[:: -(-len(tiles) // _TILES_OF_A_HAND)]
        newest = (self._count - 1) % _TILED_PICTURES
        if self._most < _TILED_PICTURES:
            earlier = [(newest - 1 - back) % _TILED_PICTURES for back in range(min(self._most, self._count - 1))]
            of_all = self._of_all[np.ix_(tiles, [newest, *earlier])]
            newest = 0
        else:
            of_all = self._of_all[tiles, : min(self._count, _TILED_PICTURES)]
        equal = (of_all == of_all[:, newest, None]).view(np.uint8).sum(axis=0, dtype=np.uint8)
        equal[newest] = 0
        return int(equal.max()) >= len(tiles) - _may_differ(len(tiles))

    def _in(self, box: Box) -> list[int]:
        """Return the tiles that lie in ``box``; with few, those that overlap with it."""
        rows, columns = self._grid
        left, top, right, bottom = box
        height, width = self._shape[:2] if self._shape else (1, 1)
        for inward in (True, False):
            down = _tiles_between(top / height * rows, bottom / height * rows, rows, inward=inward)
            across = _tiles_between(left / width * columns, right / width * columns, columns, inward=inward)
            tiles = [row * columns + column for row in down for column in across]
            if len(tiles) >= _FEW_TILES:
                break
        return tiles


def _tiles_between(begin: float, end: float, count: int, *, inward: bool) -> range:
    first, last = (math.ceil(begin), math.floor(end)) if inward else (math.floor(begin), math.ceil(end))
    return range(max(0, first), min(count, last))


def _may_differ(tiles: int) -> int:
    """Return how many of the hand's tiles may change in a stale picture: where a pixel or a stamp does.

    At most 0.3 of a hand's tiles are equal in people's clips, of 240 kbit/s; of a photo that stands still, with noise
    of one grey level and JPEG quality 30, 0.75.
    """
    return 1 + tiles // 10 if tiles >= _FEW_TILES else 0


@lru_cache(maxsize=8)
def _factors(rows: int, words: int) -> _Sums:
    random = np.random.default_rng(0).integers(0, 2**64, (rows, words), dtype=np.uint64)
    return np.asarray(random | np.uint64(1), np.uint64)


def _tile_sums(image: NDArray[np.uint8], most_rows: int) -> _Sums:
    """Return a fingerprint of each tile, at most 30 rows of 40; the last few pixels of a side may be left out."""
    image = image[:: max(1, len(image) // most_rows)]
    if image[0].nbytes < 8:
        image = np.repeat(image, 8, axis=1)
    lines = image.reshape(len(image), -1)
    if lines.dtype != np.uint8 or lines.strides[1] != 1:
        lines = np.ascontiguousarray(lines).view(np.uint8)
    words = lines[:, : lines.shape[1] // 8 * 8].view(np.uint64)
    count = words.shape[1]
    high, wide = -(-len(words) // _GRID[0]), -(-count // _GRID[1])
    rows, columns = len(words) // high, count // wide
    # Multilinear hashing: a change of one word always shows, as its factor is odd.
    of_columns = np.einsum("rhc,hc->rc", words[: rows * high].reshape(rows, high, count), _factors(high, count))
    return np.add.reduceat(of_columns[:, : columns * wide], np.arange(0, columns * wide, wide), axis=1)


def _print_of(sums: _Sums) -> int:
    """Return the fingerprint of a picture, 64 bits."""
    return int((sums * _factors(*sums.shape)).sum())
