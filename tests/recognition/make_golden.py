"""Makes ``golden.npz``: what MediaPipe 0.10.21's own ``mp.solutions.hands`` finds in the golden frames.

Run it in an environment of its own, Python 3.11 with nothing but ``pip install mediapipe==0.10.21``::

    python -m tests.recognition.make_golden

Arrays per group (``photos``, ``video``), one row a picture: ``found`` (n,) bool; ``pixels`` (n, 21, 3) x, y and z in
pixels; ``world`` (n, 21, 3) in metres; ``right`` (n,) MediaPipe's score for its own label "Right", which assumes a
mirrored picture. Rows without a hand are zero. ``photo_paths`` names the photos.
"""

from typing import Any

import cv2
import mediapipe as mp
import numpy as np

from tests.recognition.golden_frames import FIXTURE, photo_paths, read_photo, read_video


def golden(images: list[np.ndarray], *, static: bool) -> dict[str, np.ndarray]:
    """Return the arrays of one group."""
    n = len(images)
    found, right = np.zeros(n, bool), np.zeros(n, np.float32)
    pixels, world = np.zeros((n, 21, 3), np.float32), np.zeros((n, 21, 3), np.float32)
    with mp.solutions.hands.Hands(
        static_image_mode=static,
        max_num_hands=1,
        model_complexity=1,
        min_detection_confidence=0.5,
        min_tracking_confidence=0.5,
    ) as hands:
        for i, image in enumerate(images):
            result = hands.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
            if not result.multi_hand_landmarks:
                continue
            height, width = image.shape[:2]
            (label,) = result.multi_handedness[0].classification
            found[i] = True
            pixels[i] = _rows(result.multi_hand_landmarks[0]) * (width, height, width)
            world[i] = _rows(result.multi_hand_world_landmarks[0])
            right[i] = label.score if label.label == "Right" else 1 - label.score
    return {"found": found, "pixels": pixels, "world": world, "right": right}


def _rows(landmarks: Any) -> np.ndarray:
    return np.array([(point.x, point.y, point.z) for point in landmarks.landmark])


def main() -> None:
    paths = photo_paths()
    groups = {
        "photos": golden([read_photo(path) for path in paths], static=True),
        "video": golden(read_video(), static=False),
    }
    arrays: dict[str, Any] = {
        f"{group}_{name}": values for group, rows in groups.items() for name, values in rows.items()
    }
    np.savez_compressed(FIXTURE, photo_paths=paths, **arrays)
    print({group: f"{rows['found'].sum()} of {len(rows['found'])} found" for group, rows in groups.items()})  # noqa: T201


if __name__ == "__main__":
    main()
