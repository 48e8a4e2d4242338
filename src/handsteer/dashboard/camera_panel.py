"""The camera's picture, and the choice of camera."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.elements import box, button, switch, text
from handsteer.dashboard.joined import Cameras
from handsteer.dashboard.state import PageState
from handsteer.types import NONE

_MOST_WORDS = 200


class CameraPanel:
    """The mirrored picture, the recognised sign, and the choice of camera.

    Args:
        picture_url: URL of the picture stream.
        cameras: The cameras to choose from; None if there is no choice.
        viewer: The viewer of this page.
        use_own: Called to select the camera of the machine that handsteer runs on.

    Attributes:
        stage: Holds the picture and its overlays.
    """

    def __init__(self, picture_url: str, cameras: Cameras | None, viewer: str, use_own: Callable[[], None]) -> None:
        self._cameras = cameras
        with ui.element("section").classes("card viewer camera"):
            with box("stage") as self.stage:
                # Lazy, because otherwise the page would count as loaded only with its first picture.
                picture = ui.element("img").props('loading="lazy" alt="What the camera sees, mirrored"')
                picture.props(f'src="{picture_url}"')
                with box("veil") as self._veil:
                    self._excuse = text("", "waiting for the first picture")
                text("caption", "as in a mirror")
            with box("foot"):
                self._ring = box("ring").props('role="progressbar" aria-label="Confirmed" aria-valuemax="100"')
                self._sign = text("sign", "No sign")
                with box("meter"):
                    self._confidence = box("")
                self._percent = text("percent", "")
                self._hand = text("hand", "")
            if cameras is not None:
                self._choice(viewer, use_own)
        self._width = 0
        self._confirmed = -1

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        # A confirmed sign stays active for a moment when it is not seen.
        shown = state.sign if state.seen == NONE else state.seen
        self._sign.set_text("No sign" if shown == NONE else shown)
        switch(self._sign, "pending", on=shown != state.sign)
        self._show_confirmed(round(100 * state.confirmed))
        self._hand.set_text(f"{state.handedness} hand" if state.handedness else "No hand")
        percent = round(100 * state.confidence) if state.seen != NONE else 0
        self._percent.set_text(f"{percent} %" if percent else "")
        if percent != self._width:
            self._confidence.style(f"width: {percent}%")
            self._width = percent
        self._excuse.set_text(state.no_picture)
        switch(self._veil, "off", on=not state.no_picture)
        if self._cameras is not None:
            self._show_choice(self._cameras.source, is_given=self._cameras.browser.is_given)

    def _show_confirmed(self, percent: int) -> None:
        if percent != self._confirmed:
            self._confirmed = percent
            self._ring.style(f"--confirmed: {percent}%").props(f"aria-valuenow={percent}")
            switch(self._ring, "whole", on=percent == 100)

    def _choice(self, viewer: str, use_own: Callable[[], None]) -> None:
        self._chosen = ("", False)
        with box("foot choice"):
            self._browsers = button("Use this device's camera", f'data-camera="browser" data-viewer="{viewer}"')
            self._own = button("Use the robot's camera", 'data-camera="own"')
            self._trouble = text("trouble", "").props('role="alert"')
        self._own.on("click", use_own)
        ui.on("webcam", lambda event: self._trouble.set_text(read_words(event.args)))

    def _show_choice(self, source: str, *, is_given: bool) -> None:
        if (source, is_given) != self._chosen:
            self._chosen = (source, is_given)
            switch(self._browsers, "hidden", on=source == "browser" and is_given)
            switch(self._own, "hidden", on=source == "own")


def read_words(sent: object) -> str:
    """Return the camera status sent by a browser, for its own page; empty if it is invalid."""
    words = sent.get("words") if isinstance(sent, dict) else None
    return words[:_MOST_WORDS] if isinstance(words, str) else ""
