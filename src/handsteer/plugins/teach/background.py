"""Trains in a separate process with a single thread, so that a robot can be driven at the same time.

In the process of a graph, training would block the interpreter for the nodes, and the linear algebra library would use
all processors: if one is busy, its threads wait for each other, and training takes several times as long.
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
from handsteer.plugins.teach.dataset import Dataset
from handsteer.plugins.teach.report import TrainingReport
from handsteer.plugins.teach.train import train_signs
from handsteer.recognition.custom_signs import CustomModel
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model

Progress = Callable[[int, int], object]

_ONE_THREAD: Final = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")}
_ROOT: Final = Path(__file__).parents[3]


class BackgroundTraining:
    """One training in a separate process; arguments as for :func:`~handsteer.plugins.teach.train.train_signs`.

    Use it for one :meth:`run` only.
    """

    def __init__(self, dataset: Dataset, sided: Sequence[str] = ()) -> None:
        self._work = (dataset, tuple(sided))
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._cancelled = threading.Event()

    def run(self, progress: Progress = lambda _done, _of: None) -> tuple[CustomModel, TrainingReport] | None:
        """Train, and return the model and its report; None if cancelled.

        Args:
            progress: Called with the number of completed steps and of all steps.

        Raises:
            TrainingError: As for ``train_signs``; or the process ended early.
        """
        with self._lock:
            if self._cancelled.is_set():
                return None
            command = [sys.executable, "-P", "-m", __name__]
            path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH")]))
            environment = {**os.environ, **_ONE_THREAD, "PYTHONPATH": path}
            # A session of its own: Ctrl-C interrupts this process, which ends the other.
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, start_new_session=True
            )
        with self._process as process:
            try:
                answer = _follow(process, self._work, progress)
            finally:
                process.kill()
        if self._cancelled.is_set():
            return None
        if isinstance(answer, TrainingError):
            raise answer
        if answer is None:
            raise TrainingError(f"the training ended early, with exit code {process.returncode}")
        learnt: tuple[CustomModel, TrainingReport] = answer
        return learnt

    def cancel(self) -> None:
        """Cancel the training, if it is running; thread-safe."""
        with self._lock:
            self._cancelled.set()
            if self._process is not None:
                self._process.kill()


def _follow(process: "subprocess.Popen[bytes]", work: object, progress: Progress) -> Any:
    """Return the result of the process; None if it ended early."""
    assert process.stdin is not None
    assert process.stdout is not None
    with contextlib.suppress(OSError):
        process.stdin.write(pickle.dumps(work))
    with contextlib.suppress(OSError):
        process.stdin.close()
    with contextlib.suppress(EOFError, pickle.UnpicklingError):
        while True:
            kind, answer = pickle.load(process.stdout)
            if kind == "done":
                return answer
            progress(*answer)
    return None


def _main() -> None:
    """Read the work from standard input; write the progress and the result to standard output."""
    # Other output must not mix with the messages.
    out, sys.stdout = sys.stdout.buffer, sys.stderr

    def send(kind: str, answer: object) -> None:
        pickle.dump((kind, answer), out)
        out.flush()

    dataset, sided = pickle.load(sys.stdin.buffer)
    shipped = ShippedClassifier(load_model())
    try:
        send("done", train_signs(dataset, shipped, sided=sided, progress=lambda *steps: send("progress", steps)))
    except TrainingError as error:
        send("done", error)


if __name__ == "__main__":
    _main()
