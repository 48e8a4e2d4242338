"""A test that is run again runs alone."""

import fcntl
import threading
import time
from pathlib import Path

from tests.turns import Turns


class Runner:
    """A process that runs a test, as a thread."""

    def __init__(self, folder: Path, *, alone: bool) -> None:
        self.turns, self.runs = Turns(folder), threading.Event()
        threading.Thread(target=self._run, args=[alone], daemon=True).start()

    def _run(self, alone: bool) -> None:
        self.turns.begin(alone=alone)
        self.runs.set()


def test_tests_run_next_to_each_other_but_for_one_that_is_alone(tmp_path: Path) -> None:
    first, second = (Runner(tmp_path, alone=False) for _ in range(2))
    assert first.runs.wait(60)
    assert second.runs.wait(60)
    alone = Runner(tmp_path, alone=True)
    while is_open(tmp_path):
        time.sleep(0.01)
    third = Runner(tmp_path, alone=False)
    first.turns.end()
    assert not alone.runs.wait(0.1)
    assert not third.runs.is_set()
    second.turns.end()
    assert alone.runs.wait(60)
    assert not third.runs.wait(0.1)
    alone.turns.end()
    assert third.runs.wait(60)


def is_open(folder: Path) -> bool:
    """Return whether a test may start now, besides what is running."""
    with (folder / "entry").open("w") as entry:
        try:
            fcntl.flock(entry, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True
