"""Effect of teaching on the page on the recognition of a running graph, and duration of the training.

Run ``python benchmarks/teach.py``. A graph with the virtual hand runs at 640x480 and 30 frames per second, without
viewers of the page. The recognised frames per second are compared with those of the graph alone, just before. The last
row trains in the graph's own process instead, as the command line does.
"""

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from handsteer.config import SignsConfig, load
from handsteer.graph import Graph
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lessons import Lessons
from handsteer.plugins.teach.train import train_signs
from handsteer.recognition.recognizer import open_classifier

ALONE_S = 5.0
TRY_S = 8.0


class Rate:
    """Recognised frames per second, and the time per frame."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._began_s, self._began = time.monotonic(), self._count()

    def _count(self) -> int:
        return sum(self._graph.recognition.counts.values())

    def fps(self) -> float:
        return (self._count() - self._began) / (time.monotonic() - self._began_s)


def alone(graph: Graph) -> float:
    rate = Rate(graph)
    time.sleep(ALONE_S)
    return rate.fps()


def wait_until(condition: Callable[[], bool], lessons: Lessons) -> None:
    while not condition():
        if lesson := lessons.node("me"):
            lesson.attend()
        time.sleep(0.05)


def row(what: str, before: float, during: float, took_s: float) -> None:
    print(f"{what:<34} {before:6.1f} {during:6.1f} {during / before:8.0%} {took_s:8.1f}")


def main() -> None:
    print(f"{os.cpu_count()} processors, load before {os.getloadavg()[0]:.1f}, NumPy {np.__version__}\n")
    print(f"{'recognised frames per second':<34} {'alone':>6} {'then':>6} {'ratio':>8} {'took [s]':>8}")
    with tempfile.TemporaryDirectory() as folder:
        files = {"dataset": Path(folder) / "signs.npz", "model": Path(folder) / "mine.npz"}
        base = {"camera": {"source": "virtual"}, "virtual_hand": {"script": "Peace:600"}}
        with Graph(load(None, base, {"teach": {**files, "take_time": 1.5, "countdown": 0.0}})) as graph:
            graph.start()
            time.sleep(2.0)
            lessons = Lessons(graph)
            before = alone(graph)
            lessons.begin("me")
            lesson = lessons.node("me")
            assert lesson is not None
            rate, began_s = Rate(graph), time.monotonic()
            lesson.do(lambda of: of.add_class("Peace"))
            lesson.do(lambda of: of.record(of.state.classes[0].key))
            wait_until(lambda: lesson.state.recorded is None, lessons)
            row("takes are collected", before, rate.fps(), time.monotonic() - began_s)
            takes = lesson.do(Lesson.dataset)
            rate, began_s = Rate(graph), time.monotonic()
            lesson.train()
            wait_until(lambda: not lesson.state.is_training, lessons)
            row("training in its own process", before, rate.fps(), time.monotonic() - began_s)
            rate, began_s = Rate(graph), time.monotonic()
            time.sleep(TRY_S)
            row("learnt signs are tried", before, rate.fps(), time.monotonic() - began_s)
            lessons.close()
            time.sleep(1.0)
            before = alone(graph)
            rate, began_s = Rate(graph), time.monotonic()
            train_signs(takes, open_classifier(SignsConfig()))
            row("training in the graph's process", before, rate.fps(), time.monotonic() - began_s)


if __name__ == "__main__":
    main()
