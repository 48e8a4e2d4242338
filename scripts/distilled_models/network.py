"""MediaPipe's models of palms and of hand landmarks as networks of PyTorch, and back, so that they can be trained."""

from typing import Any, Final

import flatbuffers
import numpy as np
import torch
from ai_edge_litert import schema_py_generated as schema
from torch import nn
from torch.nn import functional

_KINDS: Final = {number: kind for kind, number in vars(schema.BuiltinOperator).items() if isinstance(number, int)}
_TYPES: Final = {schema.TensorType.FLOAT32: "<f4", schema.TensorType.FLOAT16: "<f2", schema.TensorType.INT32: "<i4"}
_ACTIVATIONS: Final = {0: lambda value: value, 1: functional.relu, 3: functional.relu6}
# From the axes of a file's weights to those of PyTorch's, by kind of operation, and back.
_AXES: Final = {"CONV_2D": (0, 3, 1, 2), "DEPTHWISE_CONV_2D": (3, 0, 1, 2), "FULLY_CONNECTED": (0, 1)}


class Network(nn.Module):  # type: ignore[misc]
    """The network of a model file, which gives the same values up to rounding, but the logits of probabilities.

    Args:
        content: The model file.
    """

    def __init__(self, content: bytes) -> None:
        super().__init__()
        self._model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(content, 0))
        (self._graph,) = self._model.subgraphs
        self._halves: dict[int, int] = {}
        self._trained: dict[str, tuple[int, tuple[int, ...] | None]] = {}
        self.weights = nn.ParameterDict()
        self._steps = []
        for number, operation in enumerate(self._graph.operators):
            kind = self._kind(operation)
            if kind == "DEQUANTIZE":
                self._halves[operation.outputs[0]] = operation.inputs[0]
                continue
            for place, tensor in enumerate(operation.inputs[1:] if kind in (*_AXES, "PRELU") else []):
                values = torch.tensor(self._constant(tensor).astype(np.float32))
                axes = _AXES.get(kind) if place == 0 else None
                name = f"{number:03d}_{place}"
                self.weights[name] = nn.Parameter(values.permute(axes).contiguous() if axes else values.reshape(-1))
                self._trained[name] = (self._halves.get(tensor, tensor), axes)
            self._steps.append((number, kind, operation))

    def forward(self, picture: torch.Tensor) -> list[torch.Tensor]:
        """Return the outputs for (n, 3, side, side) RGB pictures, 0 to 1, in the order of the file."""
        values = {self._graph.inputs[0]: picture}
        for number, kind, operation in self._steps:
            values[operation.outputs[0]] = self._run(number, kind, operation, values)
        return [values[output] for output in self._graph.outputs]

    def _run(self, number: int, kind: str, operation: Any, values: dict[int, torch.Tensor]) -> torch.Tensor:
        options, picture = operation.builtinOptions, values[operation.inputs[0]]
        if kind in _AXES:
            weights, bias = self.weights[f"{number:03d}_0"], self.weights[f"{number:03d}_1"]
            if kind == "FULLY_CONNECTED":
                return functional.linear(picture, weights, bias)
            groups = len(weights) if kind == "DEPTHWISE_CONV_2D" else 1
            if options.padding == schema.Padding.SAME:
                picture = functional.pad(picture, _same(picture, weights, options.strideH))
            done = functional.conv2d(picture, weights, bias, options.strideH, groups=groups)
            return _ACTIVATIONS[options.fusedActivationFunction](done)
        if kind == "PRELU":
            return functional.prelu(picture, self.weights[f"{number:03d}_0"])
        if kind == "ADD":
            return _ACTIVATIONS[options.fusedActivationFunction](picture + values[operation.inputs[1]])
        if kind == "CONCATENATION":
            return torch.cat([values[each] for each in operation.inputs], options.axis)
        return self._reshaped(kind, operation, picture)

    def _reshaped(self, kind: str, operation: Any, picture: torch.Tensor) -> torch.Tensor:
        options = operation.builtinOptions
        if kind == "LOGISTIC":
            return picture
        if kind == "MEAN":
            return picture.mean((2, 3))
        if kind == "MAX_POOL_2D":
            return functional.max_pool2d(picture, options.filterHeight, options.strideH)
        if kind == "PAD":
            _, rows, columns, channels = self._constant(operation.inputs[1]).tolist()
            return functional.pad(picture, (*columns, *rows, *channels))
        if kind == "RESIZE_BILINEAR":
            size = self._constant(operation.inputs[1]).tolist()
            return functional.interpolate(picture, size, mode="bilinear", align_corners=bool(options.alignCorners))
        assert kind == "RESHAPE", kind
        shape = self._graph.tensors[operation.outputs[0]].shape
        return picture.permute(0, 2, 3, 1).reshape(len(picture), *shape[1:])

    def file(self) -> bytes:
        """Return a model file with the weights of this network."""
        for name, (tensor, axes) in self._trained.items():
            values = self.weights[name].detach().numpy()
            stored = self._graph.tensors[tensor]
            if axes:
                values = values.transpose(np.argsort(axes))
            row = np.ascontiguousarray(values, _TYPES[stored.type]).reshape(-1)
            self._model.buffers[stored.buffer].data = row.view(np.uint8)
        builder = flatbuffers.Builder(0)
        builder.Finish(self._model.Pack(builder), b"TFL3")
        return bytes(builder.Output())

    def _kind(self, operation: Any) -> str:
        code = self._model.operatorCodes[operation.opcodeIndex]
        return str(_KINDS[max(code.builtinCode, code.deprecatedBuiltinCode)])

    def _constant(self, tensor: int) -> np.ndarray:
        stored = self._graph.tensors[self._halves.get(tensor, tensor)]
        content = bytes(self._model.buffers[stored.buffer].data)
        return np.frombuffer(content, _TYPES[stored.type]).reshape(stored.shape)


def _same(picture: torch.Tensor, weights: torch.Tensor, stride: int) -> tuple[int, int, int, int]:
    """Return the padding left, right, above and below with which the output is the input's size over ``stride``."""
    padding = []
    for side, kernel in ((picture.shape[3], weights.shape[3]), (picture.shape[2], weights.shape[2])):
        total = max((-(-side // stride) - 1) * stride + kernel - side, 0)
        padding += [total // 2, total - total // 2]
    left, right, above, below = padding
    return left, right, above, below
