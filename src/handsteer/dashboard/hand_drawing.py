"""Drawings of hands from their landmarks, as SVG: no picture of a person is needed for them."""

import logging
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.config import SignsConfig
from handsteer.errors import ModelError
from handsteer.recognition.custom_signs import load_custom_model

log = logging.getLogger(__name__)

_SIZE: Final = 64
_MARGIN: Final = 6.0
_PALM: Final = (0, 1, 5, 9, 13, 17)
_FINGERS: Final = tuple(tuple(range(base, base + 4)) for base in (1, 5, 9, 13, 17))
_FARTHEST: Final = 1e6


def draw_hand(points: NDArray[Any], classes: str = "") -> str:
    """Return a hand as SVG, as its owner sees it in a mirror.

    Args:
        points: (21, 2 or more) finite landmarks in pixels, of an image that is not mirrored.
        classes: CSS classes of the drawing.
    """
    flat = np.asarray(points, np.float64)[:, :2] * (-1, 1)
    flat = flat - (flat.min(axis=0) + flat.max(axis=0)) / 2
    longest = max(float(np.ptp(flat, axis=0).max()), 1e-9)
    places = (flat * ((_SIZE - 2 * _MARGIN) / longest) + _SIZE / 2).round().astype(int)
    # An edge in the card's colour keeps fingers apart that lie in front of the palm or of each other.
    fingers = "".join(f'<path d="{line}" class="edge"/><path d="{line}" class="finger"/>' for line in _lines(places))
    palm = " ".join(_place(places[joint]) for joint in _PALM)
    return (
        f'<svg viewBox="0 0 {_SIZE} {_SIZE}" aria-hidden="true" class="landmarks {classes}">'
        f'<polygon points="{palm}" class="palm"/>{fingers}</svg>'
    )


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


def _lines(places: NDArray[np.int64]) -> list[str]:
    return ["M" + "L".join(_place(places[joint]) for joint in finger) for finger in _FINGERS]


def _place(place: NDArray[np.int64]) -> str:
    return f"{place[0]} {place[1]}"
