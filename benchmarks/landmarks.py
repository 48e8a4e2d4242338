"""Time from a JPEG to the landmarks of a hand, compared with the parts that cannot be avoided.

Run ``python benchmarks/landmarks.py``, optionally with your own clip of a hand. All parts are timed in turn on each
frame, so that a busy machine slows them alike; the ratio is the median over frames. One thread.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np
from ai_edge_litert.interpreter import Interpreter

from handsteer.config import LandmarksConfig
from handsteer.recognition.landmark_models import find_hand_models
from handsteer.recognition.landmarker import MediaPipeLandmarker

CLIP = Path(__file__).parents[2] / "shared" / "data" / "videos" / "dex-retargeting_human_hand_video_1280x720.mp4"
PARTS = ("JPEG decode", "landmark model", "palm model", "JPEG to landmarks, hand tracked")


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the time from a 640x480 JPEG to the landmarks of a hand.")
    parser.add_argument("--clip", type=Path, default=CLIP, help="a video of one hand that stays in view")
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--model", choices=["fast", "full", "lite"], default="fast")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    report(measure(read_jpegs(options.clip, options.frames), options.model))


def read_jpegs(clip: Path, count: int) -> list[np.ndarray]:
    """Return the first frames of a clip, each as a JPEG file of 640x480."""
    capture = cv2.VideoCapture(str(clip))
    files: list[np.ndarray] = []
    while len(files) < count and (image := capture.read()[1]) is not None:
        files.append(cv2.imencode(".jpg", cv2.resize(image, (640, 480), interpolation=cv2.INTER_AREA))[1])
    if not files:
        raise SystemExit(f"{clip}: no frames; name a video with --clip")
    return files


def measure(files: list[np.ndarray], model: str) -> np.ndarray:
    """Return the (n, 4) seconds of each part, for the n frames with a tracked hand."""
    landmarker = MediaPipeLandmarker(LandmarksConfig(model=model))
    palm, landmark = (load(path) for path in find_hand_models(model)[:2])
    following = False
    rows = []
    for file in files:
        marks = [time.perf_counter()]
        decode(file)
        marks.append(time.perf_counter())
        landmark.invoke()
        marks.append(time.perf_counter())
        palm.invoke()
        marks.append(time.perf_counter())
        # As in the recogniser while a sign is shown.
        hands = landmarker.detect(decode(file), search=False)
        marks.append(time.perf_counter())
        if following:
            rows.append(np.diff(marks))
        following = bool(hands)
    return np.array(rows).reshape(-1, len(PARTS))


def decode(file: np.ndarray) -> np.ndarray:
    picture = cv2.imdecode(file, cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


def load(path: Path) -> Interpreter:
    interpreter = Interpreter(str(path), num_threads=1)
    interpreter.allocate_tensors()
    return interpreter


def report(seconds: np.ndarray) -> None:
    if not len(seconds):
        raise SystemExit("no hand was tracked in this clip; name another with --clip")
    milliseconds = seconds * 1000
    print(f"{f'{len(seconds)} frames of 640x480':34} median     p99")
    for name, values in zip(PARTS, milliseconds.T, strict=True):
        print(f"{name:34} {np.median(values):6.2f}  {np.percentile(values, 99):6.2f} ms")
    decoding, landmark, _, whole = seconds.T
    print(f"{'ratio to decode + landmark model':34} {np.median(whole / (decoding + landmark)):6.3f}")


if __name__ == "__main__":
    main()
