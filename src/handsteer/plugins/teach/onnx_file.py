"""A model of taught signs as an ONNX file, which ONNX Runtime runs without handsteer, described in ``docs/teach.md``.

The graph computes :meth:`~handsteer.recognition.custom_signs.CustomModel.confidences`, from landmarks on, in float64.
"""

import json
import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer import __version__
from handsteer.errors import ModelError, needing
from handsteer.recognition.custom_signs import CustomModel, Depth
from handsteer.recognition.features import (
    BONE_ENDS,
    INDEX_BASE,
    INDEX_TIP,
    KNUCKLES,
    LITTLE_BASE,
    PAIRS,
    THUMB_TIP,
    WRIST,
)
from handsteer.recognition.network import to_arrays
from handsteer.recognition.shipped_signs import SURE

with needing("the export as ONNX", "onnx", "onnx"):
    from onnx import NodeProto, TensorProto, helper, numpy_helper

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

_NEXT_BONES: Final = np.delete(np.arange(20), np.s_[::4])
"""All bones but the first of each digit."""


class _Graph:
    """Collects the nodes and constants of an ONNX graph.

    Attributes:
        nodes: In the order in which they can run.
        constants: The initializers.
    """

    def __init__(self) -> None:
        self.nodes: list[NodeProto] = []
        self.constants: list[TensorProto] = []
        self._known: dict[tuple[str, tuple[int, ...], bytes], str] = {}

    def __call__(self, operator: str, *inputs: str | ArrayLike, output: str = "", **attributes: Any) -> str:
        """Add a node; return the name of its output.

        Args:
            operator: Of the default domain.
            inputs: Names of values; or numbers, which become constants: int64 or, with a fraction, float64.
            output: The name of its output, by default one of its own.
            attributes: Those of the operator.
        """
        names = [value if isinstance(value, str) else self._constant(np.asarray(value)) for value in inputs]
        output = output or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, names, [output], **attributes))
        return output

    def numbers(self, name: str, values: NDArray[np.float32]) -> str:
        """Add a constant; return the name of its values as float64."""
        self.constants.append(numpy_helper.from_array(values, name))
        return self("Cast", name, to=TensorProto.DOUBLE)

    def part(self, points: str, indices: ArrayLike) -> str:
        """Return ``points[:, indices]``."""
        return self("Gather", points, indices, axis=1)

    def gaps(self, points: str, ends: ArrayLike, starts: ArrayLike) -> str:
        """Return ``points[:, ends] - points[:, starts]``."""
        return self("Sub", self.part(points, ends), self.part(points, starts))

    def squares(self, vectors: str, axes: list[int], *, keepdims: bool) -> str:
        """Return the sums of squares along ``axes``."""
        return self("ReduceSum", self("Mul", vectors, vectors), axes, keepdims=int(keepdims))

    def lengths(self, vectors: str, *, keepdims: bool = False) -> str:
        """Return the lengths of ``vectors`` along the last axis."""
        return self("Sqrt", self.squares(vectors, [-1], keepdims=keepdims))

    def unit(self, vectors: str) -> str:
        """Return ``vectors`` with the length 1 along the last axis, or 0."""
        return self("Div", vectors, self("Max", self.lengths(vectors, keepdims=True), 1e-9))

    def _constant(self, value: NDArray[Any]) -> str:
        key = (value.dtype.str, value.shape, value.tobytes())
        if key not in self._known:
            self._known[key] = f"constant_{len(self._known)}"
            self.constants.append(numpy_helper.from_array(value, self._known[key]))
        return self._known[key]


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
    graph = _Graph()
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


def _confidences(graph: _Graph, model: CustomModel) -> None:
    points, finite = zip(*(_finite(graph, name) for name in _INPUTS[model.depth]), strict=True)
    features = _hand_features(graph, points[0], points[1] if model.depth == "full" else None)
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


def _finite(graph: _Graph, name: str) -> tuple[str, str]:
    """Return the names of the input ``name`` as float64, 0 where it is not finite, and whether each hand (n, 1) is."""
    is_finite = graph("LessOrEqual", graph("Abs", name), np.finfo(np.float32).max)
    points = graph("Cast", graph("Where", is_finite, name, np.float32(0)), to=TensorProto.DOUBLE)
    all_of = graph("ReduceMin", graph("Cast", is_finite, to=TensorProto.INT32), [1, 2], keepdims=0)
    return points, graph("Cast", graph("Unsqueeze", all_of, [1]), to=TensorProto.BOOL)


def _chances(graph: _Graph, scaled: str, numbers: dict[str, str], layers: int) -> str:
    passed = scaled
    for layer in range(layers):
        passed = graph("Tanh", passed) if layer else passed
        passed = graph("Add", graph("MatMul", passed, numbers[f"weights_{layer}"]), numbers[f"biases_{layer}"])
    return graph("Slice", graph("Softmax", passed, axis=1), [0], [-1], [1])


def _near(graph: _Graph, scaled: str, best: str, numbers: dict[str, str], limit: float) -> str:
    centres = graph("Gather", numbers["centres"], graph("Squeeze", best, [1]))
    gaps = graph("MatMul", graph("Sub", scaled, centres), numbers["whitening"])
    distances = graph("Sqrt", graph("ReduceMean", graph("Mul", gaps, gaps), [1]))
    return graph("LessOrEqual", distances, limit)


def _hand_features(graph: _Graph, pixels: str, world: str | None) -> str:
    """Return the name of the (n, features) that ``custom_features`` gives; ``world`` is None for ``flat``."""
    points = world or pixels
    palm = graph("ReduceMean", graph.lengths(graph.gaps(points, KNUCKLES, [WRIST])), [1], keepdims=1)
    palm = graph("Max", palm, 1e-6)
    parts = [_bends(graph, points), graph("Div", _distances(graph, points), palm)]
    if world is not None:
        parts += [graph("Div", _distances(graph, _in_metres(graph, pixels, world)), palm), _facing(graph, world)]
    shape = graph("Clip", graph("Concat", *parts, axis=1), -5.0, 5.0)
    return graph("Concat", shape, *_directions(graph, pixels), axis=1)


def _bends(graph: _Graph, points: str) -> str:
    bones = graph.unit(graph.gaps(points, *BONE_ENDS))
    products = graph("Mul", graph.part(bones, _NEXT_BONES), graph.part(bones, _NEXT_BONES - 1))
    cosines = graph("Clip", graph("ReduceSum", products, [2], keepdims=0), -1.0, 1.0)
    # By the tangent of half the angle: ONNX Runtime has arc functions of float32 only, and in that precision the arc
    # cosine of a straight finger would be wrong by 0.02 degrees.
    ratios = graph("Div", graph("Sub", 1.0, cosines), graph("Max", graph("Add", cosines, 1.0), 1e-30))
    halves = graph("Atan", graph("Cast", graph("Sqrt", ratios), to=TensorProto.FLOAT))
    return graph("Mul", graph("Cast", halves, to=TensorProto.DOUBLE), 2.0)


def _distances(graph: _Graph, points: str) -> str:
    return graph.lengths(graph.gaps(points, PAIRS[:, 0], PAIRS[:, 1]))


def _in_metres(graph: _Graph, pixels: str, world: str) -> str:
    flat, image = (
        graph("Sub", points, graph("ReduceMean", points, [1]))
        for points in (graph("Gather", world, [0, 1], axis=2), pixels)
    )
    areas = [graph.squares(points, [1, 2], keepdims=True) for points in (flat, image)]
    return graph("Mul", image, graph("Sqrt", graph("Div", areas[0], graph("Max", areas[1], 1e-12))))


def _facing(graph: _Graph, world: str) -> str:
    a, b = (graph.gaps(world, end, WRIST) for end in (INDEX_BASE, LITTLE_BASE))
    first = graph("Mul", graph.part(a, [1, 2, 0]), graph.part(b, [2, 0, 1]))
    normal = graph("Sub", first, graph("Mul", graph.part(a, [2, 0, 1]), graph.part(b, [1, 2, 0])))
    length = graph("Max", graph.lengths(normal, keepdims=True), 1e-12)
    return graph("Div", graph("Abs", graph.part(normal, [2])), length)


def _directions(graph: _Graph, pixels: str) -> list[str]:
    knuckles = graph("ReduceMean", graph.part(pixels, KNUCKLES), [1], keepdims=0)
    thumb = graph.unit(graph("Sub", graph.part(pixels, THUMB_TIP), knuckles))
    across = graph.unit(graph.gaps(pixels, INDEX_BASE, LITTLE_BASE))
    palm = graph("Sub", knuckles, graph.part(pixels, WRIST))
    index = graph.gaps(pixels, INDEX_TIP, INDEX_BASE)
    return [graph.unit(each) for each in (index, graph("Add", thumb, across), palm)]
