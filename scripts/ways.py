"""Counts the files of handsteer that a frame and a steering command pass: ``python -m scripts.ways``.

A stepped run of the graph is traced. A frame's way begins where ``Camera.read`` returns it and ends at
``Robot.command``; a steering command's begins at ``SteeringNode.steer``. A file counts if one of its functions is
called on the way; what camera and robot do inside does not.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Final

from handsteer.cameras import Camera, Frame
from handsteer.cameras.choose import open_camera
from handsteer.clock import SteppedClock
from handsteer.config import Config
from handsteer.graph import Graph
from handsteer.making import open_robot
from handsteer.robots import Robot

SOURCES: Final = Path(__file__).resolve().parents[1] / "src" / "handsteer"
_WARM_UP_S, _DURATION_S = 3.0, 2.0
_SCRIPT = "Stop:1 Forward:20"


class Way:
    """The files of one way at a time, and how often each was on one."""

    def __init__(self) -> None:
        self.passed: Counter[str] = Counter()
        self.ways: list[int] = []
        self._now: set[str] | None = None

    def begin(self) -> None:
        """Begin a way, instead of one that did not end."""
        self._now = set()

    def end(self) -> None:
        """End the way that has begun, if there is one."""
        if self._now:
            self.passed.update(self._now)
            self.ways.append(len(self._now))
        self._now = None

    @property
    def typical(self) -> int:
        """The median of the numbers of files."""
        return sorted(self.ways)[len(self.ways) // 2]

    @contextmanager
    def traced(self) -> Iterator[None]:
        """Note each file whose functions are called meanwhile."""
        sys.setprofile(self._note)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        if self._now is not None and event == "call":
            name = frame.f_code.co_filename
            if name.startswith(str(SOURCES)):
                self._now.add(str(Path(name).relative_to(SOURCES)))


class _Read:
    """A camera, after whose frames a way begins."""

    def __init__(self, camera: Camera, began: Callable[[], None]) -> None:
        self._camera, self._began = camera, began
        self.name, self.period_s, self.close = camera.name, camera.period_s, camera.close

    def read(self) -> Frame | None:
        profile = sys.getprofile()
        sys.setprofile(None)
        frame = self._camera.read()
        self._began()
        sys.setprofile(profile)
        return frame


class _Commanded:
    """A robot, at whose command a way ends."""

    def __init__(self, robot: Robot, ended: Callable[[], None]) -> None:
        self._robot, self._ended = robot, ended

    def command(self, linear_mps: float, angular_radps: float) -> None:
        self._ended()
        self._robot.command(linear_mps, angular_radps)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)


def _graph(way: Way, begins: Callable[[], None]) -> Graph:
    camera = {"source": "virtual", "width": 320, "height": 240}
    control = {"arming": "off", "engage": "off", "renew": "off"}
    config = Config.model_validate({"camera": camera, "control": control, "virtual_hand": {"script": _SCRIPT}})
    clock = SteppedClock()
    parts: dict[str, Any] = {
        "camera": _Read(open_camera(config, clock), begins),
        "robot": _Commanded(open_robot(config, clock), way.end),
    }
    return Graph(config, clock, **parts)


def way_of_a_frame() -> Way:
    """Return the ways of the frames of two seconds, in which a sign drives."""
    way = Way()
    with _graph(way, way.begin) as graph:
        graph.run_stepped(_WARM_UP_S)
        with way.traced():
            graph.run_stepped(_DURATION_S)
    return way


def way_of_steering() -> Way:
    """Return the ways of ten steering commands."""
    way = Way()
    with _graph(way, lambda: None) as graph:
        graph.steering.steer(0.0, 0.0)
        graph.run_stepped(_WARM_UP_S)
        for _ in range(10):
            way.begin()
            with way.traced():
                graph.steering.steer(0.3, 0.0)
                graph.run_stepped(0.1)
    return way


def main() -> None:
    """Print both ways: the files, and how many ways passed each."""
    for name, way in (("frame", way_of_a_frame()), ("steering command", way_of_steering())):
        print(f"A {name} passes {way.typical} files ({min(way.ways)} to {max(way.ways)}, {len(way.ways)} ways):")
        for file, count in way.passed.most_common():
            print(f"  {count:4d}  {file}")


if __name__ == "__main__":
    main()
