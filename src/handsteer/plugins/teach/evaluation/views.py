"""Transforms photos (flip, rotate, enlarge), and the signs they show accordingly."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.hand import Hand
from handsteer.types import BACKWARD, FORWARD, NONE, TURN_LEFT, TURN_RIGHT

_SMALL_PX = 400
_ENLARGED_PX = 480
_MARGIN = 0.3
# The largest tilt of a hand that still means the same direction.
_TILT_DEG = 30.0

# Directions in the image, in degrees clockwise from up. The image is not mirrored: the user's right is its left. A
# sideways index finger, and a thumb up or down, are not signs, but become one when rotated.
_DIRECTIONS: dict[tuple[str, str], tuple[str, float]] = {
    (FORWARD, ""): ("index", 0.0),
    (BACKWARD, ""): ("index", 180.0),
    (TURN_LEFT, ""): ("thumb", 90.0),
    (TURN_RIGHT, ""): ("thumb", 270.0),
    (NONE, "thumb_up"): ("thumb", 0.0),
    (NONE, "like"): ("thumb", 0.0),
    (NONE, "thumb_down"): ("thumb", 180.0),
    (NONE, "dislike"): ("thumb", 180.0),
    (NONE, "index_to_image_right"): ("index", 90.0),
    (NONE, "index_to_image_left"): ("index", 270.0),
}


@dataclass(frozen=True)
class View:
    """A transformation of pictures.

    Attributes:
        flip: Mirror left to right, which also swaps left and right hands.
        rotate_deg: Rotate clockwise by so many degrees, after the flip.
        enlarge: Pad and enlarge pictures below 400 px, because a camera does not frame a hand as tightly.
        grey: Remove the colours, as a grey camera does.
    """

    flip: bool = False
    rotate_deg: float = 0.0
    enlarge: bool = True
    grey: bool = False

    @property
    def name(self) -> str:
        """Its name in tables: ``raw`` or ``flipped``, with the rotation in degrees, and ``grey``."""
        turned = f" {self.rotate_deg:+g}" if self.rotate_deg else ""
        return ("flipped" if self.flip else "raw") + turned + (" grey" if self.grey else "")

    def picture(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the transformed ``image``, (height, width, 3) uint8; its size may change."""
        if self.enlarge and max(image.shape[:2]) < _SMALL_PX:
            image = _enlarged(image)
        if self.grey:
            image = np.asarray(cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR), np.uint8)
        if self.flip:
            image = np.asarray(cv2.flip(image, 1), np.uint8)
        return _turned(image, self.rotate_deg)

    def hand(self, hand: Hand) -> Hand:
        """Return ``hand`` as it would be found in the transformed picture."""
        pixels, world = hand.pixels.astype(np.float64), hand.world.astype(np.float64)
        width, height = hand.image_size
        handedness = hand.handedness
        if self.flip:
            pixels[:, 0] = width - pixels[:, 0]
            world[:, 0] *= -1
            handedness = "Left" if handedness == "Right" else "Right"
        turn = np.radians(self.rotate_deg)
        cos, sin = math.cos(turn), math.sin(turn)
        matrix = np.array([[cos, sin], [-sin, cos]])
        middle = np.array([width, height]) / 2
        new_width, new_height = (round(abs(cos) * a + abs(sin) * b) for a, b in ((width, height), (height, width)))
        pixels[:, :2] = (pixels[:, :2] - middle) @ matrix + np.array([new_width, new_height]) / 2
        world[:, :2] = world[:, :2] @ matrix
        points = (pixels / (new_width, new_height, new_width)).astype(np.float32)
        return Hand(
            points, world.astype(np.float32), handedness, hand.handedness_score, hand.presence, (new_width, new_height)
        )

    def truth(self, sign: str | None, kind: str = "") -> tuple[str | None, str]:
        """Return the sign and the kind of a picture of ``sign`` and ``kind`` after the transformation.

        A flip swaps ``Turn Left`` and ``Turn Right``. Half a turn swaps ``Forward`` and ``Backward``, and the turns
        too; few arms can hold such a hand, so these do not replace photos of people who show that sign. A quarter turn
        makes a turn of a thumb up or down, and the reverse; an index finger that points sideways is ``NONE``.
        A direction further than 30 degrees from all of these is not scored (None). ``Stop``, ``Go``, taught signs and
        all other kinds stay the same.
        """
        name = kind.lower().replace(" ", "_").replace("-", "_") if sign == NONE else ""
        pose = _DIRECTIONS.get((sign or "", name))
        if sign is None or pose is None:
            return sign, kind
        what, direction = pose
        seen = (-direction if self.flip else direction) + self.rotate_deg
        for (other_sign, other_kind), (other, towards) in _DIRECTIONS.items():
            if other == what and abs(math.remainder(seen - towards, 360.0)) <= _TILT_DEG:
                return other_sign, other_kind
        return None, kind


def _enlarged(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = image.shape[:2]
    y, x = round(_MARGIN * height), round(_MARGIN * width)
    padded = cv2.copyMakeBorder(image, y, y, x, x, cv2.BORDER_REPLICATE)
    scale = _ENLARGED_PX / max(padded.shape[:2])
    return np.asarray(cv2.resize(padded, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC), np.uint8)


def _turned(image: NDArray[np.uint8], clockwise_deg: float) -> NDArray[np.uint8]:
    quarters, rest = divmod(clockwise_deg % 360.0, 90.0)
    if rest == 0.0:
        return np.ascontiguousarray(np.rot90(image, -int(quarters)))
    height, width = image.shape[:2]
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -clockwise_deg, 1.0)
    cos, sin = np.abs(matrix[0, :2])
    new_width, new_height = math.ceil(width * cos + height * sin), math.ceil(width * sin + height * cos)
    matrix[:, 2] += (new_width - width) / 2, (new_height - height) / 2
    turned = cv2.warpAffine(image, matrix, (new_width, new_height), borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(turned, np.uint8)
