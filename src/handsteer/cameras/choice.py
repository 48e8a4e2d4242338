"""The choice between this machine's cameras and that of a browser, which can change while nodes run."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Final, Protocol

from handsteer.cameras import Camera, Frame
from handsteer.cameras.browser import BrowserCamera
from handsteer.errors import CameraError, CameraNotFound, HandsteerError

OWN: Final = "own"
"""Source of the camera that the run was started with."""

BROWSER: Final = "browser"
"""Source of the camera of a browser."""

Size = tuple[int, int]
"""Width and height in pixels."""


@dataclass(frozen=True)
class CameraChoice:
    """A camera of this machine.

    Attributes:
        source: :data:`OWN`, or a source as in ``camera.source``.
        name: Name for people.
        has_sizes: Whether it can be asked for a resolution.
    """

    source: str
    name: str
    has_sizes: bool = False


class Machine(Protocol):
    """Finds and opens the cameras of this machine.

    Attributes:
        own: The camera that the run was started with; None if it was started without one.
        size: The configured resolution.
    """

    own: CameraChoice | None
    size: Size

    def find(self) -> tuple[CameraChoice, ...]:
        """Return the cameras that can be chosen now, the own one first."""
        ...

    def open(self, source: str, size: Size) -> Camera:
        """Open the camera of a choice.

        Raises:
            HandsteerError: It cannot be used.
        """
        ...


@dataclass(frozen=True)
class _Wanted:
    source: str
    size: Size
    is_far: bool
    done: Future[None] = field(default_factory=Future)


class ChoiceOfCameras:
    """A :class:`~handsteer.cameras.Camera` that reads from a camera of this machine or from the browser's.

    The choice takes effect when the next frame is read: the camera in use is closed, and the other one opened. If that
    fails, the one before is used again.

    When a browser leaves, there is no automatic change to the machine's own camera, because anything may be in front of
    it: there are no frames until a camera is selected again.

    Args:
        own: The camera that the run was started with.
        browser: The browser's camera.
        machine: Opens other cameras.
        source: The initial selection, :data:`OWN` or :data:`BROWSER`.

    Attributes:
        source: The selected source.
        size: The resolution that webcams are asked for.
        is_far: Whether the selected camera is that of a browser on another machine.
        choices: The cameras of this machine that can be chosen, as last found.
        on_change: Called when another camera is chosen, and again before its first frame; on any thread.
    """

    def __init__(self, own: Camera, browser: BrowserCamera, machine: Machine, source: str = OWN) -> None:
        self.source = source
        self.browser = browser
        self.size = machine.size
        self.is_far = False
        self.choices: tuple[CameraChoice, ...] = (machine.own,) if machine.own is not None else ()
        self.on_change: Callable[[], None] = lambda: None
        self._machine = machine
        self._own = self._camera = own
        self._lock = threading.Lock()
        self._wanted: _Wanted | None = None

    @property
    def name(self) -> str:
        """Name of the selected camera."""
        return self.browser.name if self.source == BROWSER else self._camera.name

    @property
    def period_s(self) -> float | None:
        """Frame period of the selected camera."""
        return None if self.source == BROWSER else self._camera.period_s

    def find(self) -> None:
        """Look again for the cameras of this machine."""
        self.choices = self._machine.find()

    def choose(self, source: str, size: Size | None = None, is_far: bool = False) -> Future[None]:
        """Select ``source``; may be called from any thread.

        Args:
            source: :data:`OWN`, :data:`BROWSER`, or the source of one of ``choices``.
            size: The resolution to ask a webcam for; as before by default.
            is_far: Whether the browser is on another machine.

        Returns:
            Done when the camera is in use; a :class:`~handsteer.errors.HandsteerError` if it cannot be used.

        Raises:
            CameraNotFound: The source is not one of these.
        """
        if source not in {OWN, BROWSER, *(each.source for each in self.choices)}:
            raise CameraNotFound("this camera is not in the list any more: open the list again")
        wanted = _Wanted(source, size or self.size, is_far)
        with self._lock:
            before, self._wanted = self._wanted, wanted
        if before is not None:
            before.done.set_exception(CameraError("another camera was chosen meanwhile"))
        self.browser.forget()
        self.on_change()
        return wanted.done

    def read(self) -> Frame | None:
        """Return the newest frame of the selected camera, or None if there is none now."""
        with self._lock:
            wanted, self._wanted = self._wanted, None
        if wanted is not None:
            self._change(wanted)
        return self.browser.read() if self.source == BROWSER else self._camera.read()

    def close(self) -> None:
        """Release the devices; may be called twice."""
        self._camera.close()
        self._own.close()

    def _change(self, wanted: _Wanted) -> None:
        before = self._camera
        if before.period_s is None:
            before.close()  # a device would keep old frames, and may be the one that is opened next
        try:
            self._camera = self._open(wanted)
        except HandsteerError as error:
            self.on_change()
            wanted.done.set_exception(error)
        else:
            if before is not self._camera and before is not self._own:
                before.close()
            self.source, self.size, self.is_far = wanted.source, wanted.size, wanted.is_far
            self.on_change()
            wanted.done.set_result(None)

    def _open(self, wanted: _Wanted) -> Camera:
        if wanted.source == BROWSER:
            return self._camera
        if wanted.source != OWN:
            return self._machine.open(wanted.source, wanted.size)
        if self._own.period_s is None and self._machine.own is not None:
            self._own = self._machine.open(OWN, wanted.size)
        return self._own
