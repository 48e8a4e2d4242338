"""``handsteer steering`` without a page, whose stick somebody holds: ``held_stick.py steering --transport dds …``."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from handsteer.cli import main, one_node

SPEED_MPS = 0.3
RELEASED = 15
"""Zeros before it is pushed."""


@contextmanager
def held(node: Any, config: Any) -> Iterator[None]:
    ended = threading.Event()

    def hold() -> None:
        for _ in range(RELEASED):  # who takes the stick has not pushed it yet, and the control may not hear it yet
            node.steer(0.0, 0.0)
            ended.wait(0.1)
        while not ended.wait(0.1):
            node.steer(SPEED_MPS, 0.0)

    threading.Thread(target=hold, daemon=True).start()
    yield
    ended.set()


one_node.JOBS["steering"] = replace(one_node.JOBS["steering"], companion=held)
main()
