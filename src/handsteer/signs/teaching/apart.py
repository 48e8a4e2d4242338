"""Trains in a process of its own, so that a robot can be driven meanwhile.

Beside a graph, training in the same process would take the interpreter from the nodes, and the linear algebra library
all processors: where these are busy its threads wait for each other, and training takes ten times as long.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

from handsteer.errors import TrainingError
from handsteer.signs.model import load_model
from handsteer.signs.teaching.dataset import Dataset
from handsteer.signs.teaching.taught import TaughtModel
from handsteer.signs.teaching.train import TeachingReport, train_signs
from handsteer.signs.trained import TrainedClassifier

Progress = Callable[[int, int], object]

_ONE_THREAD: Final = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")}
_ROOT: Final = Path(__file__).parents[3]


class TrainingApart:
    """One training, in a process of its own; for one :meth:`run`.

    Args:
        dataset: As for :func:`~handsteer.signs.teaching.train.train_signs`.
        sided: Likewise.
    """

    def __init__(self, dataset: Dataset, sided: Sequence[str] = ()) -> None:
        self._work = (dataset, tuple(sided))
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._cancelled = threading.Event()

    def run(self, progress: Progress = lambda _done, _of: None) -> tuple[TaughtModel, TeachingReport] | None:
        """Train, and return what was learnt; None when it was cancelled meanwhile.

        Args:
            progress: Called with the number of steps that are done, and of all.

        Raises:
            TrainingError: As by ``train_signs``; or the process ended before it was done.
        """
        with self._lock:
            if self._cancelled.is_set():
                return None
            command = [sys.executable, "-P", "-m", __name__]
            path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH")]))
            environment = {**os.environ, **_ONE_THREAD, "PYTHONPATH": path}
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        with self._process as process:
            try:
                said = _follow(process, self._work, progress)
            finally:
                process.kill()
        if self._cancelled.is_set():
            return None
        if isinstance(said, TrainingError):
            raise said
        if said is None:
            raise TrainingError(f"the training ended before it was done, with exit code {process.returncode}")
        learnt: tuple[TaughtModel, TeachingReport] = said
        return learnt

    def cancel(self) -> None:
        """End the training, if it has not ended; may be called from any thread."""
        with self._lock:
            self._cancelled.set()
            if self._process is not None:
                self._process.kill()


def _follow(process: "subprocess.Popen[bytes]", work: object, progress: Progress) -> Any:
    """Return what the process came to; None when it ended before."""
    assert process.stdin is not None
    assert process.stdout is not None
    with contextlib.suppress(OSError):
        process.stdin.write(pickle.dumps(work))
    with contextlib.suppress(OSError):
        process.stdin.close()
    with contextlib.suppress(EOFError, pickle.UnpicklingError):
        while True:
            kind, said = pickle.load(process.stdout)
            if kind == "done":
                return said
            progress(*said)
    return None


def _main() -> None:
    """Take the work from standard input, and tell the progress and what comes of it on standard output."""
    # Whatever else is printed must not get between.
    out, sys.stdout = sys.stdout.buffer, sys.stderr

    def tell(kind: str, said: object) -> None:
        pickle.dump((kind, said), out)
        out.flush()

    dataset, sided = pickle.load(sys.stdin.buffer)
    shipped = TrainedClassifier(load_model())
    try:
        tell("done", train_signs(dataset, shipped, sided=sided, progress=lambda *steps: tell("progress", steps)))
    except TrainingError as error:
        tell("done", error)


if __name__ == "__main__":
    _main()
