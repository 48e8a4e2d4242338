"""The features of a hand as an ONNX graph: the same as ``custom_features``, in float64."""

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.errors import needing
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

with needing("the export as ONNX", "onnx", "onnx"):
    from onnx import NodeProto, TensorProto, helper, numpy_helper

_NEXT_BONES: Final = np.delete(np.arange(20), np.s_[::4])
"""All bones but the first of each digit."""


class OnnxGraph:
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


def hand_features(graph: OnnxGraph, pixels: str, world: str | None) -> str:
    """Return the name of the (n, features) of n hands.

    Args:
        graph: The graph to add the nodes to.
        pixels: Name of the (n, 21, 2) float64 landmarks in pixels.
        world: Name of the (n, 21, 3) float64 landmarks in metres; None for features of the image alone (``flat``).
    """
    points = world or pixels
    palm = graph("ReduceMean", graph.lengths(graph.gaps(points, KNUCKLES, [WRIST])), [1], keepdims=1)
    palm = graph("Max", palm, 1e-6)
    parts = [_bends(graph, points), graph("Div", _distances(graph, points), palm)]
    if world is not None:
        parts += [graph("Div", _distances(graph, _in_metres(graph, pixels, world)), palm), _facing(graph, world)]
    shape = graph("Clip", graph("Concat", *parts, axis=1), -5.0, 5.0)
    return graph("Concat", shape, *_directions(graph, pixels), axis=1)


def _bends(graph: OnnxGraph, points: str) -> str:
    bones = graph.unit(graph.gaps(points, *BONE_ENDS))
    products = graph("Mul", graph.part(bones, _NEXT_BONES), graph.part(bones, _NEXT_BONES - 1))
    cosines = graph("Clip", graph("ReduceSum", products, [2], keepdims=0), -1.0, 1.0)
    # By the tangent of half the angle: ONNX Runtime has arc functions of float32 only, and in that precision the arc
    # cosine of a straight finger would be wrong by 0.02 degrees.
    ratios = graph("Div", graph("Sub", 1.0, cosines), graph("Max", graph("Add", cosines, 1.0), 1e-30))
    halves = graph("Atan", graph("Cast", graph("Sqrt", ratios), to=TensorProto.FLOAT))
    return graph("Mul", graph("Cast", halves, to=TensorProto.DOUBLE), 2.0)


def _distances(graph: OnnxGraph, points: str) -> str:
    return graph.lengths(graph.gaps(points, PAIRS[:, 0], PAIRS[:, 1]))


def _in_metres(graph: OnnxGraph, pixels: str, world: str) -> str:
    flat, image = (
        graph("Sub", points, graph("ReduceMean", points, [1]))
        for points in (graph("Gather", world, [0, 1], axis=2), pixels)
    )
    areas = [graph.squares(points, [1, 2], keepdims=True) for points in (flat, image)]
    return graph("Mul", image, graph("Sqrt", graph("Div", areas[0], graph("Max", areas[1], 1e-12))))


def _facing(graph: OnnxGraph, world: str) -> str:
    a, b = (graph.gaps(world, end, WRIST) for end in (INDEX_BASE, LITTLE_BASE))
    first = graph("Mul", graph.part(a, [1, 2, 0]), graph.part(b, [2, 0, 1]))
    normal = graph("Sub", first, graph("Mul", graph.part(a, [2, 0, 1]), graph.part(b, [1, 2, 0])))
    length = graph("Max", graph.lengths(normal, keepdims=True), 1e-12)
    return graph("Div", graph("Abs", graph.part(normal, [2])), length)


def _directions(graph: OnnxGraph, pixels: str) -> list[str]:
    knuckles = graph("ReduceMean", graph.part(pixels, KNUCKLES), [1], keepdims=0)
    thumb = graph.unit(graph("Sub", graph.part(pixels, THUMB_TIP), knuckles))
    across = graph.unit(graph.gaps(pixels, INDEX_BASE, LITTLE_BASE))
    palm = graph("Sub", knuckles, graph.part(pixels, WRIST))
    index = graph.gaps(pixels, INDEX_TIP, INDEX_BASE)
    return [graph.unit(each) for each in (index, graph("Add", thumb, across), palm)]
