"""The signs as small drawings, for people who see the page for the first time."""

from dataclasses import dataclass

from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, STOP, TURN_LEFT, TURN_RIGHT

# The user's right hand as a mirror shows it, in a box of 64 x 64: palm, then the fingers as thick lines. The thumb is
# on the left, where a mirror shows the thumb of a right hand that turns its palm to it.
_PALM = '<rect x="20" y="30" width="26" height="26" rx="10" class="palm"/>'
_FINGER = '<path d="M{x} 34V{top}" class="finger"/>'
_FIST = _PALM + "".join(_FINGER.format(x=x, top=29) for x in (23, 30, 37, 43))
_TUCKED_THUMB = '<path d="M20 44L33 47" class="finger thumb"/>'
_THUMB_LEFT = '<path d="M24 40L6 36" class="finger"/>'

_OPEN_PALM = (
    _PALM
    + "".join(_FINGER.format(x=x, top=top) for x, top in ((23, 13), (30, 8), (37, 10), (43, 17)))
    + '<path d="M22 46L9 34" class="finger"/>'
)
_INDEX_UP = _FIST + _FINGER.format(x=23, top=9) + _TUCKED_THUMB
_TURN_LEFT = _FIST + _THUMB_LEFT


@dataclass(frozen=True)
class LegendEntry:
    """One sign and what it does.

    Attributes:
        sign: Its name on ``/gesture/hand_sign``.
        pose: How to hold the hand.
        effect: What the robot does.
        drawing: SVG.
    """

    sign: str
    pose: str
    effect: str
    drawing: str


def _svg(shapes: str, transform: str = "") -> str:
    return f'<svg viewBox="0 0 64 64" aria-hidden="true"><g transform="{transform}">{shapes}</g></svg>'


LEGEND: tuple[LegendEntry, ...] = (
    LegendEntry(FORWARD, "index finger up", "faster forward", _svg(_INDEX_UP)),
    LegendEntry(BACKWARD, "index finger down", "slower, then back", _svg(_INDEX_UP, "rotate(180 32 32)")),
    LegendEntry(STOP, "open palm", "stop at once", _svg(_OPEN_PALM)),
    LegendEntry(TURN_LEFT, "thumb to your left", "turn left", _svg(_TURN_LEFT)),
    LegendEntry(TURN_RIGHT, "thumb to your right", "turn right", _svg(_TURN_LEFT, "matrix(-1 0 0 1 64 0)")),
    LegendEntry(GO, "closed fist", "keep going", _svg(_FIST + _TUCKED_THUMB)),
)
