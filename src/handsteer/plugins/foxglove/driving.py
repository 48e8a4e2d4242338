"""Lets programs drive by their commands on ``cmd_vel``: one at a time, the one that has the seat."""

import math
import threading
from collections.abc import Callable
from typing import Final

from handsteer.nodes.steering import SteeringNode
from handsteer.timeouts import HOLD_TIMEOUT_S
from handsteer.types import Velocity

CONFIRM_S: Final = 0.2
"""After a pause, commands count once they have come for this long: those that a network held back come all at once."""

_WATCH_PERIOD_S: Final = 0.05
_ASK_PERIOD_S: Final = 1.0


class Seat:
    """The right to drive, which one program has at a time: the first that asks.

    Attributes:
        driver: Who has it; None if it is free.
    """

    def __init__(self) -> None:
        self.driver: str | None = None

    def ask(self, program: str) -> None:
        """Take the seat for ``program`` if it is free."""
        self.driver = self.driver or program

    def leave(self, program: str) -> None:
        """Give back the seat of ``program``; has no effect on others."""
        if self.driver == program:
            self.driver = None


class SharedSeat(Seat):
    """A :class:`Seat` that the page's viewers share: its driver is asked, and may hand it over.

    Args:
        say: Tells the page that a program asks (``ask``) or leaves (``leave``).
    """

    def __init__(self, say: Callable[[str, str], None]) -> None:
        super().__init__()
        self._say = say

    def note(self, driver: str | None) -> None:
        """Note who has the seat now, a program or a viewer."""
        self.driver = driver

    def ask(self, program: str) -> None:
        """Ask for the seat for ``program``; it may get it later."""
        self._say("ask", program)

    def leave(self, program: str) -> None:
        """Give back the seat of ``program``, or end its request."""
        self._say("leave", program)


class Driving:
    """Steers by the commands of the program that has the seat; thread-safe.

    A program has to be seen released before it drives: by a zero, or by the end of its commands, as those of Foxglove's
    panel end, while it is known to be connected (:meth:`note_silence`). So what it commands first, since the start or
    after a network held its commands back, moves nothing.

    Args:
        steering: Publishes the velocity until it is released; not started yet.
        seat: Decides which program drives.
    """

    def __init__(self, steering: SteeringNode, seat: Seat) -> None:
        self._steering = steering
        self._seat = seat
        self._lock = threading.Lock()
        self._program: str | None = None
        self._released: str | None = None  # the program that was seen released last
        self._heard_s = self._began_s = self._asked_s = -math.inf
        # On the thread that repeats the velocity: while it hangs, nothing is repeated.
        steering.every(_WATCH_PERIOD_S, self._watch)

    def command(self, program: str, wanted: Velocity, *, is_late: bool = False) -> bool:
        """Drive at ``wanted`` if ``program`` has the seat.

        This ends :data:`~handsteer.timeouts.HOLD_TIMEOUT_S` after its last command. A program without the seat asks
        for it.

        Args:
            program: Name of the program.
            wanted: The velocity.
            is_late: Whether the command has waited for others, so that it says nothing about now.

        Returns:
            Whether it has the seat.
        """
        now = self._steering.clock.now()
        if self._seat.driver != program and now - self._asked_s >= _ASK_PERIOD_S:
            self._asked_s = now
            self._seat.ask(program)
        if self._seat.driver != program:
            return False
        with self._lock:
            if program == self._program and now - self._heard_s > HOLD_TIMEOUT_S:
                self._lose()
            if program != self._program or is_late:
                self._begin(program, now, is_late=is_late)
            self._heard_s = now
            if wanted.is_zero and not is_late:
                self._released = program
            if wanted.is_zero or (self._released == program and now - self._began_s >= CONFIRM_S):
                self._steering.steer(wanted.linear_mps, wanted.angular_radps)
        return True

    def note_silence(self, program: str) -> None:
        """Note that ``program`` is connected: if its last command is old, its person has released what steers."""
        with self._lock:
            if self._seat.driver == program and self._steering.clock.now() - self._heard_s > HOLD_TIMEOUT_S:
                self._released, self._program = program, None
                self._steering.release()

    def leave(self, program: str) -> None:
        """Stop if ``program`` steers, and give back its seat."""
        with self._lock:
            if self._program == program:
                self._lose()
        self._seat.leave(program)

    def _watch(self) -> None:
        with self._lock:
            silent_s = self._steering.clock.now() - self._heard_s
            if self._program is not None and (silent_s > HOLD_TIMEOUT_S or self._seat.driver != self._program):
                self._lose()

    def _begin(self, program: str, now_s: float, *, is_late: bool) -> None:
        self._program, self._began_s = program, now_s
        if is_late or self._released != program:
            self._released = None
            self._steering.lose()
        else:
            self._steering.steer(0.0, 0.0)

    def _lose(self) -> None:
        self._released = self._program = None
        self._steering.lose()
