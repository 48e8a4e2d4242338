"""Pictures in a terminal, and single keys from it, for machines without a screen."""

import shutil
import sys
import time
from types import TracebackType
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

try:
    import select
    import termios
    import tty
except ImportError:  # not a POSIX system: no single keys then
    termios = None  # type: ignore[assignment]

_WIDEST: Final = 96
_PERIOD_S: Final = 0.1
_COLOUR_BITS: Final = 0xF0


class TerminalPicture:
    """Draws pictures in place, two pixels a character, with lines of text below, on a terminal that has true colour."""

    def __init__(self) -> None:
        self._lines = 0
        self._drawn_s = float("-inf")

    @staticmethod
    def possible() -> bool:
        """Return whether errors go to a terminal, where the picture is drawn so that output stays clean."""
        return sys.stderr.isatty()

    def draw(self, picture: NDArray[np.uint8], *text: str) -> None:
        """Draw ``picture``, (height, width, 3) uint8, BGR, and lines of ``text``, over what was drawn before.

        Pictures that come too fast for a remote terminal are skipped.
        """
        now_s = time.monotonic()
        if now_s - self._drawn_s < _PERIOD_S:
            return
        self._drawn_s = now_s
        columns, rows = shutil.get_terminal_size()
        width = max(8, min(columns - 1, _WIDEST, int((rows - len(text) - 1) * 2 * picture.shape[1] / picture.shape[0])))
        lines = [*half_blocks(picture, width), *(f"{line[: columns - 1]}\x1b[K" for line in text)]
        back = f"\x1b[{self._lines}F" if self._lines else ""
        sys.stderr.write(back + "\n".join(lines) + "\n")
        sys.stderr.flush()
        self._lines = len(lines)


def half_blocks(picture: NDArray[np.uint8], width: int) -> list[str]:
    """Return lines of ``width`` characters, each an upper half block in the colours of two pixels, one above the other.

    Args:
        picture: (height, width, 3) uint8, BGR.
        width: Of the lines, in characters.
    """
    height = max(2, round(width * picture.shape[0] / picture.shape[1])) // 2 * 2
    small = np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)[..., ::-1]
    small = small & np.uint8(_COLOUR_BITS)
    pairs = np.stack([small[0::2], small[1::2]], axis=2).tolist()
    lines = []
    for line in pairs:
        # Most neighbours have the same colours: those are not sent again.
        parts = [_colours(*pair) if at == 0 or pair != line[at - 1] else "▀" for at, pair in enumerate(line)]
        lines.append("".join(parts) + "\x1b[0m\x1b[K")
    return lines


def _colours(upper: list[int], lower: list[int]) -> str:
    inks = (";".join(map(str, colour)) for colour in (upper, lower))
    return "\x1b[38;2;{}m\x1b[48;2;{}m▀".format(*inks)


class Keys:
    """Single keys from the terminal, without Enter; none without a terminal."""

    def __init__(self) -> None:
        self._before: list[Any] | None = None
        self._space_s = float("-inf")
        self._pressed: list[str] = []

    @staticmethod
    def possible() -> bool:
        """Return whether single keys can be read from a terminal."""
        return termios is not None and sys.stdin is not None and sys.stdin.isatty()

    def __enter__(self) -> "Keys":
        if self.possible():
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        if self._before is not None:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
            self._before = None

    def pressed(self, key: str) -> bool:
        """Return whether ``key`` was pressed since the last call."""
        self._read()
        if key not in self._pressed:
            return False
        self._pressed.remove(key)
        return True

    def space_age_s(self) -> float:
        """Return how long ago the space key was last sent, in seconds; infinity if never."""
        self._read()
        return time.monotonic() - self._space_s

    def _read(self) -> None:
        while self._before is not None and select.select([sys.stdin], [], [], 0)[0]:
            key = sys.stdin.read(1)
            if not key:
                return
            if key == " ":
                self._space_s = time.monotonic()
            else:
                self._pressed = [*self._pressed[-8:], key]
