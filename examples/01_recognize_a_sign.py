"""Recognise the sign in a picture.

Run ``python examples/01_recognize_a_sign.py photo.jpg``; without a photo, a virtual hand is drawn.
"""

import sys
from pathlib import Path

from handsteer import Recognizer
from handsteer.cameras.files import read_photo
from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera


def main() -> None:
    if len(sys.argv) > 1:
        image = read_photo(Path(sys.argv[1]))  # like cv2.imread, but with clear errors, and rotated as in its EXIF data
    else:
        clock = SteppedClock()
        camera = VirtualHandCamera(VirtualHandConfig(script="Turn Left:5"), width=640, height=480, fps=30, clock=clock)
        clock.advance(2.0)
        image = camera.read().image

    recognition = Recognizer().recognize(image)
    print(f"{recognition.sign} ({recognition.confidence:.0%})")
    if recognition.hand is not None:
        wrist = recognition.hand.pixels[0]
        print(f"a {recognition.hand.handedness.lower()} hand, its wrist at {wrist[0]:.0f}, {wrist[1]:.0f} px")


if __name__ == "__main__":
    main()
