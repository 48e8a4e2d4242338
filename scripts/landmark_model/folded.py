"""The hand landmark model with its weights as plain float32, which is what a quantiser takes.

MediaPipe ships the weights as float16, each behind an operation that makes float32 of it when the model is loaded.
"""

from typing import Any, Final

import flatbuffers
import numpy as np
from ai_edge_litert import schema_py_generated as schema

_OUTPUTS: Final = ("landmarks", "presence", "rightness", "world")
_KINDS: Final = {number: kind for kind, number in vars(schema.BuiltinOperator).items() if isinstance(number, int)}


def folded(content: bytes) -> bytes:
    """Return the model ``content`` without its float16; it computes the very same numbers.

    Operations are numbered from 0 in the order in which they run, and what one gives is called as :func:`operations`
    says, but for the model's own outputs.

    Args:
        content: ``hand_landmark_full.tflite`` of MediaPipe.
    """
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(content, 0))
    (graph,) = model.subgraphs
    _make_weights_float32(model)
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
    """Return kind, name and index of the output of each operation of the model ``content``, in their order."""
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(content, 0))
    (graph,) = model.subgraphs
    return [
        (_kind(model, each), graph.tensors[each.outputs[0]].name.decode(), int(each.outputs[0]))
        for each in graph.operators
    ]


def _kind(model: Any, operation: Any) -> str:
    code = model.operatorCodes[operation.opcodeIndex]
    return _KINDS[max(code.builtinCode, code.deprecatedBuiltinCode)]


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


def _drop_unused_tensors(graph: Any) -> None:
    used = sorted({int(i) for each in graph.operators for i in (*each.inputs, *each.outputs)})
    new = {old: number for number, old in enumerate(used)}
    graph.tensors = [graph.tensors[old] for old in used]
    for each in (graph, *graph.operators):
        each.inputs = [new[int(i)] for i in each.inputs]
        each.outputs = [new[int(i)] for i in each.outputs]


def _drop_unused_buffers(model: Any) -> None:
    buffers = model.buffers[:1]  # The format wants an empty one first.
    for tensor in model.subgraphs[0].tensors:
        data = model.buffers[tensor.buffer].data
        if data is not None and len(data):
            buffers.append(model.buffers[tensor.buffer])
            tensor.buffer = len(buffers) - 1
        else:
            tensor.buffer = 0
    model.buffers = buffers
    # It pointed at buffers, and describes the file that this is made from.
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
