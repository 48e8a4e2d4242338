"""The thread that processes everything received over DDS."""

import logging
import threading
from collections.abc import Callable
from typing import Any

from cyclonedds.core import GuardCondition, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader

log = logging.getLogger(__name__)

_TICK_S = 0.25
_NS_PER_S = 1_000_000_000
_AFTER_FAILURE_S = 0.05
_LEAVE_TIMEOUT_S = 2.0
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


class Dispatcher:
    """Calls a function for each reader that has messages.

    Listeners would run on the threads of Cyclone DDS, which hold its locks while they wait for Python's.
    """

    def __init__(self, participant: DomainParticipant) -> None:
        # Referenced while the thread runs: a start interrupted by a signal drops the participant without closing it.
        self._participant: DomainParticipant | None = participant
        self._waitset = WaitSet(participant)
        self._guard = GuardCondition(participant)
        self._waitset.attach(self._guard)
        self._ticks: tuple[Callable[[], None], ...] = ()
        self._lock = threading.Lock()
        self._served: dict[DataReader[Any], tuple[ReadCondition, Callable[[], None]]] = {}
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="dds", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def add(self, reader: DataReader[Any], serve: Callable[[], None]) -> None:
        """Call ``serve``, which must take all messages, whenever ``reader`` has some."""
        condition = ReadCondition(reader, _ANY)
        with self._lock:
            self._served[reader] = (condition, serve)
            self._waitset.attach(condition)

    def tick(self, call: Callable[[], None]) -> None:
        """Call ``call`` four times a second, and whenever something was received."""
        with self._lock:
            self._ticks = (*self._ticks, call)

    def remove(self, reader: DataReader[Any]) -> None:
        """Stop calling for ``reader``; one call may still be running."""
        with self._lock:
            condition, _ = self._served.pop(reader)
            self._waitset.detach(condition)

    def close(self) -> None:
        """End the thread; may be called twice."""
        if not self._closing.is_set():
            self._closing.set()
            self._guard.set(True)
            if self._thread.is_alive() and self._thread is not threading.current_thread():
                self._thread.join(_LEAVE_TIMEOUT_S)
            for reader in list(self._served):
                self.remove(reader)
            self._participant = None

    def _run(self) -> None:
        while not self._closing.is_set():
            self._guarded(self._wait)
            self._serve_all()
            for call in self._ticks:
                self._guarded(call)

    def _wait(self) -> None:
        self._waitset.wait(round(_TICK_S * _NS_PER_S))

    def _serve_all(self) -> None:
        with self._lock:
            served = list(self._served.values())
        for condition, serve in served:
            # Checking is cheaper than an empty take, and usually only one reader has messages.
            if condition.triggered:
                self._guarded(serve)

    def _guarded(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception:
            if not self._closing.is_set():
                log.exception("DDS: a message could not be served")
                self._closing.wait(_AFTER_FAILURE_S)  # repeated failures must not use up the processor
