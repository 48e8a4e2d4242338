"""A model of taught signs as an ONNX file, which ONNX Runtime runs without handsteer, described in ``docs/teach.md``.

The graph computes :meth:`~handsteer.recognition.custom_signs.CustomModel.confidences`, from landmarks on.
"""

import json
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from handsteer import __version__
from handsteer.errors import ModelError, needing
from handsteer.recognition.custom_signs import CustomModel, Depth
from handsteer.recognition.network import to_arrays
from handsteer.recognition.shipped_signs import SURE
from handsteer.training.custom.onnx_graph import OnnxGraph, hand_features

with needing("the export as ONNX", "onnx", "onnx"):
    from onnx import TensorProto, helper

FORMAT: Final = 1
"""Version of the inputs, the output and the metadata of the file."""

_OPSET: Final = 18
_IR_VERSION: Final = 8
"""That of the opset; a runtime refuses newer ones than it knows."""

_INPUTS: Final[dict[Depth, dict[str, int]]] = {"full": {"pixels": 2, "world": 3}, "flat": {"pixels": 2}}
"""Number of coordinates of each input."""

_MEANING: Final = {
    "pixels": "(hands, 21, 2) float32: the hand landmarks of MediaPipe, in its order, in pixels of an image that is "
    "not mirrored: x times the width, to the right, and y times the height, down",
    "world": "(hands, 21, 3) float32: the world landmarks of MediaPipe, in metres, of the same image",
    "confidences": "(hands, labels) float32, 0 to 1: 0 for all labels but the likeliest, for shapes unlike all "
    "training data, and for landmarks that are not finite; a likelihood at the label's threshold is a confidence of "
    f"{SURE:g}",
}
_FACTS: Final = ("handsteer", "persons", "signs", "sided", "made_hands", "seed")
"""What the file says of the training: no names of files or persons, and no landmarks."""


def save_onnx(model: CustomModel, path: Path) -> None:
    """Write ``model`` to the new file ``path``.

    Raises:
        ModelError: The file exists or cannot be written.
    """
    content = as_onnx(model)
    try:
        with path.open("xb") as file:
            try:
                file.write(content)
            except BaseException:
                path.unlink(missing_ok=True)
                raise
    except OSError as error:
        raise ModelError(f"cannot write the ONNX file {path}: {error.strerror}") from None


def as_onnx(model: CustomModel) -> bytes:
    """Return the content of an ONNX file of ``model``; the same for equal models."""
    sizes = _INPUTS[model.depth]
    inputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["hands", 21, sizes[name]]) for name in sizes]
    output = helper.make_tensor_value_info("confidences", TensorProto.FLOAT, ["hands", len(model.labels)])
    for value in (*inputs, output):
        value.doc_string = _MEANING[value.name]
    graph = OnnxGraph()
    _confidences(graph, model)
    file = helper.make_model(
        helper.make_graph(graph.nodes, "taught_signs", inputs, [output], graph.constants),
        opset_imports=[helper.make_opsetid("", _OPSET)],
        ir_version=_IR_VERSION,
        producer_name="handsteer",
        producer_version=__version__,
        model_version=FORMAT,
        doc_string="Hand signs that were taught to handsteer: from landmarks to confidences.",
    )
    helper.set_model_props(file, _metadata(model))
    content: bytes = file.SerializeToString()
    return content


def _metadata(model: CustomModel) -> dict[str, str]:
    properties: dict[str, Any] = {
        "format": FORMAT,
        "labels": model.labels,
        "thresholds": model.thresholds.tolist(),
        "sure": SURE,
        "depth": model.depth,
        "meaning": {name: _MEANING[name] for name in (*_INPUTS[model.depth], "confidences")},
        "trained_on": {name: model.trained_on[name] for name in _FACTS if name in model.trained_on},
    }
    return {name: json.dumps(value, sort_keys=True) for name, value in properties.items()}


def _confidences(graph: OnnxGraph, model: CustomModel) -> None:
    points, finite = zip(*(_finite(graph, name) for name in _INPUTS[model.depth]), strict=True)
    features = hand_features(graph, points[0], points[1] if model.depth == "full" else None)
    # As numbers of the model file, so that a model gives the same file before and after it was saved.
    numbers = {name: graph.numbers(name, each) for name, each in to_arrays(model.network, model.novelty).items()}
    scaled = graph("Mul", graph("Sub", features, numbers["mean"]), numbers["scale"])
    chances = _chances(graph, scaled, numbers, len(model.network.weights))
    best = graph("ArgMax", chances, axis=1, keepdims=1)
    counts = graph("Equal", best, np.arange(len(model.labels)))
    for limit in (_near(graph, scaled, best, numbers, model.novelty.limit), *finite):
        counts = graph("And", counts, limit)
    confidences = graph("Pow", chances, math.log(SURE) / np.log(model.thresholds))
    graph("Cast", graph("Where", counts, confidences, 0.0), to=TensorProto.FLOAT, output="confidences")


def _finite(graph: OnnxGraph, name: str) -> tuple[str, str]:
    """Return the names of the input ``name`` as float64, 0 where it is not finite, and whether each hand (n, 1) is."""
    is_finite = graph("LessOrEqual", graph("Abs", name), np.finfo(np.float32).max)
    points = graph("Cast", graph("Where", is_finite, name, np.float32(0)), to=TensorProto.DOUBLE)
    all_of = graph("ReduceMin", graph("Cast", is_finite, to=TensorProto.INT32), [1, 2], keepdims=0)
    return points, graph("Cast", graph("Unsqueeze", all_of, [1]), to=TensorProto.BOOL)


def _chances(graph: OnnxGraph, scaled: str, numbers: dict[str, str], layers: int) -> str:
    passed = scaled
    for layer in range(layers):
        passed = graph("Tanh", passed) if layer else passed
        passed = graph("Add", graph("MatMul", passed, numbers[f"weights_{layer}"]), numbers[f"biases_{layer}"])
    return graph("Slice", graph("Softmax", passed, axis=1), [0], [-1], [1])


def _near(graph: OnnxGraph, scaled: str, best: str, numbers: dict[str, str], limit: float) -> str:
    centres = graph("Gather", numbers["centres"], graph("Squeeze", best, [1]))
    gaps = graph("MatMul", graph("Sub", scaled, centres), numbers["whitening"])
    distances = graph("Sqrt", graph("ReduceMean", graph("Mul", gaps, gaps), [1]))
    return graph("LessOrEqual", distances, limit)
