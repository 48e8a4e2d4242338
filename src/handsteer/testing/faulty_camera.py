"""A camera that fails when told to."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.protocol import EndOfStream, Frame
from handsteer.clock import Clock
from handsteer.errors import CameraError

Event = NDArray[np.uint8] | CameraError | None


class FaultyCamera:
    """Gives, at each reading, the next of a list of events; after the last one its stream ends.

    Args:
        events: An image (height, width, 3) uint8 is a frame, None is no frame, an error is raised.
        clock: Stamps the frames.
        period_s: Time between two frames.
        age_s: How old each frame is when it comes, in seconds.
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
            if isinstance(event, CameraError):
                raise event
            return None if event is None else Frame(event, self._clock.now() - self._age_s)
        raise EndOfStream

    def close(self) -> None:
        """Note that it was closed."""
        self.closed = True
