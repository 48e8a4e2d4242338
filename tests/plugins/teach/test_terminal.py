import os
import pty
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from handsteer.plugins.teach.dataset import load_dataset
from handsteer.plugins.teach.terminal import half_blocks


def test_a_picture_is_lines_of_half_blocks_in_its_colours() -> None:
    picture = np.zeros((40, 80, 3), np.uint8)
    picture[:20] = (0, 0, 255)
    lines = half_blocks(picture, 20)
    assert len(lines) == 5
    assert all(line.count("▀") == 20 for line in lines)
    assert "38;2;240;0;0m" in lines[0]
    assert "38;2;0;0;0m" in lines[-1]


@pytest.mark.slow
def test_in_a_terminal_the_picture_is_shown_and_keys_are_read(tmp_path: Path) -> None:
    """With a real terminal: two takes by the space key, one of them undone, then the end."""
    path = tmp_path / "signs.npz"
    arguments = [
        *("signs", "collect", "--label", "Peace", "--dataset", str(path), "--hold"),
        *(
            "--camera",
            "virtual",
            "--virtual-hand.script",
            "Peace:60",
            "--camera.width",
            "320",
            "--camera.height",
            "240",
        ),
    ]
    child, terminal = pty.fork()
    if child == 0:
        os.execv(sys.executable, [sys.executable, "-m", "handsteer", *arguments])
    output = _Output(terminal)
    output.wait_for("hold the space key while you show Peace")
    assert "▀" in output.text
    for number in (1, 2):
        output.hold_space_until(f"takes: {number}")
    os.write(terminal, b"u")
    output.wait_for("takes: 1 ")
    os.write(terminal, b"q")
    output.wait_for("ended; the takes so far are in the file")
    output.wait_for("persons")
    os.waitpid(child, 0)
    assert len(load_dataset(path).takes) == 1


class _Output:
    """What a terminal shows, read as it comes."""

    def __init__(self, terminal: int) -> None:
        self._terminal = terminal
        self.text = ""
        self._place = 0
        os.set_blocking(terminal, False)

    def wait_for(self, words: str, seconds: float = 60.0) -> None:
        """Read on until ``words`` come, after those that were waited for before."""
        end = time.monotonic() + seconds
        while (at := self.text.find(words, self._place)) < 0:
            assert time.monotonic() < end, f"no {words!r} in the last of {self.text[-2000:]!r}"
            self._place = max(self._place, len(self.text) - len(words))
            self._read()
        self._place = at + len(words)

    def hold_space_until(self, words: str) -> None:
        """Hold the space key for a second and more, let it go, and wait for ``words``."""
        end = time.monotonic() + 1.5
        while time.monotonic() < end:
            os.write(self._terminal, b" ")
            self._read()
            time.sleep(0.05)
        self.wait_for(words)

    def _read(self) -> None:
        try:
            fresh = os.read(self._terminal, 1 << 16).decode(errors="replace")
        except BlockingIOError:
            time.sleep(0.02)
            return
        except OSError:  # the program has ended
            return
        self.text += fresh
