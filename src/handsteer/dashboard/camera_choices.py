"""Choices next to the picture: the camera of the browser's device, and the confidence from which a sign counts."""

from typing import Any, Final

from nicegui import ui

from handsteer.dashboard.elements import box, tag, text
from handsteer.dashboard.page import Page
from handsteer.dashboard.settings import Settings
from handsteer.dashboard.settings_fields import FIELDS
from handsteer.dashboard.state import PageState
from handsteer.errors import ConfigError

_THRESHOLD: Final = FIELDS["signs.min_confidence"]
_NOT_THE_DRIVER: Final = "Only the driver can change it: ask to drive first."
_DEVICES: Final = "The list is complete once the browser has allowed a camera."
_SIZES: Final = ("640x480", "320x240")
_STEP: Final = 0.05


class CameraChoices:
    """A folded panel of choices.

    Args:
        page: Shows the panel.
        settings: Those of the graph.
    """

    def __init__(self, page: Page, settings: Settings) -> None:
        self._page, self._settings = page, settings
        self._shown = _THRESHOLD.value_in(settings.running)
        with ui.element("details").classes("camera-choices"):
            tag("summary", "text-button", "Adjust")
            with box("choices-panel"):
                with ui.element("label"):
                    tag("span", "", "Camera of this device")
                    with ui.element("select").props('id="browser-camera"'):
                        tag("option", "", "The browser chooses").props('value=""')
                text("note", _DEVICES)
                with ui.element("label"):
                    tag("span", "", "Its resolution")
                    with ui.element("select").props('id="browser-size"'):
                        for size in _SIZES:
                            tag("option", "", size).props(f'value="{size}"')
                self._words = text("", "")
                self._slider = ui.slider(min=0, max=1, step=_STEP, value=self._shown, on_change=self._change)
                self._slider.props('aria-label="Least confidence of a sign"')
                self._trouble = text("trouble", "").props('role="alert"')
        self._tell()

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        if state.min_confidence is not None and state.min_confidence != self._shown:
            self._shown = state.min_confidence
            self._slider.set_value(self._shown)
            self._tell()

    def _tell(self) -> None:
        self._words.set_text(f"A sign counts from a confidence of {self._shown:.0%}")

    def _change(self, event: Any) -> None:
        wanted = event.value
        if not isinstance(wanted, int | float) or wanted == self._shown:
            return
        trouble = _NOT_THE_DRIVER
        if self._page.drives():
            try:
                self._settings.set(_THRESHOLD, f"{wanted:.2f}")
            except ConfigError as error:
                trouble = str(error)
            else:
                trouble, self._shown = "", float(wanted)
        self._trouble.set_text(trouble)
        self._tell()
        if trouble:
            self._slider.set_value(self._shown)
