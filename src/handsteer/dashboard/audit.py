"""What viewers of the page do, for the audit; viewers have a number and the address of their machine."""

import itertools
import threading
from collections import OrderedDict
from collections.abc import Callable

from handsteer.audit import INFO, AuditCode, AuditEvent
from handsteer.clock import Clock
from handsteer.dashboard.viewers import SeatChange
from handsteer.nodes.auditing import Auditor
from handsteer.transports.base import Transport

_MOST_SESSIONS = 1000
_UNKNOWN = "a viewer"


class PageAudit:
    """Publishes what viewers do; may be called on any thread.

    Args:
        transport: Carries the messages.
        clock: The graph's clock.

    Attributes:
        driver: Name of the driver, or of the last one.
        on_driver: Called with the viewer that has got the seat, or None if it is free; must return at once.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self.driver = "dashboard"
        self.on_driver: Callable[[str | None], None] = lambda _: None
        self._auditor = Auditor(transport, "dashboard", clock)
        self._clock = clock
        self._lock = threading.RLock()
        self._numbers = itertools.count(1)
        self._sessions: OrderedDict[str, int] = OrderedDict()
        self._names: dict[str, str] = {}

    def introduce(self, viewer: str, session: str, address: str) -> None:
        """Name ``viewer``; pages of one session have one number."""
        with self._lock:
            number = self._sessions.pop(session, None) or next(self._numbers)
            self._sessions[session or viewer] = number
            if len(self._sessions) > _MOST_SESSIONS:
                self._sessions.popitem(last=False)
            self._names[viewer] = f"viewer {number} ({address})" if address else f"viewer {number}"

    def introduce_program(self, viewer: str) -> None:
        """Name a viewer that is no page but a program by its own name."""
        with self._lock:
            self._names[viewer] = viewer

    def forget(self, viewer: str) -> None:
        """Forget the name of a viewer who has left."""
        with self._lock:
            self._names.pop(viewer, None)

    def name_of(self, viewer: str) -> str:
        """Return the name of ``viewer``, such as ``viewer 1 (127.0.0.1)``."""
        return self._names.get(viewer, _UNKNOWN)

    def person_of(self, viewer: str) -> str:
        """Return what is the same for all pages of one browser, even of those that it has left."""
        return self._names.get(viewer, viewer)

    def say(self, code: AuditCode, viewer: str, sentence: str, about: str = "", level: int = INFO) -> None:
        """Publish what ``viewer`` does."""
        with self._lock:
            self._auditor.say(AuditEvent(code, self.name_of(viewer), sentence, about, level), self._clock.now())

    def say_of_driver(self, code: AuditCode, sentence: str, about: str = "") -> None:
        """Publish what the driver does."""
        with self._lock:
            self._auditor.say(AuditEvent(code, self.driver, sentence, about), self._clock.now())

    def on_seat(self, change: SeatChange) -> None:
        """Publish who has left the seat and who has taken it."""
        self.on_driver(change.after)
        before, after = (viewer and self.name_of(viewer) for viewer in (change.before, change.after))
        if change.before is not None:
            left = {"handed_over": f"handed the seat over to {after}", "unanswered": "lost the seat: gave no answer"}
            code: AuditCode = "seat_lost" if change.how == "unanswered" else "seat_left"
            self.say(code, change.before, left.get(change.how, "left the seat"))
        if change.after is not None:
            self.driver = str(after)
            taken = {
                "free": "took the seat, which was free",
                "handed_over": f"took the seat, which {before} handed over",
                "unanswered": f"took the seat from {before}, who gave no answer",
                "left": f"took the seat, which {before} left",
            }
            self.say("seat_taken", change.after, taken[change.how])
