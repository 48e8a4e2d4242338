"""The viewers of the page: the control lease, the nodes that run for them, and what the audit says of them."""

import itertools
import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from handsteer.audit import INFO, AuditCode, AuditEvent
from handsteer.clock import Clock
from handsteer.nodes.auditing import Auditor
from handsteer.nodes.base import Node
from handsteer.transports.base import Transport

ANSWER_S = 10.0
"""A request that the driver does not answer within this time is granted."""

ALONE_S = 5.0
"""After this long alone, a page of another viewer than the last driver takes the lease."""

Role = Literal["driver", "watcher", "free"]
SeatChangeReason = Literal["free", "handed_over", "unanswered", "left"]


@dataclass(frozen=True)
class LeaseStatus:
    """The lease as one viewer sees it.

    Attributes:
        role: Whether the viewer drives, watches another one, or the lease is free.
        asked: For the driver: there is a request. For a watcher: it has requested the lease.
        left_s: Seconds until an unanswered request is granted.
    """

    role: Role
    asked: bool = False
    left_s: float = 0.0


OnSeat = Callable[[str | None, str | None, SeatChangeReason], None]
"""Called with the driver before and after a change of the lease, None if there is none, and why it has changed."""


class ControlLease:
    """The control lease; thread-safe.

    The driver keeps the lease until it leaves, hands over, or does not answer a request in time. A refused viewer may
    ask again.

    Args:
        on_change: Called with each change of the driver; must return at once, and not use the lease.
    """

    def __init__(self, on_change: OnSeat = lambda *_: None) -> None:
        self._on_change = on_change
        self._lock = threading.Lock()
        self._driver: str | None = None
        self._request: tuple[str, float] | None = None

    def take(self, viewer: str, now_s: float) -> bool:
        """Return whether ``viewer`` drives; a free lease is given to it."""
        with self._lock:
            self._hand_over_if_due(now_s)
            if self._driver is None:
                self._change(viewer, "free")
            return self._driver == viewer

    def drives(self, viewer: str) -> bool:
        """Return whether ``viewer`` has the lease."""
        return self._driver == viewer

    @property
    def driver(self) -> str | None:
        """The viewer who has the lease; None if there is none."""
        return self._driver

    def ask(self, viewer: str, now_s: float) -> None:
        """Request the lease; ignored while another request is pending."""
        with self._lock:
            self._hand_over_if_due(now_s)
            if self._driver is None:
                self._change(viewer, "free")
            elif self._driver != viewer and self._request is None:
                self._request = (viewer, now_s + ANSWER_S)

    def answer(self, viewer: str, *, hand_over: bool) -> None:
        """Grant or refuse the request, if ``viewer`` is the driver."""
        with self._lock:
            if self._driver == viewer and self._request is not None:
                asker, self._request = self._request[0], None
                if hand_over:
                    self._change(asker, "handed_over")

    def leave(self, viewer: str) -> None:
        """Release the lease, which grants a pending request, or withdraw a request."""
        with self._lock:
            if self._request is not None and self._request[0] == viewer:
                self._request = None
            if self._driver == viewer:
                self._change(self._request[0] if self._request else None, "left")
                self._request = None

    def tick(self, now_s: float) -> None:
        """Grant a request that has not been answered in time."""
        with self._lock:
            self._hand_over_if_due(now_s)

    def status_of(self, viewer: str, now_s: float) -> LeaseStatus:
        """Return the lease as ``viewer`` sees it."""
        with self._lock:
            asker, due_s = self._request or (None, now_s)
            left_s = max(0.0, due_s - now_s)
            if self._driver is None:
                return LeaseStatus("free")
            if self._driver == viewer:
                return LeaseStatus("driver", asker is not None, left_s)
            return LeaseStatus("watcher", asker == viewer, left_s)

    def _hand_over_if_due(self, now_s: float) -> None:
        if self._request is not None and now_s >= self._request[1]:
            self._change(self._request[0], "unanswered")
            self._request = None

    def _change(self, driver: str | None, how: SeatChangeReason) -> None:
        before, self._driver = self._driver, driver
        self._on_change(before, driver, how)


class FreeSeat:
    """Decides whether a page may take the lease when it is free.

    The driver's next page may at once, as after a reload; another one only after it has been alone for
    :data:`ALONE_S`: else one who watches would drive as soon as the driver goes to another page.
    """

    def __init__(self) -> None:
        self._alone_since_s = math.inf

    def is_for(self, *, drove_last: bool | None, is_alone: bool, now_s: float) -> bool:
        """Return whether it may.

        Args:
            drove_last: Whether the viewer of the page drove last; None if there has not been a driver.
            is_alone: Whether there is no other page.
            now_s: The time.
        """
        self._alone_since_s = min(self._alone_since_s, now_s) if is_alone else math.inf
        if drove_last is None:
            return is_alone
        return drove_last or now_s - self._alone_since_s >= ALONE_S


N = TypeVar("N", bound=Node)


class OnDemandNode(Generic[N]):
    """Starts a new node from ``make`` for the first viewer, and stops it after the last; thread-safe."""

    def __init__(self, make: Callable[[], N]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._viewers: set[Hashable] = set()
        self._node: N | None = None
        self._closed = False

    @property
    def running(self) -> N | None:
        """The node while there are viewers, else None."""
        return self._node

    def join(self, viewer: Hashable) -> N | None:
        """Return the running node, or None after :meth:`close`; joining twice counts once."""
        with self._lock:
            if self._closed:
                return None
            self._viewers.add(viewer)
            if self._node is None:
                self._node = self._make()
                self._node.start()
            return self._node

    def is_watched_by(self, viewer: Hashable) -> bool:
        """Return whether ``viewer`` has joined, and has neither left nor been disconnected by :meth:`close`."""
        return viewer in self._viewers

    def is_watched_only_by(self, viewer: Hashable) -> bool:
        """Return whether ``viewer`` is watching, and no other viewer is."""
        with self._lock:
            return self._viewers == {viewer}

    def leave(self, viewer: Hashable) -> None:
        """Remove ``viewer``; has no effect if it has not joined."""
        with self._lock:
            self._viewers.discard(viewer)
            if not self._viewers:
                self._stop()

    def close(self) -> None:
        """Stop the node permanently, with or without viewers."""
        with self._lock:
            self._closed = True
            self._viewers.clear()
            self._stop()

    def _stop(self) -> None:
        if self._node is not None:
            self._node.stop()
            self._node = None


_MOST_SESSIONS = 1000
_UNKNOWN = "a viewer"
_NO_DRIVER = "dashboard"


class PageAudit:
    """Publishes what viewers do; may be called on any thread.

    Attributes:
        driver: Name of the driver, or of the last one.
        on_driver: Called with the viewer that has got the seat, or None if it is free; must return at once.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self.driver = _NO_DRIVER
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
        """Name a viewer that is not a page but a program by its own name."""
        with self._lock:
            self._names[viewer] = viewer

    def forget(self, viewer: str) -> None:
        """Forget the name of a viewer who has left."""
        with self._lock:
            self._names.pop(viewer, None)

    def name_of(self, viewer: str) -> str:
        """Return the name of ``viewer``, such as ``viewer 1 (127.0.0.1)``."""
        return self._names.get(viewer, _UNKNOWN)

    def drove_last(self, viewer: str) -> bool | None:
        """Return whether ``viewer`` is the driver, or was the last one; None if there has not been one."""
        return None if self.driver == _NO_DRIVER else self.driver == self.name_of(viewer)

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

    def on_seat(self, before: str | None, after: str | None, how: SeatChangeReason) -> None:
        """Publish who has left the seat and who has taken it."""
        self.on_driver(after)
        leaver, taker = (viewer and self.name_of(viewer) for viewer in (before, after))
        if before is not None:
            left = {"handed_over": f"handed the seat over to {taker}", "unanswered": "lost the seat: gave no answer"}
            code: AuditCode = "seat_lost" if how == "unanswered" else "seat_left"
            self.say(code, before, left.get(how, "left the seat"))
        if after is not None:
            self.driver = str(taker)
            taken = {
                "free": "took the seat, which was free",
                "handed_over": f"took the seat, which {leaver} handed over",
                "unanswered": f"took the seat from {leaver}, who gave no answer",
                "left": f"took the seat, which {leaver} left",
            }
            self.say("seat_taken", after, taken[how])
