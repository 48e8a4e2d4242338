"""Choices next to the picture: the camera, its resolution and view, and from which confidence on a sign counts."""

from typing import Any, Final

from nicegui import ui

from handsteer.cameras import VIRTUAL_HAND
from handsteer.cameras.choice import BROWSER, CameraChoice, Size
from handsteer.plugins.page.elements import box, sentence, tag, text
from handsteer.plugins.page.first_visit import NOT_THE_DRIVER, choose_camera
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import FIELDS, Field
from handsteer.plugins.page.state import PageState

_THRESHOLD: Final = FIELDS["signs.min_confidence"]
_SWAP_SIDES: Final = FIELDS["signs.swap_sides"]
_NOT_IN_USE: Final = "None: a browser's camera is used"
_STOPS: Final = "A change stops the robot; then lower your hand to begin."
_DEVICES: Final = "The list is complete once the browser has allowed a camera."
_OF_THE_HAND: Final = "The size of its picture is read at the start: camera.width and camera.height."
_OF_A_FILE: Final = "A file or an address has a resolution of its own."
_BROWSERS_SIZES: Final = ("640x480", "320x240")
_SIZES: Final[tuple[Size, ...]] = ((320, 240), (640, 480), (1280, 720))
_SWAP: Final = "The camera looks the way I look"
_SWAPS: Final = "From behind me, or on my head: left and right of the picture are swapped."
_STEP: Final = 0.05
_EMIT_INDEX: Final = "(event) => emit(Number(event.target.value))"


class CameraChoices:
    """A folded panel of choices."""

    def __init__(self, page: Page, graph: RemoteGraph, settings: Settings) -> None:
        self._page, self._settings = page, settings
        self._shown = _THRESHOLD.value_in(settings.running)
        self._is_swapped = _SWAP_SIDES.value_in(settings.running)
        with ui.element("details").classes("camera-choices") as panel:
            tag("summary", "text-button", "Adjust")
            with box("choices-panel"):
                with box("group"):
                    self._machine = _MachineCameras(page, graph)
                with box("group"):
                    _browsers_cameras()
                with box("group"):
                    self._words = text("words", "")
                    self._slider = ui.slider(min=0, max=1, step=_STEP, value=self._shown, on_change=self._change)
                    self._slider.props('aria-label="Least confidence of a sign"')
                with box("group"):
                    self._swap = ui.checkbox(_SWAP, value=self._is_swapped, on_change=self._change_view)
                    text("note", _SWAPS)
                self._trouble = text("trouble", "").props('role="alert"')
        panel.on("toggle", self._on_toggle, js_handler="(event) => emit(event.target.open)")
        self._tell()

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._machine.update()
        if state.recognition.min_confidence is not None and state.recognition.min_confidence != self._shown:
            self._shown = state.recognition.min_confidence
            self._slider.set_value(self._shown)
            self._tell()
        if (swapped := _SWAP_SIDES.value_in(self._settings.running)) != self._is_swapped:
            self._is_swapped = swapped
            self._swap.set_value(swapped)

    def _on_toggle(self, event: Any) -> None:
        if event.args is True:
            self._machine.find()
        else:
            self._machine.forget_trouble()

    def _tell(self) -> None:
        self._words.set_text(f"A sign counts from a confidence of {self._shown:.0%}")

    def _change(self, event: Any) -> None:
        wanted = event.value
        if not isinstance(wanted, int | float) or wanted == self._shown:
            return
        if self._set(_THRESHOLD, f"{wanted:.2f}"):
            self._shown = float(wanted)
        self._tell()
        self._slider.set_value(self._shown)

    def _change_view(self, event: Any) -> None:
        wanted = event.value is True
        if wanted != self._is_swapped:
            if self._set(_SWAP_SIDES, str(wanted).lower()):
                self._is_swapped = wanted
            self._swap.set_value(self._is_swapped)

    def _set(self, field: Field, value: str) -> bool:
        """Set a parameter, or say why not; return whether it is set."""
        trouble = self._page.change(lambda: self._settings.set(field, value), NOT_THE_DRIVER)
        self._trouble.set_text(trouble)
        return not trouble


class _MachineCameras:
    """The cameras of the computer that runs handsteer: a list, and the resolution of a webcam."""

    def __init__(self, page: Page, graph: RemoteGraph) -> None:
        self._page, self._graph = page, graph
        self._cameras: tuple[CameraChoice, ...] = ()
        self._sizes: tuple[Size, ...] = ()
        self._shown: object = None
        with ui.element("label"):
            tag("span", "", "Camera of the computer that runs handsteer")
            self._list = ui.element("select").props('id="machine-camera"')
            self._list.on("change", self._choose, js_handler=_EMIT_INDEX)
        with ui.element("label") as self._size_label:
            tag("span", "", "Its resolution")
            self._size_list = ui.element("select").props('id="machine-size"')
            self._size_list.on("change", self._choose_size, js_handler=_EMIT_INDEX)
        self._note = text("note", "")
        text("note", _STOPS)
        self._progress = text("note", "").props('role="status"')
        self._trouble = text("trouble", "").props('role="alert"')
        self.update()

    def find(self) -> None:
        """Look again for cameras."""
        self._graph.find_cameras()

    def forget_trouble(self) -> None:
        """Hide why the last choice failed."""
        self._trouble.set_text("")

    def update(self) -> None:
        """Show the list and what is in use, if either has changed."""
        state = self._graph.state
        shown = (state.cameras, state.camera_source, state.camera_size)
        if shown != self._shown:
            self._shown = shown
            self._fill()

    def _fill(self) -> None:
        state = self._graph.state
        self._cameras = state.cameras
        self._sizes = tuple(sorted({*_SIZES, state.camera_size}))
        current = next((each for each in self._cameras if each.source == state.camera_source), None)
        self._list.clear()
        with self._list:
            if current is None:
                tag("option", "", _NOT_IN_USE).props("selected disabled value")
            for number, each in enumerate(self._cameras):
                _option(number, sentence(each.name) if each.name == VIRTUAL_HAND else each.name, on=each is current)
        self._size_list.clear()
        with self._size_list:
            for number, (width, height) in enumerate(self._sizes):
                _option(number, f"{width}x{height}", on=(width, height) == state.camera_size)
        has_sizes = current is not None and current.has_sizes
        self._size_label.set_visibility(has_sizes)
        self._note.set_text("" if current is None or has_sizes else _why_no_size(current))

    async def _choose(self, event: Any) -> None:
        number = event.args
        if _is_index(number, self._cameras):
            await self._use(self._cameras[number].source, self._graph.state.camera_size)

    async def _choose_size(self, event: Any) -> None:
        number = event.args
        if _is_index(number, self._sizes) and self._graph.state.camera_source != BROWSER:
            await self._use(self._graph.state.camera_source, self._sizes[number])

    async def _use(self, source: str, size: Size) -> None:
        self._trouble.set_text("")
        self._progress.set_text(f"Opening {self._graph.camera_name(source)} …")
        trouble = await choose_camera(self._page, self._graph, source, size)
        self._progress.set_text("")
        self._trouble.set_text(trouble)
        if trouble:
            self._fill()  # the browser shows what was selected


def _browsers_cameras() -> None:
    """Create the choices of the browser's own camera, which ``static/webcam.js`` reads and fills."""
    with ui.element("label"):
        tag("span", "", "Camera of this device")
        with ui.element("select").props('id="browser-camera"'):
            tag("option", "", "The browser chooses").props('value=""')
    text("note", _DEVICES)
    with ui.element("label"):
        tag("span", "", "Its resolution")
        with ui.element("select").props('id="browser-size"'):
            for size in _BROWSERS_SIZES:
                tag("option", "", size).props(f'value="{size}"')


def _option(number: int, words: str, *, on: bool) -> None:
    tag("option", "", words).props(f'value="{number}" {"selected" if on else ""}')


def _is_index(sent: object, items: tuple[object, ...]) -> bool:
    return isinstance(sent, int) and not isinstance(sent, bool) and 0 <= sent < len(items)


def _why_no_size(camera: CameraChoice) -> str:
    return _OF_THE_HAND if camera.name == VIRTUAL_HAND else _OF_A_FILE
