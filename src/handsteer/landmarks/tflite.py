"""One TensorFlow Lite model that looks at a square picture."""

from pathlib import Path

import cv2
import numpy as np
from ai_edge_litert.interpreter import Interpreter
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt

_PER_LEVEL = np.float32(1 / 255)


class PictureModel:
    """A model with one square RGB picture as its input, run on the CPU. Not for several threads at once.

    Args:
        path: The model file.
        threads: CPU threads to run it on.

    Attributes:
        side: Width and height of the input in pixels.

    Raises:
        ModelCorrupt: The file is no model that can be run.
    """

    def __init__(self, path: Path, threads: int) -> None:
        try:
            self._interpreter = Interpreter(model_path=str(path), num_threads=threads)
            self._interpreter.allocate_tensors()
        except (RuntimeError, ValueError) as error:
            raise ModelCorrupt(f"{path}: not a model that can be run ({str(error).splitlines()[0]})") from None
        (picture,) = self._interpreter.get_input_details()
        # Both are functions that return a view of the interpreter's own memory; a view must not outlive the call.
        self._input = self._interpreter.tensor(picture["index"])
        self._outputs = [self._interpreter.tensor(output["index"]) for output in self._interpreter.get_output_details()]
        self.side: int = int(picture["shape"][1])

    def run(self, picture: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the model's outputs for ``picture``, (side, side, 3) uint8 BGR; each without the batch dimension."""
        np.multiply(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), _PER_LEVEL, out=self._input()[0])
        self._interpreter.invoke()
        return [output()[0].copy() for output in self._outputs]
