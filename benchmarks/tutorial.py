"""Our recognition compared with the tutorial's pipeline: CPU per frame, start-up and memory, in alternating runs.

Run ``python benchmarks/tutorial.py``. The tutorial's pipeline is that of the ROS 101 course's node: MediaPipe 0.10.21,
one hand, both confidences 0.7, a dense net, and drawing (``_tutorial_pipeline.py``). It runs in its own environment in
the user's cache, created on first use from ``tutorial-requirements.txt``. Ours is the default configuration, with and
without the annotated picture, which the node draws only for subscribers.

Each pipeline is a process that gets the same decoded frames, some dozens at a time, in turn. CPU time is that of all
threads. Every library may use one thread; MediaPipe decides on its own. Python modules are compiled beforehand for all.
Needs Linux, and the clips of hands.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import platformdirs

from handsteer.plugins.virtual_hand.renderer import make_background

HERE = Path(__file__).resolve().parent
VIDEOS = HERE.parents[1] / "shared" / "data" / "videos"
CACHE = platformdirs.user_cache_path("handsteer", appauthor=False) / "tutorial-mediapipe-0.10.21"
REQUIREMENTS = HERE / "tutorial-requirements.txt"
SLIDESHOW = "slideshow_emre_MIT_640x480.mp4"
CLIPS = {
    "hand tracked, clip 1": "dex-retargeting_human_hand_video_1280x720.mp4",
    "hand tracked, clip 2": "CoderEnko007_hand_544x960.mp4",
    "slide show, hands searched": SLIDESHOW,
}
NOBODY = "no hand, a room"
TUTORIAL, OURS, UNDRAWN = "tutorial", "handsteer", "handsteer, nothing drawn"
_PIPELINES = (TUTORIAL, OURS, UNDRAWN)
_LONGER_SIDE = 640
_CHUNK = 30
_FIRST_WITH_HAND = 30
"""First frame of the slide show with a hand."""
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Frames:
    """Some frames in a file.

    Attributes:
        file: The raw pixels.
        shape: (n, height, width, 3), uint8, BGR.
        dt_s: Seconds between frames.
    """

    file: Path
    shape: tuple[int, ...]
    dt_s: float

    def job(self, kind: str) -> str:
        """Return the job for a pipeline's process."""
        return json.dumps({"kind": kind, "frames": str(self.file), "shape": self.shape, "dt_s": self.dt_s})


class Pipeline:
    """One of the pipelines, in its own process.

    Args:
        name: Name of the pipeline in ``_pipeline_process.py``.
        python: The interpreter of its environment.
        log: File for its log.
    """

    def __init__(self, name: str, python: Path, log: Path) -> None:
        environment = {**os.environ, **dict.fromkeys(_THREADS, "1"), "PYTHONPYCACHEPREFIX": str(CACHE / "compiled")}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        self._name = name
        self._log = log
        self.began_s = time.perf_counter()
        with log.open("w") as output:
            self._process = subprocess.Popen(
                [python, HERE / "_pipeline_process.py", name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=output,
                env=environment,
                text=True,
            )

    def __enter__(self) -> "Pipeline":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def ask(self, job: str) -> dict[str, Any]:
        """Return the answer to ``job``."""
        assert self._process.stdin
        self._process.stdin.write(job + "\n")
        self._process.stdin.flush()
        return self.next_answer()

    def next_answer(self) -> dict[str, Any]:
        """Return its next answer."""
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"the pipeline {self._name} has ended unexpectedly:\n{self._log.read_text()[-2000:]}")
        return dict(json.loads(line))


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare our recognition with the tutorial's MediaPipe pipeline.")
    parser.add_argument("--videos", type=Path, default=VIDEOS, help="folder of the clips of hands")
    parser.add_argument("--frames", type=int, default=240, help="frames per clip")
    parser.add_argument("--starts", type=int, default=7, help="starts of each pipeline")
    options = parser.parse_args()
    reason = why_not(options.videos)
    if reason:
        print(f"skipped: {reason}")
        return
    with tempfile.TemporaryDirectory(prefix="handsteer-tutorial-") as folder:
        report_start(measure_start(options.videos, Path(folder), options.starts))
        report_cpu(measure_cpu(options.videos, Path(folder), options.frames))


def why_not(videos: Path) -> str | None:
    """Return why nothing can be measured here; None if everything, including the tutorial's environment, exists."""
    if sys.platform != "linux":
        return "the memory of a process is read from /proc, which needs Linux"
    missing = [name for name in CLIPS.values() if not (videos / name).is_file()]
    if missing:
        return f"{videos / missing[0]} does not exist: set the folder of the clips with --videos"
    return make_environment()


def make_environment() -> str | None:
    """Create the environment with the tutorial's packages if missing; return the reason for a failure."""
    stamp = CACHE / "requirements.txt"
    if stamp.is_file() and stamp.read_text() == REQUIREMENTS.read_text():
        return None
    print(f"creating an environment with MediaPipe in {CACHE}", file=sys.stderr)
    shutil.rmtree(CACHE, ignore_errors=True)
    install = [str(tutorial_python()), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]
    for command in (
        [sys.executable, "-m", "venv", str(CACHE)],
        [*install, "--only-binary=:all:", "--require-hashes", "--requirement", str(REQUIREMENTS)],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
            return f"MediaPipe 0.10.21, which is for Python up to 3.12, cannot be installed: {last}"
    shutil.copy(REQUIREMENTS, stamp)
    return None


def tutorial_python() -> Path:
    return CACHE / "bin" / "python"


def start(name: str, folder: Path) -> Pipeline:
    return Pipeline(name, tutorial_python() if name == TUTORIAL else Path(sys.executable), folder / f"{name}.log")


def measure_start(videos: Path, folder: Path, starts: int) -> dict[str, np.ndarray]:
    """Return the (starts, 3) wall s and CPU s from start to first result, and peak MB, of each pipeline."""
    slideshow = list(clip_frames(videos / SLIDESHOW, _FIRST_WITH_HAND + 4 * _CHUNK))[_FIRST_WITH_HAND:]
    frames = written(slideshow, folder / "start.raw", 1 / 12)
    rows: dict[str, list[tuple[float, float, float]]] = {TUTORIAL: [], OURS: []}
    for _ in range(starts + 1):
        for name, measured in rows.items():
            with start(name, folder) as pipeline:
                cpu_s = pipeline.ask(frames.job("start"))["cpu_s"]
                wall_s = time.perf_counter() - pipeline.began_s
                measured.append((wall_s, cpu_s, pipeline.next_answer()["peak_mb"]))
    # The first start compiles Python modules and fills the caches.
    return {name: np.array(measured[1:]) for name, measured in rows.items()}


def report_start(measured: dict[str, np.ndarray]) -> None:
    starts = len(measured[OURS])
    print(f"{f'{starts} starts each, median':34} {TUTORIAL:>10} {OURS:>10}   ratio (min to max)")
    for column, (title, unit) in enumerate(
        [("start to first result, wall", "s"), ("start to first result, CPU", "s"), ("peak memory", "MB")]
    ):
        theirs, ours = measured[TUTORIAL][:, column], measured[OURS][:, column]
        digits = 0 if unit == "MB" else 2
        ratios = ours / theirs
        print(
            f"{title:34} {np.median(theirs):7.{digits}f} {unit:2} {np.median(ours):7.{digits}f} {unit:2}   "
            f"{np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f})"
        )


def measure_cpu(videos: Path, folder: Path, count: int) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return the answers of each pipeline for each workload, one per round."""
    workloads: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for workload in (*CLIPS, NOBODY):
        answers: dict[str, list[dict[str, Any]]] = {name: [] for name in _PIPELINES}
        with ExitStack() as stack:
            pipelines = {name: stack.enter_context(start(name, folder)) for name in _PIPELINES}
            for number, frames in enumerate(chunks(workload, videos, folder, count)):
                # The order rotates, because the first one finds the caches as the others left them.
                turn = number % len(_PIPELINES)
                for name in (*_PIPELINES[turn:], *_PIPELINES[:turn]):
                    answers[name].append(pipelines[name].ask(frames.job("run")))
        # The first round includes loading the models.
        workloads[workload] = {name: each[1:] for name, each in answers.items()}
    return workloads


def chunks(workload: str, videos: Path, folder: Path, count: int) -> Iterator[Frames]:
    if workload == NOBODY:
        images, fps = rooms(count), 30.0
    else:
        images, fps = clip_frames(videos / CLIPS[workload], count), 30.0 if CLIPS[workload] != SLIDESHOW else 12.0
    waiting: list[np.ndarray] = []
    for image in images:
        waiting.append(image)
        if len(waiting) == _CHUNK:
            yield written(waiting, folder / "chunk.raw", 1 / fps)
            waiting = []


def clip_frames(clip: Path, count: int) -> Iterator[np.ndarray]:
    """Yield up to ``count`` frames of a clip, scaled so that the longer side equals a webcam's."""
    capture = cv2.VideoCapture(str(clip))
    for _ in range(count):
        done, image = capture.read()
        if not done:
            return
        scale = _LONGER_SIDE / max(image.shape[:2])
        yield cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else image


def rooms(count: int) -> Iterator[np.ndarray]:
    """Yield pictures of empty rooms, with a camera's noise."""
    random = np.random.default_rng(0)
    for number in range(count):
        if number % _CHUNK == 0:
            room = make_background("cluttered", 640, 480, seed=number).astype(np.int16)
        yield np.clip(room + random.integers(-4, 5, room.shape, np.int16), 0, 255).astype(np.uint8)


def written(images: list[np.ndarray], file: Path, dt_s: float) -> Frames:
    pixels = np.stack(images)
    pixels.tofile(file)
    return Frames(file, pixels.shape, dt_s)


def report_cpu(workloads: dict[str, dict[str, list[dict[str, Any]]]]) -> None:
    print(
        f"\n{'CPU per frame':32} {'pipeline':25} {'mean':>6} {'median':>7} {'hands':>6}   ratio of rounds (min to max)"
    )
    for workload, answers in workloads.items():
        theirs = round_means(answers[TUTORIAL])
        for name, rounds in answers.items():
            cpu_ms = np.concatenate([each["cpu_ms"] for each in rounds])
            hands = sum(each["hands"] for each in rounds) / len(cpu_ms)
            ratios = round_means(rounds) / theirs
            ratio = "" if name == TUTORIAL else f"{np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f})"
            print(
                f"{workload if name == TUTORIAL else '':32} {name:25} {cpu_ms.mean():6.2f} {np.median(cpu_ms):7.2f} "
                f"{hands:6.0%}   {ratio}"
            )


def round_means(rounds: list[dict[str, Any]]) -> np.ndarray:
    """Return the mean CPU milliseconds per frame of each round."""
    return np.array([np.mean(each["cpu_ms"]) for each in rounds])


if __name__ == "__main__":
    main()
