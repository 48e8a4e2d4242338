"""Attached to nodes: publishes on ``/audit`` what they do and what changes, at a limited rate."""

import logging
from collections.abc import Callable, Hashable
from dataclasses import dataclass

from handsteer.audit import ERROR, INFO, WARN, AuditCode, AuditEvent, write_event
from handsteer.clock import Clock
from handsteer.control import Source
from handsteer.control.engagement import Engagement
from handsteer.control.explain import Reason
from handsteer.control.safety import Safety
from handsteer.messages import AUDIT
from handsteer.nodes import status
from handsteer.transports.base import Transport

HOLD_S = 0.5
"""Least time between two events about the same state; one that changes faster is reported as often as this."""

_STARTS_S = 3.0
_MOST_KEPT = 500

log = logging.getLogger(__name__)

Tell = Callable[[], AuditEvent]


@dataclass
class _State:
    reported: Hashable
    reported_s: float = float("-inf")
    value: Hashable = None
    since_s: float = 0.0


class Auditor:
    """Publishes events.

    Args:
        transport: Carries the messages.
        node: Name of the node that publishes.
        clock: The graph's clock; it is only asked for stamps, so that a replay of the node needs no further readings.

    Attributes:
        who: Name of the node's own process, with its namespace, or of the node in a process of several.
    """

    def __init__(self, transport: Transport, node: str, clock: Clock) -> None:
        self._publisher = transport.advertise(node, AUDIT)
        self._clock = clock
        process, _, name = transport.full_name(node).rpartition(": ")
        self.who = process or name
        self._states: dict[str, _State] = {}
        self._last: dict[tuple[str, str], tuple[str, float]] = {}
        self._began_s: float | None = None

    @property
    def has_listeners(self) -> bool:
        """Whether the topic has subscribers."""
        return self._publisher.has_subscribers

    def event(self, code: AuditCode, sentence: str, about: str = "", level: int = INFO) -> AuditEvent:
        """Return an event of this node."""
        return AuditEvent(code, self.who, sentence, about, level)

    def say(self, event: AuditEvent, at_s: float) -> None:
        """Publish ``event``, of the time ``at_s`` of the graph's clock; not if it is repeated within :data:`HOLD_S`."""
        key = (event.code, event.who)
        sentence, said_s = self._last.get(key, ("", 0.0))
        if sentence == event.sentence and abs(at_s - said_s) < HOLD_S:
            return
        if len(self._last) >= _MOST_KEPT:  # there may be any number of viewers
            self._last.clear()
        self._last[key] = (event.sentence, at_s)
        self._publisher.publish(write_event(event, self._clock.stamp(at_s)))

    def look(self, state: str, value: Hashable, at_s: float, tell: Tell, first: Hashable = None) -> None:
        """Publish ``tell()`` if the value of ``state`` is not the one that was last reported.

        Args:
            state: What is observed.
            value: Its present value.
            at_s: Present time, in seconds of the graph's clock.
            tell: Returns the event.
            first: The value that needs not be reported at the beginning.
        """
        known = self._states.setdefault(state, _State(first, value=first))
        if value != known.value:
            known.value, known.since_s = value, at_s
        if value != known.reported and at_s - known.reported_s >= HOLD_S:
            known.reported, known.reported_s = value, at_s
            self.say(tell(), known.since_s)

    def look_at_status(self, report: status.Status, at_s: float) -> None:
        """Publish when a node begins and ceases to report a problem; not while it starts, when nothing has come yet."""
        if self._began_s is None:
            self._began_s = at_s
        if report.level == status.OK or "fault" in self._states or at_s - self._began_s > _STARTS_S:
            is_fault = report.level > status.OK
            level = ERROR if report.level == status.ERROR else WARN if is_fault else INFO
            code: AuditCode = "fault" if is_fault else "fault_ended"
            sentence = report.message if is_fault else f"has recovered: {report.message}"
            self.look("fault", is_fault, at_s, lambda: self.event(code, sentence, "status", level), first=False)


class ControlAudit:
    """The transitions of ``hand_sign_control``.

    Args:
        auditor: Publishes them.
        stoppers: Returns the nodes that publish ``/stop``.
    """

    def __init__(self, auditor: Auditor, stoppers: Callable[[], str]) -> None:
        self._auditor = auditor
        self._stoppers = stoppers
        self._waited, self._engaged = False, True

    def look(self, safety: Safety, source: Source, reason: Reason, at_s: float) -> None:
        """Publish what has changed until ``at_s``."""
        look, event = self._auditor.look, self._auditor.event
        stopped, engaged, waits = safety.is_stopped, safety.engagement.engaged, safety.signs_wait
        self._log_interlocks(waits, safety.engagement)
        look("stopped", stopped, at_s, lambda: self._stop_event(stopped), first=False)
        look("armed", waits, at_s, lambda: self._arming_event(waits))
        words = "the hand drives" if engaged else "the hand drives nothing until it has engaged"
        look("engaged", engaged, at_s, lambda: event("engaged" if engaged else "disengaged", words), first=True)
        look("source", source, at_s, lambda: event("source_changed", f"follows {_SOURCES[source]}", source), "none")
        code: AuditCode = "drives" if reason.is_driving else "stands"
        look("motion", (code, reason.code), at_s, lambda: event(code, str(reason), reason.code))

    def stalled(self, at_s: float) -> None:
        """Publish that the control was stalled until ``at_s``."""
        self._auditor.say(self._auditor.event("fault", "was stalled, and stopped the robot", "stalled", WARN), at_s)

    def ended(self, at_s: float) -> None:
        """Publish that the control ends at ``at_s``, and stops the robot."""
        self._auditor.say(self._auditor.event("stands", "standing: the control has ended", "ended"), at_s)

    def _stop_event(self, stopped: bool) -> AuditEvent:
        by = f"; /stop is published by {self._stoppers()}"
        if stopped:
            return self._auditor.event("stopped", f"stopped, until it is reset{by}", level=WARN)
        return self._auditor.event("reset", f"reset{by}")

    def _arming_event(self, waits: str | None) -> AuditEvent:
        if waits is None:
            return self._auditor.event("armed", "signs count")
        why = waits or "was reset"
        return self._auditor.event("disarmed", f"disarmed ({why}): nothing moves by signs before Stop, or no hand", why)

    def _log_interlocks(self, waits: str | None, engagement: Engagement) -> None:
        """Log when the hand begins and ceases to wait for neutral, or to have to engage, for users without the page."""
        if waits is not None and not self._waited:
            why = waits or "after a reset"
            log.info("disarmed (%s): nothing moves by signs before Stop was shown, or no hand", why)
        elif self._waited and waits is None:
            log.info("armed: signs count %s", "again" if engagement.engaged else "once the hand has engaged")
        if engagement.engaged != self._engaged:
            log.info("engaged: the hand drives" if engagement.engaged else str(engagement.reason))
        self._waited, self._engaged = waits is not None, engagement.engaged


_SOURCES: dict[Source, str] = {
    "none": "nothing",
    "signs": "signs",
    "joystick": "the hand as a joystick",
    "steering": "direct steering",
}
