"""Cameras that fail on request: one plays a list of events, the other adds faults to a working camera."""

from collections.abc import Callable, Iterable, Mapping
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import Camera, EndOfStream, Frame
from handsteer.clock import Clock
from handsteer.errors import CameraLost

Event = NDArray[np.uint8] | Frame | BaseException | None
CameraFault = Literal["black", "frozen", "torn", "slow", "stuttering", "silent", "vanishing", "in_the_future", "late"]

CAMERA_FAULTS: tuple[CameraFault, ...] = get_args(CameraFault)
"""All faults of a :class:`SpoiltCamera`."""

_GREY = 128


class FaultyCamera:
    """Plays a list of events, one per read; after the last one its stream ends.

    Args:
        events: An image (height, width, 3) uint8 is a frame; an error is raised; a Frame or None is returned.
        clock: Stamps the frames.
        period_s: Time between two frames.
        age_s: Age of each frame when it is read, in seconds.
    """

    name = "faulty camera"

    def __init__(self, events: Iterable[Event], clock: Clock, *, period_s: float = 1 / 30, age_s: float = 0.0) -> None:
        self.period_s = period_s
        self.closed = False
        self._events = iter(events)
        self._clock = clock
        self._age_s = age_s

    def read(self) -> Frame | None:
        """Return or raise the next event."""
        for event in self._events:
            if isinstance(event, BaseException):
                raise event
            return Frame(event, self._clock.now() - self._age_s) if isinstance(event, np.ndarray) else event
        raise EndOfStream

    def close(self) -> None:
        """Record that it was closed."""
        self.closed = True


class SpoiltCamera:
    """A :class:`~handsteer.cameras.Camera` around another one, with a fault on request.

    ::

        camera = SpoiltCamera(VirtualHandCamera(...), clock)
        graph = ...                      # with CameraNode(transport, clock, camera)
        camera.fail("frozen")            # from the next read on
        ...                              # is the robot stopped?
        camera.recover()

    =================  =======================================================================================
    ``black``          every pixel is 0, as behind a lens cap
    ``frozen``         the last picture repeatedly, each time as if it were new
    ``torn``           grey below a moving line, as decoders leave a truncated JPEG
    ``slow``           a frame every ``slow_s`` seconds
    ``stuttering``     frames for ``slow_s`` seconds, none for as long, repeatedly
    ``silent``         no frames, and no error
    ``vanishing``      :class:`~handsteer.errors.CameraLost` at every read
    ``in_the_future``  stamps are ``apart_s`` seconds ahead, as from an unsynchronized clock
    ``late``           frames are ``apart_s`` seconds old when they are read
    =================  =======================================================================================

    Args:
        camera: Delivers the frames.
        clock: Stamps the frames.
        slow_s: As above.
        apart_s: As above.
        seed: Determines where the picture is torn.

    Attributes:
        fault: The current fault; None if there is none.
    """

    def __init__(
        self, camera: Camera, clock: Clock, *, slow_s: float = 1.0, apart_s: float = 5.0, seed: int = 0
    ) -> None:
        self.fault: CameraFault | None = None
        self._camera = camera
        self._clock = clock
        self._slow_s = slow_s
        self._apart_s = apart_s
        self._random = np.random.default_rng(seed)
        self._last: Frame | None = None
        self._began_s = 0.0
        self._given_s = 0.0
        self._spoil: Mapping[CameraFault, Callable[[Frame], Frame | None]] = {
            "black": lambda frame: Frame(np.zeros_like(frame.image), frame.captured_s),
            "frozen": self._again,
            "torn": self._torn,
            "slow": self._slow,
            "stuttering": self._stuttering,
            "silent": lambda _: None,
            "in_the_future": lambda frame: Frame(frame.image, frame.captured_s + self._apart_s),
            "late": lambda frame: Frame(frame.image, frame.captured_s - self._apart_s),
        }

    @property
    def name(self) -> str:
        """Name of the inner camera."""
        return self._camera.name

    @property
    def period_s(self) -> float | None:
        """Frame period of the inner camera."""
        return self._camera.period_s

    def fail(self, fault: CameraFault) -> None:
        """Apply ``fault`` from the next read on, in place of the previous one."""
        if fault not in CAMERA_FAULTS:
            raise ValueError(f"there is no fault {fault!r} of a camera: use {', '.join(CAMERA_FAULTS)}")
        self.fault = fault
        self._began_s = self._given_s = self._clock.now()

    def recover(self) -> None:
        """End the fault from the next read on."""
        self.fault = None

    def read(self) -> Frame | None:
        """Return the next frame with the fault applied, or None if there is none.

        Raises:
            CameraLost: The fault is ``vanishing``.
        """
        frame = self._camera.read()
        if self.fault == "vanishing":
            raise CameraLost(f"{self.name} has vanished, as requested")
        if frame is None or self.fault is None:
            self._last = frame or self._last
            return frame
        return self._spoil[self.fault](frame)

    def close(self) -> None:
        """Close the inner camera."""
        self._camera.close()

    def _again(self, frame: Frame) -> Frame:
        return Frame((self._last or frame).image, frame.captured_s)

    def _torn(self, frame: Frame) -> Frame:
        image = frame.image.copy()
        image[self._random.integers(len(image)) :] = _GREY
        return Frame(image, frame.captured_s)

    def _slow(self, frame: Frame) -> Frame | None:
        if self._clock.now() - self._given_s < self._slow_s - 1e-9:
            return None
        self._given_s = self._clock.now()
        return frame

    def _stuttering(self, frame: Frame) -> Frame | None:
        rests = int((self._clock.now() - self._began_s) / self._slow_s) % 2 == 0
        return None if rests else frame
