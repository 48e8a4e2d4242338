"""Builds the shipped ``hand_landmark_fast.tflite`` from MediaPipe's full model: ``make landmark-model``.

Most of its operations use 8-bit integers. The result depends only on the model and ``ranges.json`` (see ``ranges.py``),
and is reproducible with the same package versions. With ``--second``, ``hand_landmark_second.tflite`` is built in the
same way from the model that ``scripts/distilled_models/second_landmark.py`` trains, and ``ranges_second.json``. Needs
ai-edge-quantizer, which handsteer itself does not.
"""

import argparse
import hashlib
import json
import logging
from pathlib import Path
from typing import Final

import numpy as np
from ai_edge_quantizer import quantizer
from ai_edge_quantizer.qtyping import TFLOperationName
from folded import folded, operations

HERE: Final = Path(__file__).parent
SHIPPED: Final = HERE.parents[1] / "src" / "handsteer" / "recognition"

WHOLLY_INTEGER: Final = range(5, 42)
"""Operations on 8-bit integers, scaled by the measured ranges, from the first layer of 56x56 to the last of 14x14."""
INTEGER_INSIDE: Final = range(42, 56)
"""Only the convolutions are integer here, scaled for each picture; the values between them stay float.

In integers, the sums between these late layers would cost 0.5 to 0.8 mm of world landmarks each, the last convolution
23 mm, and each of the first layers, but for the third, 0.4 to 0.6 px (medians).
"""


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the 8-bit hand landmark model.")
    parser.add_argument("source", type=Path, help="MediaPipe's hand_landmark_full.tflite, or the second model")
    parser.add_argument("--second", action="store_true", help="build the model for second opinions")
    options = parser.parse_args()
    name = "second" if options.second else "fast"
    ranges, target = HERE / f"ranges{'_second' * options.second}.json", SHIPPED / f"hand_landmark_{name}.tflite"
    logging.getLogger().setLevel(logging.ERROR)
    model = quantized(folded(options.source.read_bytes()), json.loads(ranges.read_text(encoding="utf-8")))
    target.write_bytes(model)
    print(f"{target}: {len(model)} bytes, SHA-256 {hashlib.sha256(model).hexdigest()}")


def quantized(model: bytes, ranges: dict[str, list[float]]) -> bytes:
    """Return the folded ``model`` with most of its operations quantised.

    Args:
        model: As :func:`folded.folded` returns it.
        ranges: Smallest and largest output of each operation, by its name.
    """
    maker = quantizer.Quantizer(bytearray(model))
    for number, (kind, name, _) in enumerate(operations(model)):
        # The quantiser identifies an operation by the name of its output, followed by a semicolon.
        if number in WHOLLY_INTEGER:
            maker.add_static_config(f"^{name};", TFLOperationName(kind), activation_num_bits=8, weight_num_bits=8)
        elif number in INTEGER_INSIDE and kind == "CONV_2D":
            maker.add_dynamic_config(f"^{name};", TFLOperationName(kind), num_bits=8)
    bounds = {name: _bounds(low, high) for name, (low, high) in ranges.items()}
    return bytes(maker.quantize(bounds, enable_progress_bar=False, enable_progress_report=False).quantized_model)


def _bounds(low: float, high: float) -> dict[str, np.ndarray]:
    return {"min": np.full((1, 1, 1, 1), low, np.float32), "max": np.full((1, 1, 1, 1), high, np.float32)}


if __name__ == "__main__":
    main()
