"""Time from the capture of a frame to the resulting Twist, compared with the landmark models' own time.

Run ``python benchmarks/latency.py``, optionally with your own clip. The whole graph runs as in ``handsteer run
--headless``, in real time; the models are timed within it, frame by frame, so that a busy machine slows both alike.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from ai_edge_litert.interpreter import Interpreter

from handsteer.config import CameraConfig, Config
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, HAND_SIGN, String, Twist
from handsteer.recognition import landmark_models
from handsteer.transports.base import Received

CLIP = Path(__file__).parents[2] / "shared" / "data" / "videos" / "dex-retargeting_human_hand_video_1280x720.mp4"
FACTOR, ALLOWANCE_MS = 1.5, 5.0


class TimedInterpreter(Interpreter):  # type: ignore[misc]
    """Adds up the models' time."""

    spent_s = 0.0

    def invoke(self) -> None:
        began_s = time.perf_counter()
        super().invoke()
        TimedInterpreter.spent_s += time.perf_counter() - began_s


def measure(source: str, duration_s: float) -> np.ndarray:
    """Return (n, 2) milliseconds: the models' own time, and capture to Twist, of each frame."""
    landmark_models.Interpreter = TimedInterpreter  # type: ignore[attr-defined]
    models: dict[float, float] = {}
    twists: dict[float, float] = {}
    with Graph(Config(camera=CameraConfig(source=source))) as graph:

        def on_sign(received: Received[String]) -> None:
            if received.captured_s is not None:
                models[received.captured_s] = TimedInterpreter.spent_s
                TimedInterpreter.spent_s = 0.0

        def on_twist(received: Received[Twist]) -> None:
            if received.captured_s is not None:
                twists[received.captured_s] = graph.clock.now() - received.captured_s

        graph.transport.subscribe("benchmark", HAND_SIGN, on_sign)
        graph.transport.subscribe("benchmark", CMD_VEL, on_twist)
        graph.start()
        graph.wait(duration_s)
    both = [(models[key], twists[key]) for key in models if key in twists]
    return np.array(both[10:]) * 1000  # the first frames warm up the models


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the time from the capture of a frame to the Twist.")
    parser.add_argument("--camera", default=str(CLIP), help="video, or any other camera")
    parser.add_argument("--duration", type=float, default=30.0, help="seconds")
    options = parser.parse_args()
    times = measure(options.camera, options.duration)
    over = times[:, 1] - FACTOR * times[:, 0]
    print(f"{len(times)} frames of {Path(options.camera).name}            median     p99")
    print(
        f"models' own time                       {np.median(times[:, 0]):8.1f} {np.percentile(times[:, 0], 99):8.1f} ms"
    )
    print(
        f"capture to Twist                       {np.median(times[:, 1]):8.1f} {np.percentile(times[:, 1], 99):8.1f} ms"
    )
    print(
        f"beyond {FACTOR} x the models' own, same frame {np.median(over):8.1f} {np.percentile(over, 99):8.1f} ms"
        f"   (limit {ALLOWANCE_MS:.0f})"
    )


if __name__ == "__main__":
    main()
