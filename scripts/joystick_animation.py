"""Makes the animation of the hand as a joystick: what the camera sees, and where the robot drives, from above.

It runs in stepped time, so the animation does not depend on the machine's speed.
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.clock import SteppedClock
from handsteer.config import load
from handsteer.errors import HandsteerError
from handsteer.graph import Graph
from handsteer.images import bgr_image
from handsteer.messages import IMAGE_ANNOTATED, Image
from handsteer.nodes.base import Node
from handsteer.transports.base import Received
from handsteer.types import Pose2D

OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "joystick.webp"
LARGEST_BYTES = 300_000
SCRIPT = "Stop:1 Go:0.8 Go@0,-0.06:2 Go@0.055,-0.055:1.6 Go@-0.055,-0.055:1.6 Go@0,-0.06:1.2 Stop:1"
SHOWN_S = 9.2
FRAMES_PER_S = 10
WIDTH, HEIGHT = 320, 240
QUALITY = 50

PX_PER_M = 48
GROUND, GRID, PATH, ROBOT = (36, 20, 13), (62, 44, 34), (214, 140, 90), (255, 176, 96)

Picture = NDArray[np.uint8]


class Recorder(Node):
    """Keeps the annotated pictures, each next to a map of the robot's path."""

    def __init__(self, graph: Graph) -> None:
        super().__init__("recorder", graph.transport, graph.clock)
        self.frames: list[Picture] = []
        self._robot = graph.robot
        self._path: list[Pose2D] = []
        self.subscribe(IMAGE_ANNOTATED, self._on_image)

    def _on_image(self, received: Received[Image]) -> None:
        state = self._robot.state
        self._path.append(state.odometry)
        if self.clock.now() * FRAMES_PER_S >= len(self.frames):
            seen = cv2.resize(bgr_image(received.message), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
            speed = f"{round(state.linear_mps, 1) + 0.0} m/s   {round(state.angular_radps, 1) + 0.0} rad/s"
            self.frames.append(np.hstack([seen, draw_map(self._path, speed)]))


def draw_map(path: list[Pose2D], words: str) -> Picture:
    """Return a (HEIGHT, HEIGHT, 3) map with the robot at the end of its ``path``; its start heads upwards."""

    def place(x: float, y: float) -> tuple[int, int]:
        return round(HEIGHT / 2 - y * PX_PER_M), round(HEIGHT - 36 - x * PX_PER_M)

    ground = np.full((HEIGHT, HEIGHT, 3), GROUND, np.uint8)
    for metres in range(-6, 7):
        across, up = place(0.0, metres)[0], place(metres, 0.0)[1]
        cv2.line(ground, (across, 0), (across, HEIGHT), GRID, 1)
        cv2.line(ground, (0, up), (HEIGHT, up), GRID, 1)
    cv2.polylines(ground, [np.array([place(each.x, each.y) for each in path])], False, PATH, 2, cv2.LINE_AA)
    forward = np.array([np.cos(path[-1].yaw), np.sin(path[-1].yaw)])
    left = np.array([-forward[1], forward[0]])
    robot = np.array([path[-1].x, path[-1].y])
    corners = [robot + 0.28 * forward, robot - 0.2 * forward + 0.18 * left, robot - 0.2 * forward - 0.18 * left]
    cv2.fillPoly(ground, [np.array([place(*corner) for corner in corners])], ROBOT, cv2.LINE_AA)
    cv2.putText(ground, words, (10, HEIGHT - 10), cv2.FONT_HERSHEY_DUPLEX, 0.45, (242, 222, 213), 1, cv2.LINE_AA)
    return ground


def main() -> None:
    sections = {"camera": {"source": "virtual"}, "virtual_hand": {"script": SCRIPT}, "control": {"mode": "joystick"}}
    with Graph(load(base={**sections, "robot": {"world": "empty"}}), SteppedClock()) as graph:
        recorder = Recorder(graph)
        graph.add(recorder)
        graph.run_stepped(SHOWN_S)
    animation = cv2.Animation()
    animation.frames = [cv2.cvtColor(frame, cv2.COLOR_BGR2BGRA) for frame in recorder.frames]
    animation.durations = [1000 // FRAMES_PER_S] * len(recorder.frames)
    cv2.imwriteanimation(str(OUT), animation, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    size = OUT.stat().st_size
    if size > LARGEST_BYTES:
        sys.exit(f"{OUT} has {size} bytes, more than {LARGEST_BYTES}")
    print(f"{OUT}: {size} bytes")


if __name__ == "__main__":
    try:
        main()
    except HandsteerError as error:
        sys.exit(str(error))
