"""What the top of every page shows: the control lease, the reaction time, and the banner with the Stop button."""

import json
import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final

from nicegui import ui

from handsteer.plugins.page.elements import box, button, sentence, set_property, switch, text
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.viewers import LeaseStatus, Role
from handsteer.types import NONE

UNKNOWN = "--"
"""Shown for an unknown value."""


class LeasePanel:
    """Whether this viewer drives, and buttons to request the lease, or to hand it over (``answer(True)``)."""

    _WORDS: ClassVar[dict[Role, str]] = {
        "driver": "you drive",
        "watcher": "you watch: another viewer drives",
        "free": "no viewer drives",
    }

    def __init__(self, ask: Callable[[], None], answer: Callable[[bool], None]) -> None:
        with box("lease"):
            self._words = text("role chip", "")
            self._ask = button("Ask to drive", ask).classes("hidden")
            with box("request"):
                self._question = text("question", "")
                self._yes = button("Hand over", lambda: answer(True)).classes("hidden")
                self._no = button("Keep", lambda: answer(False)).classes("hidden")

    def update(self, place: LeaseStatus) -> None:
        """Show the lease as this viewer sees it."""
        is_driver = place.role == "driver"
        asks = f"Another viewer asks to drive, and does in {place.left_s:.0f} s without an answer"
        waits = f"You drive in {place.left_s:.0f} s, or sooner"
        self._question.set_text((asks if is_driver else waits) if place.asked else "")
        self._words.set_text(self._WORDS[place.role])
        switch(self._words, "driver", on=is_driver)
        switch(self._ask, "hidden", on=is_driver or place.asked)
        for answer in (self._yes, self._no):
            switch(answer, "hidden", on=not (is_driver and place.asked))


class TimingLine:
    """Reaction time from the capture of a picture to the command, and the camera's frame rate.

    It changes once a second: more often, it could not be read, and each change costs a browser the drawing of the page.
    """

    def __init__(self) -> None:
        self._due_s = -math.inf
        with box("timing"):
            text("name", "Reaction time: typical / slowest 1 %")
            self._times = text("value times", "")
            self._rate = text("value rate", "")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        if time.monotonic() < self._due_s:
            return
        self._due_s = time.monotonic() + 1.0
        typical, slowest = (
            _rounded(value) for value in (state.control.latency_median_ms, state.control.latency_p99_ms)
        )
        self._times.set_text(f"{typical} / {slowest} ms")
        self._rate.set_text(f"{_rounded(state.fps)} frames/s")


def _rounded(value: float | None) -> str:
    return UNKNOWN if value is None else f"{value:.0f}"


_TIME = re.compile(r" for \d+(\.\d+)? s\b")


def spoken(state: PageState) -> str:
    """Return the banner's sentence for a screen reader, without times, which would be read out at each change."""
    return ". ".join([f"{state.headline}: {_TIME.sub('', state.reason)}", *state.warnings])


_SOUND: Final = "Tones and words for ready, each sign, and Stop"
_SOUND_ICON = (
    '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" '
    'aria-hidden="true"><path d="M4 10v4h4l5 4V6L8 10z" fill="currentColor"/><path d="M16 9a4 4 0 0 1 0 6"/>'
    '<path d="M19 6a8 8 0 0 1 0 12" class="wave"/></svg>'
)


@dataclass(frozen=True)
class Notable:
    """What the driver must notice while looking at the robot.

    Attributes:
        stopped: Whether the robot is stopped until reset, as far as is known.
        ready: Whether signs are obeyed.
        sign: The sign that is obeyed, or ``NONE``.
    """

    stopped: bool
    ready: bool
    sign: str

    @classmethod
    def of(cls, state: PageState) -> "Notable":
        """Return what is notable in ``state``."""
        ready = not state.stopped and state.control.armed and state.control.engaged
        return cls(state.stopped and not state.unheard, ready, state.recognition.sign if ready else NONE)

    def news_since(self, before: "Notable") -> tuple[str, str] | None:
        """Return the tone and the words for what has changed, the most important only; None if nothing has."""
        if self.stopped != before.stopped:
            return ("stopped", "Stopped") if self.stopped else None
        if self.ready and not before.ready:
            return "ready", "Ready for signs"  # a Stop that is shown then is how it became ready
        return ("sign", f"Sign accepted: {self.sign}") if self.sign not in (NONE, before.sign) else None


class Cues:
    """The switch of tones and words, which ``static/sound.js`` plays and says if this browser has switched them on."""

    def __init__(self) -> None:
        self._before: Notable | None = None
        with ui.element("button").classes("icon-button sound") as self._switch:
            ui.html(_SOUND_ICON, sanitize=False)
        self._switch.props(f'aria-pressed=false aria-label="{_SOUND}" title="{_SOUND}"')
        text("cue", "").props('aria-live="assertive"')

    def update(self, state: PageState) -> None:
        """Play and say what has changed."""
        before, self._before = self._before, Notable.of(state)
        news = self._before.news_since(before) if before is not None else None
        if news is not None:
            self._switch.client.run_javascript(f"window.cue?.({json.dumps(news[0])}, {json.dumps(news[1])})")


_PRESS_WITHOUT_SCRIPT = "() => window.pressStop ? undefined : emit({ press: 0 })"
"""``static/page.js`` reports a press; without it, as where it was not loaded, a click does."""


class Banner:
    """A sentence that reports what the robot does, and why, and buttons that call ``halt`` and ``reset``.

    ``halt`` is called with what the browser sent: the number of the press, which ``static/page.js`` also sends by a
    request of its own, until that is answered.
    """

    def __init__(self, halt: Callable[[object], None], reset: Callable[[], None]) -> None:
        with ui.element("section").classes("card banner") as self._banner:
            self._spoken = text("spoken", "").props('role="status"')
            box("lamp")
            with box("words"):
                self._headline = text("headline", "Starting")
                self._reason = text("reason", "Waiting for the first report")
                # Shown by static/page.js while the server does not answer.
                text("lost title", "Connection lost")
                text("lost again", "what is shown may be old")
                text("lost elsewhere", "handsteer has restarted: open its new address")
            self._warning = text("warning hidden", "")
            with box("buttons"):
                self._camera = (
                    button("Use my camera").classes("primary use-camera hidden").props('data-camera="browser"')
                )
                self._reset = button("Reset", reset, "Reset: let the robot be driven again").classes("hidden")
                stop = button("Stop", label="Stop the robot (space key)").classes("stop")
                stop.props('aria-keyshortcuts="Space"')
                stop.on("click", lambda event: halt(event.args), js_handler=_PRESS_WITHOUT_SCRIPT)
                with stop:
                    text("pressed sent", "Sent")
                    text("pressed confirmed", "Stopped")
                    text("pressed refused", "No effect")
        ui.on("space", lambda event: halt(event.args))
        self._mood = ""

    def offer_camera(self, *, on: bool) -> None:
        """Offer to use the browser's camera; ``static/webcam.js`` takes it again where it may."""
        switch(self._banner, "camera-off", on=on)
        switch(self._camera, "hidden", on=not on)

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._headline.set_text(state.headline)
        for label, words in ((self._reason, sentence(state.reason)), (self._warning, "; ".join(state.warnings))):
            label.set_text(words)
            set_property(label, "title", words)  # where it does not fit
        self._spoken.set_text(spoken(state))
        switch(self._warning, "hidden", on=not state.warnings)
        switch(self._reset, "hidden", on=not state.stopped)
        switch(self._banner, "unheard", on=state.unheard)
        if state.mood != self._mood:
            self._banner.classes(remove=self._mood, add=state.mood)
            self._mood = state.mood
