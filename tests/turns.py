"""Lets one of the processes that run the tests run a test alone, which no other test can upset."""

import fcntl
from pathlib import Path


class Turns:
    """A lock of all processes of a run: shared by those whose test does not mind the others, or held by one alone.

    Whoever waits to be alone keeps new tests from starting. A process that ends releases what it holds.

    Args:
        folder: Of the files that are locked, the same for all.
    """

    def __init__(self, folder: Path) -> None:
        self._entry = (folder / "entry").open("w")
        self._running = (folder / "running").open("w")

    def begin(self, *, alone: bool) -> None:
        """Wait for the others: all of them, or one that is alone or waits for that."""
        fcntl.flock(self._entry, fcntl.LOCK_EX)
        fcntl.flock(self._running, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        if not alone:
            fcntl.flock(self._entry, fcntl.LOCK_UN)

    def end(self) -> None:
        """Let the others go on."""
        for lock in (self._running, self._entry):
            fcntl.flock(lock, fcntl.LOCK_UN)
