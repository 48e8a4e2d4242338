"""Measures the output ranges of the hand landmark model's operations on pictures of hands, into ``ranges.json``.

Run ``python scripts/landmark_model/ranges.py FOLDER...`` in the environment of handsteer, with folders of photos as
for ``crops.photos``; with ``--second MODEL``, those of what ``scripts/distilled_models/second_landmark.py`` trains, on
pictures without colours, into ``ranges_second.json``. Only the ranges are stored; they identify no person.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
from ai_edge_litert.interpreter import Interpreter
from crops import crops
from folded import folded, operations

from handsteer.recognition.landmark_models import find_model

HERE = Path(__file__).parent
OPERATIONS = range(4, 42)
"""The operations that ``build.py`` quantises, and the one that provides their input."""
KEPT_PERCENT = 99.9
"""Outliers are clipped: a few large values would reduce the resolution of all others."""
SAMPLES = 2000
"""Values sampled per operation and picture."""


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the ranges for the 8-bit hand landmark model.")
    parser.add_argument("folders", type=Path, nargs="+", help="photos of people, with an index.csv")
    parser.add_argument("--crops", type=int, default=600, help="number of pictures of hands")
    parser.add_argument("--second", type=Path, metavar="MODEL", help="the model for second opinions")
    options = parser.parse_args()
    pictures = list(crops(options.folders, "choose"))
    source, target = find_model("hand_landmark_full.tflite"), HERE / "ranges.json"
    if options.second:
        # It was trained on pictures without colours.
        pictures = [cv2.cvtColor(cv2.cvtColor(each, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB) for each in pictures]
        source, target = options.second, HERE / "ranges_second.json"
    if not pictures:
        raise SystemExit("no hand is found in these photos")
    chosen = np.random.default_rng(0).permutation(len(pictures))[: options.crops]
    ranges = measured(source.read_bytes(), [pictures[i] for i in sorted(chosen)])
    lines = ",\n".join(f'"{name}": [{low:.4f}, {high:.4f}]' for name, (low, high) in ranges.items())
    target.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    json.loads(target.read_text(encoding="utf-8"))
    print(f"{target}: {len(ranges)} ranges from {len(chosen)} of {len(pictures)} hands")


def measured(content: bytes, pictures: list[np.ndarray]) -> dict[str, tuple[float, float]]:
    """Return the range of nearly all outputs of each operation, by the operation's name.

    Args:
        content: The model file.
        pictures: (224, 224, 3) uint8 RGB each.
    """
    model = folded(content)
    interpreter = Interpreter(model_content=model, experimental_preserve_all_tensors=True)
    interpreter.allocate_tensors()
    outputs = {name: index for _, name, index in operations(model)[OPERATIONS.start : OPERATIONS.stop]}
    numbers: dict[str, list[np.ndarray]] = {name: [] for name in outputs}
    random = np.random.default_rng(0)
    for picture in pictures:
        interpreter.set_tensor(interpreter.get_input_details()[0]["index"], np.float32(picture[None] / 255))
        interpreter.invoke()
        for name, index in outputs.items():
            numbers[name].append(random.choice(interpreter.get_tensor(index).ravel(), SAMPLES))
    cut = (100 - KEPT_PERCENT) / 2
    return {name: tuple(np.percentile(each, [cut, 100 - cut])) for name, each in numbers.items()}


if __name__ == "__main__":
    main()
