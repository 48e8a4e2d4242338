"""The signs and their actions, with a drawing of each."""

from collections.abc import Mapping
from dataclasses import dataclass

from nicegui import ui

from handsteer.config import ControlConfig
from handsteer.control.effects import figures_of
from handsteer.dashboard.elements import box, card, switch, text
from handsteer.dashboard.state import PageState
from handsteer.types import BACKWARD, EFFECTS, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT, action_of

# The user's right hand in a mirror, in a box of 64 x 64: the palm, then the fingers as thick lines. The thumb is on the
# left, where a mirror shows the thumb of a right hand with its palm turned to it.
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
    """One sign and its action.

    Attributes:
        sign: Its name on ``/gesture/hand_sign``.
        pose: How to hold the hand.
        effect: What the robot does.
        figures: Step and limit; empty if not applicable.
        drawing: SVG.
    """

    sign: str
    pose: str
    effect: str
    figures: str
    drawing: str


def _svg(shapes: str, transform: str = "") -> str:
    return f'<svg viewBox="0 0 64 64" aria-hidden="true"><g transform="{transform}">{shapes}</g></svg>'


_DRAWN: Mapping[str, tuple[str, str]] = {
    FORWARD: ("index finger up", _svg(_INDEX_UP)),
    BACKWARD: ("index finger down", _svg(_INDEX_UP, "rotate(180 32 32)")),
    STOP: ("open palm", _svg(_OPEN_PALM)),
    TURN_LEFT: ("thumb to your left", _svg(_TURN_LEFT)),
    TURN_RIGHT: ("thumb to your right", _svg(_TURN_LEFT, "matrix(-1 0 0 1 64 0)")),
    GO: ("closed fist", _svg(_FIST + _TUCKED_THUMB)),
}
# A taught sign may have any shape.
_TAUGHT = ("taught", f'<svg viewBox="0 0 64 64" aria-hidden="true" class="taught">{_OPEN_PALM}</svg>')


def legend(signs: tuple[str, ...], rule: ControlConfig | None) -> tuple[LegendEntry, ...]:
    """Return the legend of ``signs``: shipped ones first, in the page's order.

    Args:
        signs: The signs that the classifier recognises.
        rule: Configures the signs' actions; None if unknown, which gives the default actions, without figures.
    """
    order = [*(sign for sign in _DRAWN if sign in signs), *(sign for sign in signs if sign not in _DRAWN)]
    return tuple(LegendEntry(sign, *_entry(sign, rule)) for sign in order)


def _entry(sign: str, rule: ControlConfig | None) -> tuple[str, str, str, str]:
    pose, drawing = _DRAWN.get(sign, _TAUGHT)
    action = action_of(sign, rule.actions if rule else {})
    # The semicolon precedes what does not change, which is left out for brevity.
    effect = EFFECTS[action].partition(";")[0]
    return pose, effect, figures_of(action, rule) if rule else "", drawing


class SignsPanel:
    """The signs and their actions as reported by the nodes; the active sign is highlighted."""

    def __init__(self) -> None:
        self._lit = NONE
        self._shown: tuple[LegendEntry, ...] = ()
        self._tiles: dict[str, ui.element] = {}
        with card("The signs", "panel legend"):
            self._signs = box("signs")
        self._fill(legend(SIGNS, None))

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        entries = legend(state.signs, state.rule)
        if entries != self._shown:
            self._fill(entries)
        if state.sign == self._lit:
            return
        for sign in {self._lit, state.sign} & self._tiles.keys():
            switch(self._tiles[sign], "seen", on=sign == state.sign)
        self._lit = state.sign

    def _fill(self, entries: tuple[LegendEntry, ...]) -> None:
        self._shown = entries
        self._lit = NONE
        self._signs.clear()
        with self._signs:
            self._tiles = {entry.sign: _tile(entry) for entry in entries}


def _tile(entry: LegendEntry) -> ui.element:
    with box("sign-tile") as tile:
        ui.html(entry.drawing, sanitize=False)
        with box("words"):
            text("name", entry.sign)
            text("pose", entry.pose)
            text("effect", entry.effect)
            if entry.figures:
                text("figures", entry.figures)
    return tile
