"""Prints the errors of landmarks on videos of people: the constants of ``LandmarkErrors`` in the bench's ``hand_view``.

``python benchmarks/landmark_errors.py [VIDEO...]``, with videos of one hand in view, by default the clips of people.
The truth is not known: a smooth curve (a polynomial of second degree through 9 frames) stands for it, so slow errors
are not counted.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import video_frames
from handsteer.config import LandmarksConfig
from handsteer.recognition.landmarker import MediaPipeLandmarker

Array = NDArray[np.float64]

CLIPS = Path(__file__).parents[2] / "shared" / "data" / "videos"
ONE_HAND = ("CoderEnko007_hand_544x960.mp4", "dex-retargeting_human_hand_video_1280x720.mp4")
_WINDOW = 9


def measure(path: Path) -> tuple[Array, int, int]:
    """Return (N, 21, 4) errors of x, y, z and world z in palm lengths, of runs of frames with a hand; and the counts.

    The counts are those of frames without a hand between frames with one, and of all frames with one.
    """
    landmarker = MediaPipeLandmarker(LandmarksConfig(max_hands=1))
    errors, missed, found = [], 0, 0
    run: list[Array] = []
    gap = 0
    for frame in video_frames(path):
        hands = landmarker.detect(frame.image, search=True, dt_s=1 / 30)
        if not hands:
            gap += 1
            if len(run) >= _WINDOW:
                errors.append(_residuals(np.stack(run)))
            run = []
            continue
        missed += gap if found and gap < 15 else 0
        gap, found = 0, found + 1
        hand = hands[0]
        palm_px = float(np.linalg.norm(hand.pixels[9, :2] - hand.pixels[0, :2]))
        palm_m = float(np.linalg.norm(hand.world[9] - hand.world[0]))
        row = np.column_stack([hand.pixels / palm_px, hand.world / palm_m])
        run.append(row.astype(np.float64))
    if len(run) >= _WINDOW:
        errors.append(_residuals(np.stack(run)))
    return np.concatenate(errors), missed, found


def _residuals(track: Array) -> Array:
    """Return the (N - 8, 21, 6) differences from the local polynomial, scaled up for what it takes along."""
    times = np.arange(_WINDOW) - _WINDOW // 2
    basis = np.stack([times**0, times, times**2], axis=1).astype(float)
    hat = basis @ np.linalg.pinv(basis)
    middle = hat[_WINDOW // 2]
    windows = np.lib.stride_tricks.sliding_window_view(track, _WINDOW, axis=0)
    difference = track[_WINDOW // 2 : len(track) - _WINDOW // 2] - windows @ middle
    return np.asarray(difference / np.sqrt(1 - middle[_WINDOW // 2]))


def main(paths: list[str]) -> None:
    print("video                          apart  together  depth  world xy  world z  keep  missed")
    for path in map(Path, paths):
        errors, missed, found = measure(path)
        together = errors[:, :, :2].mean(axis=1)
        apart = errors[:, :, :2] - together[:, None]
        before, after = apart[:-1].reshape(-1), apart[1:].reshape(-1)
        keep = float((before * after).mean() / (apart**2).mean())
        figures = [_robust(apart), _robust(together), _robust(errors[:, :, 2]), _robust(errors[:, :, 3:5])]
        print(f"{path.name[:30]:30} " + "  ".join(f"{value:.4f}" for value in figures), end="  ")
        print(f"{_robust(errors[:, :, 5]):.4f}  {keep:.2f}  {missed}/{found}")


def _robust(values: Array) -> float:
    """Return the standard deviation, from the median of the absolute values."""
    return float(1.4826 * np.median(np.abs(values)))


if __name__ == "__main__":
    main(sys.argv[1:] or [str(CLIPS / name) for name in ONE_HAND])
