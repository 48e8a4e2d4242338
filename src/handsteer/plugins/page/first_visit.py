"""What a first visit shows on the camera's picture: the offer of one's own camera, and three steps to drive by signs.

Who has driven by the tutorial's rule for a minute is offered a better one.

The browser remembers what was done or dismissed (``static/page.js``); it hides what it has seen.
"""

import asyncio
import time
from typing import Final

from nicegui import ui

from handsteer.cameras import VIRTUAL_HAND
from handsteer.cameras.choice import BROWSER, OWN, Size
from handsteer.errors import HandsteerError, without_passwords
from handsteer.plugins.page.elements import box, button, read_words, sentence, set_property, switch, tag, text
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import FIELDS
from handsteer.plugins.page.sign_pictures import DRAWN
from handsteer.plugins.page.state import PageState
from handsteer.types import FORWARD, STOP

_DEMO: Final = (
    "It shows the signs, and the robot obeys. With your camera you drive: your browser asks first, choose Allow. The "
    "computer that runs handsteer gets the pictures, and all who have its page open see them, "
    "unless you choose Only me."
)
_REFUSALS: Final = {
    "NotAllowedError": (
        "The browser refused the camera. Allow it by the camera or lock symbol next to the page's address, then press "
        "Use my camera again."
    ),
    "NotFoundError": "The browser says: this device has no camera. Plug one in, or open this page on a phone.",
    "NotReadableError": "Another program uses the camera. Close that program, then press Use my camera again.",
    "insecure": (
        "Browsers give a camera only to pages from this computer or over https. Open the page on the computer that "
        "runs handsteer, or set up https: docs/page.md says how."
    ),
    "ended": "The camera was disconnected, or another program took it. Press Use my camera to go on.",
}
_ALONE: Final = "Others see a drawn hand instead of the pictures of my camera"
NOT_THE_DRIVER: Final = "Only the driver can change it: ask to drive first."
_LONGEST_REASON: Final = 200


def refusal(sent: object) -> str:
    """Return what to do about a camera that a browser does not give, or that the server refused."""
    if not isinstance(sent, dict):
        return ""
    why = sent.get("why")
    if isinstance(why, str) and why:
        return _REFUSALS.get(why, f"The browser gives no camera ({why[:_LONGEST_REASON]}): try another browser.")
    return read_words(sent)


async def choose_camera(page: Page, graph: RemoteGraph, source: str, size: Size | None = None) -> str:
    """Choose a camera of ``graph``, if the viewer of ``page`` drives; return why not, in a sentence, or nothing."""
    if not page.drives():
        return NOT_THE_DRIVER
    try:
        await asyncio.wrap_future(graph.choose_camera(source, size))
    except HandsteerError as error:
        return f"{sentence(without_passwords(str(error)))}."
    return ""


class CameraOffer:
    """Chooses between the graph's camera and the browser's, and says first that a demo hand is shown."""

    def __init__(self, page: Page, graph: RemoteGraph) -> None:
        self._page, self._graph = page, graph
        with box("offer") as self._box:
            with box("intro"):
                tag("h2", "", "This is a demo hand, not yours")
                text("", _DEMO)
            self._refusal = text("trouble", "").props('role="alert"')
            with box("choices"):
                self._browser = button("Use my camera").classes("primary")
                self._browser.props('data-camera="browser"')
                self._own = button(f"Back to {graph.camera_name(OWN)}", self._use_own).props('data-camera="own"')
                self._alone = button("Only me").props(f'data-alone title="{_ALONE}"')
                button("Keep watching").classes("keep").props('data-seen="demo"')
        ui.on("webcam", lambda event: self._refusal.set_text(refusal(event.args)))

        self.update()  # at once, or what is below it would jump

    def update(self) -> None:
        """Show what is in use."""
        source = self._graph.state.camera_source
        names = {each.source: each.name for each in self._graph.state.cameras}
        switch(self._box, "demo", on=names.get(source) == VIRTUAL_HAND)
        switch(self._box, "off", on=self._graph.lacks_browser)
        switch(self._browser, "hidden", on=source == BROWSER and self._graph.state.has_browser)
        switch(self._alone, "hidden", on=not self._page.may_be_alone)
        has_own = any(each.source == OWN for each in self._graph.state.cameras)
        switch(self._own, "hidden", on=source == OWN or not has_own)

    async def _use_own(self) -> None:
        self._refusal.set_text(await choose_camera(self._page, self._graph, OWN))


_STEPS: Final = (
    (FORWARD, "Show Forward: index finger up"),
    (FORWARD, "Hold it until the robot drives"),
    (STOP, "Show Stop: open palm"),
)
_DONE: Final = "You can drive. All signs are next to the picture."


NOT_BEGUN: Final = -1
"""Until neutral is seen: what the robot does may still be the demo hand's."""


def steps_done(done: int, state: PageState) -> int:
    """Return how many of the three steps are done in ``state``, after ``done`` of them or :data:`NOT_BEGUN`."""
    happens = (
        state.seen != FORWARD and state.mood != "driving",
        state.seen == FORWARD,
        state.control.source == "signs" and state.mood == "driving" and not state.measured.is_rest,
        state.recognition.sign == STOP and state.measured.is_rest,
    )
    return done + 1 if done < len(_STEPS) and happens[done + 1] else done


class Coach:
    """Three steps to drive by signs, each ticked by what really happens; for the driver, once."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._done = NOT_BEGUN
        self._steps: list[ui.element] = []
        with box("coach off") as self._box:
            with ui.element("ol"):
                for sign, words in _STEPS:
                    with ui.element("li") as step:
                        ui.html(DRAWN[sign][1], sanitize=False)
                        text("", words)
                    self._steps.append(step)
            self._end = text("end", "").props('role="status"')
            button("Skip", label="Skip these steps").props('data-seen="coach"')
        self._mark()

    def update(self, state: PageState, *, is_driver: bool) -> None:
        """Show ``state``, and tick what has been done; ``is_driver`` is of a viewer who can show signs."""
        is_live = is_driver and state.camera not in ("", VIRTUAL_HAND) and not state.is_joystick
        switch(self._box, "off", on=not is_live)
        if self._done == len(_STEPS):
            return
        done = steps_done(self._done, state) if is_live else NOT_BEGUN
        if done == self._done:
            return
        self._done = done
        self._mark()
        if done == len(_STEPS):
            self._end.set_text(_DONE)
            self._page.client.run_javascript("noteSeen('coach', 8000)")

    def _mark(self) -> None:
        for number, step in enumerate(self._steps):
            switch(step, "done", on=number < self._done)
            set_property(step, "aria-current", "step" if number == max(0, self._done) else None)


OFFERED_S: Final = 60.0
"""So long has one driven by the tutorial's rule before the other is offered."""

_BETTER: Final = "Drive better: point where to go. Tilt your finger for a curve, raise your hand to go faster."
_LONGEST_STEP_S: Final = 1.0


def driven_s(before_s: float, state: PageState, dt_s: float) -> float:
    """Return for how long signs have driven by the tutorial's rule, ``dt_s`` after it was ``before_s``."""
    drives = state.control.source == "signs" and state.mood == "driving"
    is_tutorials = state.rule is not None and state.rule.rule == "course" and not state.is_joystick
    return before_s + min(dt_s, _LONGEST_STEP_S) if drives and is_tutorials else before_s


class BetterRule:
    """Offers ``control.rule: point`` to who has driven for a minute without it; for the driver, once."""

    def __init__(self, page: Page, settings: Settings) -> None:
        self._page, self._settings = page, settings
        self._driven_s, self._at_s = 0.0, time.monotonic()
        with box("better off") as self._box:
            text("", _BETTER)
            self._trouble = text("trouble", "").props('role="alert"')
            button("Try it", self._choose).classes("primary")
            button("Not now", label="Not now: keep driving as before").props('data-seen="better"')

    def update(self, state: PageState, *, is_driver: bool) -> None:
        """Show ``state``; ``is_driver`` is of a viewer who can show signs."""
        now_s = time.monotonic()
        if is_driver and state.camera not in ("", VIRTUAL_HAND):
            self._driven_s = driven_s(self._driven_s, state, now_s - self._at_s)
        self._at_s = now_s
        is_tutorials = state.rule is not None and state.rule.rule == "course" and not state.is_joystick
        switch(self._box, "off", on=not (is_driver and is_tutorials and self._driven_s >= OFFERED_S))

    def _choose(self) -> None:
        settings, field = self._settings, FIELDS["control.rule"]
        why_not = self._page.change(lambda: settings.set(field, "point"), NOT_THE_DRIVER)
        self._trouble.set_text(why_not)
        if not why_not:
            self._page.client.run_javascript("noteSeen('better')")
