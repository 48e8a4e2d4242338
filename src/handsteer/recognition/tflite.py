"""A TensorFlow Lite model with a square picture as its input."""

import time
from pathlib import Path

import cv2
import numpy as np
from ai_edge_litert.interpreter import Interpreter
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt

_PER_LEVEL = np.float32(1 / 255)
_TRIES = 5
_BETWEEN_TRIES_S = 0.001


class PictureModel:
    """A model with one square RGB picture as its input, run on the CPU; not thread-safe.

    Args:
        path: The model file.
        threads: CPU threads to run it on.

    Attributes:
        side: Width and height of the input in pixels.

    Raises:
        ModelCorrupt: The file is not a model that can be run.
    """

    def __init__(self, path: Path, threads: int) -> None:
        try:
            self._interpreter = Interpreter(model_path=str(path), num_threads=threads)
            self._interpreter.allocate_tensors()
        except (RuntimeError, ValueError) as error:
            raise ModelCorrupt(f"{path}: not a model that can be run ({str(error).splitlines()[0]})") from None
        (picture,) = self._interpreter.get_input_details()
        self._input: int = picture["index"]
        self._outputs: list[int] = [output["index"] for output in self._interpreter.get_output_details()]
        self.side: int = int(picture["shape"][1])
        self._levels = np.empty((1, self.side, self.side, 3), np.float32)

    def run(self, picture: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the model's outputs for ``picture``, (side, side, 3) uint8 BGR; each without the batch dimension."""
        np.multiply(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), _PER_LEVEL, out=self._levels[0])
        # Copies: the interpreter refuses to run while anything, such as a logged error, holds a view of its memory.
        self._interpreter.set_tensor(self._input, self._levels)
        self._invoke()
        return [self._interpreter.get_tensor(output)[0] for output in self._outputs]

    def _invoke(self) -> None:
        for tries_left in reversed(range(_TRIES)):
            try:
                self._interpreter.invoke()
            except RuntimeError as error:
                # It counts references to its internal data; a thread that inspects all objects holds one too.
                if "internal data" not in str(error) or not tries_left:
                    raise
                time.sleep(_BETWEEN_TRIES_S)
            else:
                return
