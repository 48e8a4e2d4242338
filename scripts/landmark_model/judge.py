"""Compares the shipped 8-bit hand landmark model with MediaPipe's, on hands that it was not calibrated with.

Run ``python scripts/landmark_model/judge.py FOLDER...`` in the environment of handsteer, with folders of photos as
for ``crops.photos``. Uses one thread; the times are CPU times of both models, measured in turn.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np
from ai_edge_litert.interpreter import Interpreter
from crops import Half, crops, photos

from handsteer.config import Config
from handsteer.recognition.landmark_models import find_model
from handsteer.recognition.recognizer import Recognizer

MODELS = ("full", "fast")


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare the 8-bit hand landmark model with MediaPipe's.")
    parser.add_argument("folders", type=Path, nargs="+", help="photos of people, with an index.csv")
    parser.add_argument("--half", choices=["judge", "choose"], default="judge")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    report_landmarks(options.folders, options.half)
    report_signs(options.folders, options.half)


def report_landmarks(folders: list[Path], half: Half) -> None:
    models = [load(name) for name in MODELS]
    seconds, outputs = [], []
    for crop in crops(folders, half):
        marks, both = [time.process_time()], []
        for model in models:
            both.append(run(model, crop))
            marks.append(time.process_time())
        seconds.append(np.diff(marks))
        outputs.append(both)
    if not outputs:
        raise SystemExit("no hand is found in these photos")
    landmarks, presence, rightness, world = (np.array([[m[i] for m in both] for both in outputs]) for i in range(4))
    off = np.diff(landmarks.reshape(-1, 2, 21, 3)[..., :2], axis=1)
    off_mm = np.diff(world.reshape(-1, 2, 21, 3), axis=1) * 1000
    full, fast = np.median(seconds, axis=0) * 1000
    print(f"{len(outputs)} hands; CPU a picture: full {full:.2f} ms, fast {fast:.2f} ms, {fast / full:.3f}")
    print(f"landmarks, pixels of a 224 px picture: {spread(np.linalg.norm(off, axis=-1))}")
    print(f"world landmarks, mm:                   {spread(np.linalg.norm(off_mm, axis=-1))}")
    print(f"presence:                              {spread(np.abs(np.diff(presence[..., 0])))}")
    lost, flipped = ((value[:, 0, 0] > 0.5) != (value[:, 1, 0] > 0.5) for value in (presence, rightness))
    print(f"hands lost or found: {lost.sum()}; the other hand: {flipped.sum()}")


def load(model: str) -> Interpreter:
    interpreter = Interpreter(str(find_model(f"hand_landmark_{model}.tflite")), num_threads=1)
    interpreter.allocate_tensors()
    return interpreter


def run(model: Interpreter, crop: np.ndarray) -> list[np.ndarray]:
    model.set_tensor(model.get_input_details()[0]["index"], np.float32(crop[None] / 255))
    model.invoke()
    return [model.get_tensor(output["index"])[0] for output in model.get_output_details()]


def spread(values: np.ndarray) -> str:
    shares = ((50, "median"), (95, "p95"), (99.9, "p99.9"), (100, "most"))
    return ", ".join(f"{name} {np.percentile(values, share):.3g}" for share, name in shares)


def report_signs(folders: list[Path], half: Half) -> None:
    recognizers = [Recognizer(Config.model_validate({"landmarks": {"model": model}})) for model in MODELS]
    results = []
    for name, photo in photos(folders, half):
        both = []
        for recognizer in recognizers:
            recognizer.reset()
            recognition = recognizer.step(photo, 0.0)
            both.append((recognition.seen, recognition.hand is not None))
        results.append((name, both))
    changed = [(name, both) for name, both in results if both[0][0] != both[1][0]]
    found = np.array([[hand for _, hand in both] for _, both in results])
    print(f"{len(results)} photos: different sign {len(changed)} ({100 * len(changed) / len(results):.2f} %); ", end="")
    print(f"a hand is found in {found[:, 0].sum()} and {found[:, 1].sum()}")
    for name, ((full, _), (fast, _)) in changed:
        print(f"  {name}: full {full}, fast {fast}")


if __name__ == "__main__":
    main()
