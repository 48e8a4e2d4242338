"""``handsteer signs export``: taught signs for programs without handsteer."""

from pathlib import Path

from handsteer.cli.app import loads
from handsteer.cli.running import check_writable, say
from handsteer.errors import ModelError


@loads("handsteer.training.custom.onnx_file")
def export(model: Path, output: Path, /) -> int:
    """Write taught signs as an ONNX file, which computes their confidences from MediaPipe's landmarks.

    For example:
      handsteer signs export my-signs.npz my-signs.onnx

    ONNX Runtime runs the file without handsteer; docs/teach.md says how.

    Parameters
    ----------
    model
        File written by `signs train`, or downloaded from the page.
    output
        File to write; it must not exist.
    """
    from handsteer.recognition.custom_signs import load_custom_model
    from handsteer.training.custom.onnx_file import save_onnx

    if output.exists():
        raise ModelError(f"{output} exists already: give another name, nothing is overwritten")
    check_writable("OUTPUT", output, ModelError)
    learnt = load_custom_model(model)
    save_onnx(learnt, output)
    say(f"{', '.join(learnt.labels)}: as ONNX in {output}")
    return 0
