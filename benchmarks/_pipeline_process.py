"""One of the pipelines that ``tutorial.py`` compares, in its own process.

``python _pipeline_process.py NAME`` reads jobs from standard input, one JSON object per line, and answers each with one
or two lines of JSON. A job names a file of raw frames (``frames``; uint8, BGR, of ``shape`` [n, height, width, 3]), the
seconds between frames (``dt_s``), and its ``kind``:

* ``start``: the first answer has the process's CPU seconds from its start to the end of the first frame (``cpu_s``);
  the second, after all frames, its peak memory in MB (``peak_mb``). One frame is in memory at a time.
* ``run``: the CPU milliseconds of each frame, over all threads of the process (``cpu_ms``), and the number of frames
  with a hand (``hands``).

This module imports only what a pipeline needs itself.
"""

import itertools
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

Step = Callable[[Any, float], bool]


def main() -> None:
    step = OPENERS[sys.argv[1]]()
    for line in sys.stdin:
        job = json.loads(line)
        (_start if job["kind"] == "start" else _run)(step, job)


def _start(step: Step, job: dict[str, Any]) -> None:
    import numpy as np  # noqa: PLC0415

    count, *shape = job["shape"]
    size = shape[0] * shape[1] * shape[2]
    for number in range(count):
        step(np.fromfile(job["frames"], np.uint8, size, offset=number * size).reshape(shape), job["dt_s"])
        if number == 0:
            _answer(cpu_s=time.process_time())
    _answer(peak_mb=_peak_mb())


def _run(step: Step, job: dict[str, Any]) -> None:
    import numpy as np  # noqa: PLC0415

    frames = np.fromfile(job["frames"], np.uint8).reshape(job["shape"])
    hands, marks = 0, [time.process_time()]
    for frame in frames:
        hands += step(frame, job["dt_s"])
        # Includes the work of a pipeline's threads between two frames.
        marks.append(time.process_time())
    _answer(cpu_ms=[(after - before) * 1000 for before, after in itertools.pairwise(marks)], hands=hands)


def _answer(**values: Any) -> None:
    print(json.dumps(values), flush=True)


def _peak_mb() -> float:
    """Return the peak resident memory of this process in MB, including libraries."""
    # Not from resource.getrusage, which includes the memory of the parent process.
    status = Path("/proc/self/status").read_text(encoding="ascii")
    (line,) = (line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024 / 1e6


def _tutorial() -> Step:
    import cv2  # noqa: PLC0415
    from _tutorial_pipeline import TutorialPipeline  # noqa: PLC0415

    cv2.setNumThreads(1)
    return TutorialPipeline().step


def _handsteer(*, drawing: bool) -> Step:
    import cv2  # noqa: PLC0415

    from handsteer.recognition.drawing import annotate  # noqa: PLC0415
    from handsteer.recognition.recognizer import Recognizer  # noqa: PLC0415

    cv2.setNumThreads(1)
    recognizer = Recognizer()

    def step(image: Any, dt_s: float) -> bool:
        recognition = recognizer.step(image, dt_s)
        if drawing:
            annotate(image, recognition)
        return recognition.hand is not None

    return step


OPENERS: dict[str, Callable[[], Step]] = {
    "tutorial": _tutorial,
    "handsteer": lambda: _handsteer(drawing=True),
    "handsteer, nothing drawn": lambda: _handsteer(drawing=False),
}

if __name__ == "__main__":
    main()
