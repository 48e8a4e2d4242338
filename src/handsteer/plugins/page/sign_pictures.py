"""How signs look: drawings of the shipped signs, of hands from their landmarks, and of the virtual hand in motion.

All are as in a mirror, and none needs a picture of a person.
"""

import logging
from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from fastapi import FastAPI
from numpy.typing import NDArray
from starlette.responses import PlainTextResponse, Response

from handsteer.config import SignsConfig
from handsteer.errors import ModelError
from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render
from handsteer.plugins.virtual_hand.script import Motion
from handsteer.recognition.custom_signs import load_custom_model
from handsteer.types import BACKWARD, FORWARD, GO, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

log = logging.getLogger(__name__)

# The user's right hand in a mirror, in a box of 64 x 64: the palm, then the fingers as thick lines. The thumb is on the
# left, where a mirror shows the thumb of a right hand with its palm turned to it.
_PALM = '<rect x="20" y="30" width="26" height="26" rx="10" class="palm"/>'
_FINGER = '<path d="M{x} 34V{top}" class="finger"/>'
_FIST = _PALM + "".join(_FINGER.format(x=x, top=29) for x in (23, 30, 37, 43))
_TUCKED_THUMB = '<path d="M20 44L33 47" class="finger thumb"/>'
_THUMB_LEFT = _FIST + '<path d="M24 40L6 36" class="finger"/>'
_FINGERS = "".join(_FINGER.format(x=x, top=top) for x, top in ((23, 13), (30, 8), (37, 10), (43, 17)))
_OPEN_PALM = f'{_PALM}{_FINGERS}<path d="M22 46L9 34" class="finger"/>'
_INDEX_UP = _FIST + _FINGER.format(x=23, top=9) + _TUCKED_THUMB


def _svg(shapes: str, transform: str = "", classes: str = "") -> str:
    return (
        f'<svg viewBox="0 0 64 64" aria-hidden="true" class="{classes}"><g transform="{transform}">{shapes}</g></svg>'
    )


DRAWN: Mapping[str, tuple[str, str]] = {
    FORWARD: ("index finger up", _svg(_INDEX_UP)),
    BACKWARD: ("index finger down", _svg(_INDEX_UP, "rotate(180 32 32)")),
    STOP: ("open palm", _svg(_OPEN_PALM)),
    TURN_LEFT: ("thumb to your left", _svg(_THUMB_LEFT)),
    TURN_RIGHT: ("thumb to your right", _svg(_THUMB_LEFT, "matrix(-1 0 0 1 64 0)")),
    GO: ("closed fist", _svg(_FIST + _TUCKED_THUMB)),
}
"""How to hold the hand for each shipped sign, in words and as SVG."""

_ARROWS = "".join(
    f'<path d="M-6 -21L0 -29L6 -21" transform="translate(32 32) rotate({turn})"/>' for turn in (0, 90, 180, 270)
)
MOVED_FIST = _svg(
    f'<g transform="translate(10.5 5) scale(0.65)">{_FIST}{_TUCKED_THUMB}</g><g class="arrows">{_ARROWS}</g>'
)
TAUGHT = _svg(_OPEN_PALM, classes="taught")
"""Stands for a taught sign of which no drawing is known."""

_SIZE: Final = 64
_MARGIN: Final = 6.0
_PALM_JOINTS: Final = (0, 1, 5, 9, 13, 17)
_FINGER_JOINTS: Final = tuple(tuple(range(base, base + 4)) for base in (1, 5, 9, 13, 17))
_KNUCKLES: Final = (5, 9, 13, 17)
_TIPS: Final = (4, 8, 12, 16, 20)
_FARTHEST: Final = 1e6


def draw_hand(points: NDArray[Any]) -> str:
    """Return a hand as SVG, as its owner sees it in a mirror.

    ``points`` are (21, 2 or more) finite landmarks in pixels, of an image that is not mirrored.
    """
    places = _in_box(points)
    # An edge in the card's colour keeps fingers apart that lie in front of the palm or of each other.
    fingers = "".join(f'<path d="{line}" class="edge"/><path d="{line}" class="finger"/>' for line in _lines(places))
    palm = " ".join(_place(places[joint]) for joint in _PALM_JOINTS)
    return (
        f'<svg viewBox="0 0 {_SIZE} {_SIZE}" aria-hidden="true" class="landmarks">'
        f'<polygon points="{palm}" class="palm"/>{fingers}</svg>'
    )


def draw_joints(points: NDArray[Any]) -> str:
    """Return a hand as SVG with each of its bones and joints; see :func:`draw_hand`."""
    places = _in_box(points)
    bones = "".join(f'<path d="{line}" class="bone"/>' for line in _lines(places, wrist=True))
    across = f'<path d="M{"L".join(_place(places[joint]) for joint in _KNUCKLES)}" class="bone"/>'
    joints = "".join(
        f'<circle cx="{x}" cy="{y}" r="2" class="{"tip" if joint in _TIPS else "joint"}"/>'
        for joint, (x, y) in enumerate(places)
    )
    return f'<svg viewBox="0 0 {_SIZE} {_SIZE}" aria-hidden="true" class="joints">{across}{bones}{joints}</svg>'


def taught_drawings(signs: SignsConfig) -> Mapping[str, str]:
    """Return the drawing of each taught sign of the model in use; may be empty.

    Reads the model's file if it has changed, which takes milliseconds.
    """
    if signs.model is None:
        return {}
    path = signs.model.expanduser()
    try:
        return _drawings(path, path.stat().st_mtime_ns)
    except (OSError, ModelError) as error:
        log.warning("taught signs are shown without drawings: %s", error)
        return {}


@lru_cache(maxsize=4)
def _drawings(path: Path, _changed_ns: int) -> Mapping[str, str]:
    model = load_custom_model(path)
    hands = model.trained_on.get("hands")
    known = hands if isinstance(hands, dict) else {}
    found = {label: _points(known.get(label)) for label in model.labels}
    return {label: draw_hand(points) for label, points in found.items() if points is not None}


def _points(sent: object) -> NDArray[np.float64] | None:
    """Return the landmarks in an untrusted file; None if they are none."""
    try:
        points = np.array(sent, np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return points if points.shape == (21, 2) and (np.abs(points) <= _FARTHEST).all() else None


def _in_box(points: NDArray[Any]) -> NDArray[np.int64]:
    """Return (21, 2) landmarks mirrored, and scaled into the box of a drawing."""
    flat = np.asarray(points, np.float64)[:, :2] * (-1, 1)
    flat = flat - (flat.min(axis=0) + flat.max(axis=0)) / 2
    longest = max(float(np.ptp(flat, axis=0).max()), 1e-9)
    places: NDArray[np.int64] = np.rint(flat * ((_SIZE - 2 * _MARGIN) / longest) + _SIZE / 2).astype(np.int64)
    return places


def _lines(places: NDArray[np.int64], *, wrist: bool = False) -> list[str]:
    first = (0,) if wrist else ()
    return ["M" + "L".join(_place(places[joint]) for joint in (*first, *finger)) for finger in _FINGER_JOINTS]


def _place(place: NDArray[np.int64]) -> str:
    return f"{place[0]} {place[1]}"


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
