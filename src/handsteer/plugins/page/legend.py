"""The card that shows what the hand does: the signs, or the hand as a joystick, as drawings with their effect."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Final
from urllib.parse import quote

from nicegui import ui

from handsteer.config import ControlConfig, SignsConfig
from handsteer.plugins.page.elements import box, button, switch, tag, text
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import FIELDS
from handsteer.plugins.page.sign_pictures import DRAWN, MOVED_FIST, SIGN_PATH, TAUGHT, taught_drawings
from handsteer.plugins.page.state import PageState
from handsteer.plugins.teach.effects import effect_words, figures_of
from handsteer.types import GO, SIGNS, STOP, action_of

_MOVE = "Move it"


@dataclass(frozen=True)
class LegendEntry:
    """One sign and its action.

    Attributes:
        sign: Its name on ``/gesture/hand_sign``; or a step of the hand as a joystick.
        pose: How to hold the hand.
        drawing: SVG.
        effect: What the robot does.
        figures: Step and limit; empty if not applicable.
    """

    sign: str
    pose: str
    drawing: str
    effect: str
    figures: str


def legend(
    signs: tuple[str, ...], rule: ControlConfig | None, taught: Mapping[str, str] = MappingProxyType({})
) -> tuple[LegendEntry, ...]:
    """Return the legend of ``signs``: shipped ones first, in the page's order.

    Args:
        signs: The signs that the classifier recognises.
        rule: Configures the signs' actions; None if unknown, which gives the default actions, without figures.
        taught: SVG of each taught sign; a palm for the others.
    """

    def entry(sign: str) -> LegendEntry:
        action = action_of(sign, rule.actions if rule else {})
        # The semicolon precedes what does not change, which is left out for brevity.
        effect = effect_words(action, rule).partition(";")[0]
        drawn = DRAWN.get(sign) or ("taught", taught.get(sign, TAUGHT))
        return LegendEntry(sign, *drawn, effect, figures_of(action, rule) if rule else "")

    order = [*(sign for sign in DRAWN if sign in signs), *(sign for sign in signs if sign not in DRAWN)]
    return tuple(entry(sign) for sign in order)


def joystick_legend(rule: ControlConfig) -> tuple[LegendEntry, ...]:
    """Return how the hand is a joystick, in three steps."""
    limits = f"up to {rule.max_linear:g} m/s and {rule.max_angular:g} rad/s"
    return (
        LegendEntry("Open the hand", *DRAWN[STOP], "ready; when held, stops at once", ""),
        LegendEntry("Close the fist", *DRAWN[GO], "holds the joystick: here is its middle", ""),
        LegendEntry(_MOVE, "closed fist", MOVED_FIST, "up is forward, down backward, sideways turns", limits),
    )


_SHOW: Final = "Show how to hold the hand"
_STEP: Final = 2
"""Step of the bars in percent, so that small changes are not sent."""
_DEFAULTS: Final = SignsConfig()

_STEPS = {STOP: "Open the hand", GO: "Close the fist"}


def active_entry(state: PageState) -> str:
    """Return the name of the entry to highlight; empty, or of no entry, if there is none."""
    if not state.is_joystick:
        return state.recognition.sign
    if state.control.source == "joystick" and not state.commanded.is_zero:
        return _MOVE
    return _STEPS.get(state.recognition.sign, "")


_MODE = FIELDS["control.mode"]
_REFUSAL = "only the driver can change it: ask to drive first"
_MODES = {"signs": "Signs", "joystick": "Joystick"}
_TITLES = {"signs": "The signs", "joystick": "The hand as a joystick"}


class LegendPanel:
    """What the hand does, as reported by the nodes, with the active sign or step highlighted.

    With ``settings``, the mode can be changed.
    """

    def __init__(self, page: Page, settings: Settings | None) -> None:
        self._page, self._settings = page, settings
        self._active = self._mode = ""
        self._shown: tuple[LegendEntry, ...] = ()
        self._signs: tuple[str, ...] = SIGNS
        self._taught: Mapping[str, str] = {}
        self._tiles: dict[str, _Tile] = {}
        self._bars: Bars = ((), 0)
        self._choices: dict[str, ui.element] = {}
        with ui.element("section").classes("card panel legend"):
            with box("head"):
                self._title = tag("h2", "", _TITLES["signs"])
                if settings is not None:
                    with box("choices").props('role="group" aria-label="What the hand is"'):
                        self._choices = {
                            mode: button(name, partial(self._choose, mode)) for mode, name in _MODES.items()
                        }
                    self._trouble = text("trouble", "").props('role="alert"')
            self._box = box("signs")
        self._fill(legend(SIGNS, None))

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        mode = "joystick" if state.is_joystick else "signs"
        if mode != self._mode:
            self._mode = mode
            self._title.set_text(_TITLES[mode])
            for name, choice in self._choices.items():
                choice.props(f'aria-pressed="{str(name == mode).lower()}"')
        is_new = state.signs != self._signs
        if is_new:
            self._bars = ((), 0)
            self._signs = state.signs
            if self._settings is not None:
                self._taught = taught_drawings(self._settings.running.signs)
        signs = legend(state.signs, state.rule, self._taught)
        entries = joystick_legend(state.rule) if state.rule and state.is_joystick else signs
        if entries != self._shown or is_new:
            self._fill(entries)
        active = active_entry(state)
        if active != self._active:
            for name in {self._active, active} & self._tiles.keys():
                switch(self._tiles[name].element, "seen", on=name == active)
            self._active = active
        self._show_bars(state)

    def _choose(self, mode: str) -> None:
        """Change the mode, if this viewer drives; it is not saved to the file."""
        if (settings := self._settings) is not None:
            self._trouble.set_text(self._page.change(lambda: settings.set(_MODE, mode), _REFUSAL))

    def _show_bars(self, state: PageState) -> None:
        """Show how confidently each sign is recognised; one message for all bars, because it changes at each update."""
        bars = bars_of(state)
        if bars == self._bars:
            return
        shown, self._bars = self._bars[0], bars
        shares, least = bars
        changed = [f"--bar-{n}: {share}%" for n, share in enumerate(shares) if shown[n : n + 1] != (share,)]
        self._box.style("; ".join([*changed, f"--least: {least}%"]))

    def _open(self, sign: str) -> None:
        """Show how to hold the hand for ``sign`` in its tile, or close it again; one tile is open at a time."""
        for name, tile in self._tiles.items():
            tile.open(on=name == sign and not tile.is_open)

    def _fill(self, entries: tuple[LegendEntry, ...]) -> None:
        self._shown = entries
        self._active = ""
        self._box.clear()
        with self._box:
            self._tiles = {
                entry.sign: _Tile(
                    entry, self._signs.index(entry.sign) if entry.sign in self._signs else None, self._open
                )
                for entry in entries
            }


Bars = tuple[tuple[int, ...], int]
"""The length of the bar of each sign, and the place of the threshold, in percent."""


def bars_of(state: PageState) -> Bars:
    """Return the bars of ``state``: how confidently each of its signs is recognised."""
    recognition = state.recognition
    confidences = recognition.confidences or (0.0,) * len(state.signs)
    shares = tuple(_STEP * round(100 * max(0.0, min(share, 1.0)) / _STEP) for share in confidences)
    least = _DEFAULTS.min_confidence if recognition.min_confidence is None else recognition.min_confidence
    return shares[: len(state.signs)], round(100 * least)


class _Tile:
    """One sign; opened, it shows how to hold the hand. ``number`` is that of its bar; None without one."""

    def __init__(self, entry: LegendEntry, number: int | None, on_click: Callable[[str], None]) -> None:
        self.is_open = False
        self._entry = entry
        with ui.element("button" if number is not None else "div").classes("sign-tile") as self.element:
            self._picture = box("picture")
            with self._picture:
                ui.html(entry.drawing, sanitize=False)
            with box("words"):
                text("name", entry.sign)
                text("pose", entry.pose)
                text("effect", entry.effect)
                if entry.figures:
                    text("figures", entry.figures)
                if number is not None:
                    with box("meter live").style(f"--share: var(--bar-{number}, 0%)"):
                        box("")
                        ui.element("i")
        if number is not None:
            self.element.props(f'type="button" aria-expanded="false" title="{_SHOW}"')
            self.element.on("click", lambda: on_click(entry.sign))

    def open(self, *, on: bool) -> None:
        """Show the virtual hand instead of the drawing, or the drawing again; a taught sign has its drawing."""
        if on == self.is_open:
            return
        self.is_open = on
        switch(self.element, "open", on=on)
        self.element.props(f'aria-expanded="{str(on).lower()}"')
        if self._entry.sign not in DRAWN:
            return
        self._picture.clear()
        with self._picture:
            ui.html(_animation(self._entry.sign) if on else self._entry.drawing, sanitize=False)


def _animation(sign: str) -> str:
    path = f"{SIGN_PATH}/{quote(sign)}.webp"
    still = f'<source media="(prefers-reduced-motion: reduce)" srcset="{path}?still=true">'
    return f'<picture>{still}<img src="{path}" alt="" width="120" height="120"></picture>'
