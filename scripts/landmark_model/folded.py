"""The hand landmark model with float32 weights, which the quantiser needs, and without constant channels.

MediaPipe ships float16 weights, each followed by an operation that converts it to float32 when the model is loaded.
Nearly half of the inner channels of its late layers have no weights: their output is the same for any picture.
"""

from typing import Any, Final

import flatbuffers
import numpy as np
from ai_edge_litert import schema_py_generated as schema

_OUTPUTS: Final = ("landmarks", "presence", "rightness", "world")
_KINDS: Final = {number: kind for kind, number in vars(schema.BuiltinOperator).items() if isinstance(number, int)}


def folded(content: bytes) -> bytes:
    """Return the model ``content`` without float16 and constant channels; its results are the same up to rounding.

    Operations are numbered from 0 in the order in which they run; their outputs are named as in :func:`operations`,
    except the model's own.

    Args:
        content: ``hand_landmark_full.tflite`` of MediaPipe.
    """
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(content, 0))
    (graph,) = model.subgraphs
    _make_weights_float32(model)
    _drop_idle_channels(model)
    _drop_unused_tensors(graph)
    _drop_unused_buffers(model)
    for number, operation in enumerate(graph.operators):
        (output,) = operation.outputs
        if output not in graph.outputs:
            graph.tensors[output].name = f"{number:02d}_{_kind(model, operation)}".encode()
    model.signatureDefs = [_signature(graph)]
    builder = flatbuffers.Builder(0)
    builder.Finish(model.Pack(builder), b"TFL3")
    return bytes(builder.Output())


def operations(content: bytes) -> list[tuple[str, str, int]]:
    """Return kind, name and index of the output of each operation of the model ``content``, in order."""
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(content, 0))
    (graph,) = model.subgraphs
    return [
        (_kind(model, each), graph.tensors[each.outputs[0]].name.decode(), int(each.outputs[0]))
        for each in graph.operators
    ]


def _kind(model: Any, operation: Any) -> str:
    code = model.operatorCodes[operation.opcodeIndex]
    kind: str = _KINDS[max(code.builtinCode, code.deprecatedBuiltinCode)]
    return kind


def _make_weights_float32(model: Any) -> None:
    (graph,) = model.subgraphs
    kept = []
    for operation in graph.operators:
        if _kind(model, operation) != "DEQUANTIZE":
            kept.append(operation)
            continue
        half, single = graph.tensors[operation.inputs[0]], graph.tensors[operation.outputs[0]]
        weights = model.buffers[half.buffer].data.view(np.float16).astype("<f4")
        buffer = schema.BufferT()
        buffer.data = weights.view(np.uint8)
        single.buffer = len(model.buffers)
        model.buffers.append(buffer)
    graph.operators = kept


def _drop_idle_channels(model: Any) -> None:
    """Remove the channels that are constant because a depthwise convolution has no weights for them.

    Their contribution is added to the bias of the next layer.
    """
    (graph,) = model.subgraphs
    for middle in graph.operators:
        if _kind(model, middle) != "DEPTHWISE_CONV_2D":
            continue
        weights, bias = (_Array(model, index) for index in middle.inputs[1:])
        used = weights.values.any(axis=(0, 1, 2))
        constant = np.clip(bias.values[~used], 0, 6)  # The activation is ReLU6.
        (before,) = (each for each in graph.operators if each.outputs[0] == middle.inputs[0])
        narrowed, behind = [before.outputs[0], middle.outputs[0]], _readers(graph, middle)
        if _kind(model, behind[0]) == "MEAN":
            narrowed, behind = [*narrowed, behind[0].outputs[0]], _readers(graph, behind[0])
        for after in behind:
            last_weights, last_bias = (_Array(model, index) for index in after.inputs[1:])
            added = last_weights.values[..., ~used] @ constant
            last_bias.set(last_bias.values + added.reshape(-1))
            last_weights.set(last_weights.values[..., used])
        for array in (weights, bias):
            array.set(array.values[..., used])
        for index in before.inputs[1:]:
            array = _Array(model, index)
            array.set(array.values[used])
        for index in narrowed:
            graph.tensors[index].shape = np.array([*graph.tensors[index].shape[:-1], used.sum()], np.int32)


def _readers(graph: Any, operation: Any) -> list[Any]:
    return [each for each in graph.operators if each.inputs[0] == operation.outputs[0]]


class _Array:
    """Return the values of a constant tensor, whose buffer must not be shared."""

    def __init__(self, model: Any, index: int) -> None:
        self._tensor = model.subgraphs[0].tensors[index]
        self._buffer = model.buffers[self._tensor.buffer]

    @property
    def values(self) -> np.ndarray:
        values: np.ndarray = self._buffer.data.view("<f4").reshape(self._tensor.shape)
        return values

    def set(self, values: np.ndarray) -> None:
        self._tensor.shape = np.array(values.shape, np.int32)
        self._buffer.data = np.ascontiguousarray(values, "<f4").reshape(-1).view(np.uint8)


def _drop_unused_tensors(graph: Any) -> None:
    used = sorted({int(i) for each in graph.operators for i in (*each.inputs, *each.outputs)})
    new = {old: number for number, old in enumerate(used)}
    graph.tensors = [graph.tensors[old] for old in used]
    for each in (graph, *graph.operators):
        each.inputs = [new[int(i)] for i in each.inputs]
        each.outputs = [new[int(i)] for i in each.outputs]


def _drop_unused_buffers(model: Any) -> None:
    buffers = model.buffers[:1]  # The format requires an empty one first.
    for tensor in model.subgraphs[0].tensors:
        data = model.buffers[tensor.buffer].data
        if data is not None and len(data):
            buffers.append(model.buffers[tensor.buffer])
            tensor.buffer = len(buffers) - 1
        else:
            tensor.buffer = 0
    model.buffers = buffers
    # The metadata refers to buffers, and describes the original file.
    model.metadata = model.metadataBuffer = None


def _signature(graph: Any) -> Any:
    signature = schema.SignatureDefT()
    signature.signatureKey = b"serving_default"
    signature.subgraphIndex = 0
    signature.inputs = [_named("picture", graph.inputs[0])]
    signature.outputs = [_named(name, index) for name, index in zip(_OUTPUTS, graph.outputs, strict=True)]
    return signature


def _named(name: str, index: int) -> Any:
    entry = schema.TensorMapT()
    entry.name, entry.tensorIndex = name.encode(), index
    return entry
