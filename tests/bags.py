"""What bags of tests show, and what keeps a machine busy while they are played."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera

SHOWN = ["Stop", "Forward", "Turn Left", "Stop"]
FRAMES = 40
PLAYS = int(os.environ.get("HANDSTEER_PLAYS", "2"))
"""So often a bag is played, quiet and beside load."""

BUSY = 2 * PLAYS
"""So many other processes take all the time that they get; other tests run beside these too."""

_FPS = 16
_BEGAN_NS = 1_500_000_000 * 10**9
"""Another day."""


def frames() -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Yield the stamp in ns and the picture, (240, 320, 3) uint8, BGR, of 2.5 seconds of a drawn hand."""
    clock = SteppedClock(0.0)
    config = VirtualHandConfig(script=" ".join(f"{sign}:{FRAMES / _FPS / len(SHOWN)}" for sign in SHOWN))
    camera = VirtualHandCamera(config, width=320, height=240, fps=float(_FPS), clock=clock)
    for number in range(FRAMES):
        clock.advance_to(number / _FPS)
        yield _BEGAN_NS + number * 10**9 // _FPS, camera.read().image


@contextmanager
def busy_machine() -> Iterator[Callable[[int], None]]:
    """Yield what keeps as many processes busy as it is told, until the end of the block."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        yield lambda count: processes.extend(
            subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)
        )
    finally:
        for process in processes:
            process.kill()
            process.wait()
