"""Pictures that show how to hold the hand for a sign: the virtual hand rises and forms it."""

from functools import cache
from typing import Final

import cv2
import numpy as np
from fastapi import FastAPI
from numpy.typing import NDArray
from starlette.responses import PlainTextResponse, Response

from handsteer.hand.kinematics import pose_skeleton
from handsteer.hand.poses import Pinhole
from handsteer.hand.renderer import Look, make_background, render
from handsteer.hand.script import Motion
from handsteer.types import SIGNS

SIGN_PATH: Final = "/signs"

_SIZE_PX: Final = 240
_FOCAL_PX: Final = 1.75 * _SIZE_PX
_STEP_S: Final = 0.04
_RISES: Final = 9  # frames of the rising hand, which then holds the sign
_HOLDS_MS: Final = 1800
_QUALITY: Final = 80


@cache
def sign_picture(sign: str, *, still: bool = False) -> bytes:
    """Return a WebP file of a right hand that shows one of the shipped signs, as in a mirror.

    It is animated and repeats, or is ``still``. The first call for a sign takes some tenths of a second.

    Raises:
        PoseError: The virtual hand does not show ``sign``.
    """
    motion = Motion(f"NONE:1 {sign}:2")
    frames = [_frame(motion, 1.0 + _STEP_S * (number + 1)) for number in range(_RISES)]
    if still:
        return cv2.imencode(".webp", frames[-1], [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])[1].tobytes()
    animation = cv2.Animation()
    animation.frames = frames
    animation.durations = [round(1000 * _STEP_S)] * (_RISES - 1) + [_HOLDS_MS]
    return cv2.imencodeanimation(".webp", animation, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])[1].tobytes()


def _frame(motion: Motion, time_s: float) -> NDArray[np.uint8]:
    pose = motion.at(time_s).pose
    camera = Pinhole(_SIZE_PX, _SIZE_PX, _FOCAL_PX)
    background = make_background("plain", _SIZE_PX, _SIZE_PX)
    image = render(pose_skeleton(pose.angles), pose.view.placement("Right"), camera, Look(), background)
    return np.asarray(cv2.flip(image, 1), np.uint8)


def serve_sign_pictures(application: FastAPI) -> None:
    """Serve the picture of each shipped sign."""

    @application.get(f"{SIGN_PATH}/{{sign}}.webp")
    def picture(sign: str, still: bool = False) -> Response:
        if sign not in SIGNS:
            return PlainTextResponse("there is no picture of this sign", 404)
        content = sign_picture(sign, still=still)
        return Response(content, media_type="image/webp", headers={"Cache-Control": "private, max-age=3600"})
