"""Trains the shipped ``palm_detection_fast.tflite``, so that hands are also found in grey, dark and noisy pictures.

MediaPipe's palm model (the teacher) sees pictures as they are and mirrored; a copy of it learns to see the same in them
after they were spoilt: in grey, other light, noise, cut off. Its size and speed stay as they are.

Run it with the photos that the tables of docs/signs.md call tuning, in handsteer's environment with PyTorch installed,
which nothing else needs::

    cd ../shared/data
    python .../scripts/distilled_models/palm.py hagrid-dev photos --videos videos/[Cd]*.mp4

Training takes 25 minutes on two cores, and does not give the same file byte for byte: PyTorch's sums differ between
processors, and the number of steps with time. ``make bench-signs`` says whether another one is better. The shipped file
is of the first form of this program, which gave a third of the grey pictures a tint.
"""

import argparse
import hashlib
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import torch
from distill import distilled, tensor
from network import Network
from palm_pictures import SIDE, Pictures
from torch.nn import functional

from handsteer.recognition.landmark_models import find_model

TARGET: Final = Path(__file__).parents[2] / "src" / "handsteer" / "recognition" / "palm_detection_fast.tflite"

_GRIDS: Final = ((8, 2), (16, 6))
"""Side of each grid's cells in pixels, and number of anchors in a cell, as in ``regions``."""
_BATCH: Final = 16
_SPOILT: Final = 0.8
_SURE: Final = 0.3
"""Score from which the teacher's box and keypoints count."""


def main() -> None:
    parser = argparse.ArgumentParser(description="Train the palm model.")
    parser.add_argument("folders", type=Path, nargs="+", help="photos of people, with an index.csv")
    parser.add_argument("--videos", type=Path, nargs="*", default=[], help="videos of people, for backgrounds")
    parser.add_argument("--minutes", type=float, default=25.0)
    parser.add_argument("--target", type=Path, default=TARGET)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    torch.manual_seed(0)
    pictures = Pictures(options.folders, options.videos, seed=11)
    model = distilled(
        find_model("palm_detection_full.tflite").read_bytes(),
        lambda teacher, learner: _loss(teacher, learner, pictures),
        options.minutes,
    )
    options.target.write_bytes(model)
    print(f"{options.target}: {len(model)} bytes, SHA-256 {hashlib.sha256(model).hexdigest()}")


def _loss(teacher: Network, learner: Network, pictures: Pictures) -> torch.Tensor:
    clean = [pictures.clean() for _ in range(_BATCH)]
    spoilt = [pictures.spoilt(each) if pictures.chance(_SPOILT) else each for each in clean]
    cut = [pictures.cut_off(each) for each in spoilt]
    # Palms whose middle is beyond the end of the frame do not count.
    x, y = np.floor(_anchors()).astype(int).T
    counted = torch.tensor(np.stack([seen[y, x] for _, seen in cut]), dtype=torch.float32)
    with torch.no_grad():
        boxes, logits = _seen_both_ways(teacher, tensor(clean))
        wanted = torch.sigmoid(logits)
    given_boxes, given = _run(learner, tensor([each for each, _ in cut]))
    given = given.clamp(-80, 80)
    errors = functional.binary_cross_entropy_with_logits(given, wanted, reduction="none")
    focus = 0.75 * (torch.sigmoid(given) - wanted).abs().detach() + 0.25 * wanted
    loss = (errors * focus * counted).sum() / (wanted * counted).sum().clamp(min=4)
    sure = (wanted > _SURE) & (counted > 0)
    if sure.any():
        size = boxes[sure][:, 2:3].clamp(min=8) / 10
        loss = loss + functional.smooth_l1_loss(given_boxes[sure] / size, boxes[sure] / size, beta=0.5)
    return loss


def _run(network: Network, picture: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the values (n, 2016, 18) and logits (n, 2016) for n pictures."""
    boxes, logits = network(picture)
    return boxes, logits[..., 0]


def _seen_both_ways(teacher: Network, picture: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the surer of each anchor's outputs for ``picture`` and for its mirror image."""
    boxes, logits = _run(teacher, picture)
    mirrored, order = _mirrored_anchors()
    other_boxes, other = _run(teacher, picture.flip(3))
    other_boxes, other = other_boxes[:, order] * mirrored, other[:, order]
    surer = other > logits
    return torch.where(surer[..., None], other_boxes, boxes), torch.maximum(logits, other).clamp(-80, 80)


def _mirrored_anchors() -> tuple[torch.Tensor, list[int]]:
    """Return the signs of the 18 values in a mirrored picture, and which anchor is at each one's place in it."""
    order: list[int] = []
    for cell, per_cell in _GRIDS:
        side, first = SIDE // cell, len(order)
        cells = np.arange(side * side).reshape(side, side)[:, ::-1].ravel()
        order += (first + cells[:, None] * per_cell + np.arange(per_cell)).ravel().tolist()
    signs = torch.ones(18)
    signs[[0, *range(4, 18, 2)]] = -1.0
    return signs, order


def _anchors() -> np.ndarray:
    """Return the (2016, 2) x and y of the anchors in pixels."""
    anchors = []
    for cell, per_cell in _GRIDS:
        along = (np.arange(SIDE // cell) + 0.5) * cell
        x, y = np.meshgrid(along, along)
        anchors.append(np.repeat(np.stack([x.ravel(), y.ravel()], axis=1), per_cell, axis=0))
    return np.concatenate(anchors)


if __name__ == "__main__":
    main()
