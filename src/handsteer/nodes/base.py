"""Base class of all nodes: subscriptions, timers, and the thread that runs their callbacks."""

import functools
import logging
import threading
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import PLUGIN_FAILURES
from handsteer.messages import AUDIT, DIAGNOSTICS, Topic
from handsteer.nodes.auditing import Auditor
from handsteer.nodes.callbacks import FailureLog, Inbox, Queue, Timer
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.journal import Journal
from handsteer.nodes.status import Status
from handsteer.transports.base import Call, Publisher, Received, Subscription, Transport

M = TypeVar("M")
log = logging.getLogger(__name__)

_LOOK_FOR_LISTENERS_S = 0.5


class _Subscription:
    """A subscription of a node, whose inbox goes with it."""

    def __init__(self, subscription: Subscription, forget: Callable[[], None]) -> None:
        self._subscription, self._forget = subscription, forget

    def close(self) -> None:
        self._subscription.close()
        self._forget()


class Node:
    """A named part of the graph; its callbacks and timers never run concurrently.

    Run it on its own thread (:meth:`start`, :meth:`stop`); a node that :attr:`is_quick` also uses the threads that
    deliver its messages, which saves a switch of threads. Alternatively, the caller runs it step by step
    (:meth:`spin_once`, :attr:`next_due_s`) on a :class:`~handsteer.clock.SteppedClock`.

    A callback that raises is logged with its topic and counted in :attr:`callback_errors`, and the node continues.
    Repeated failures are logged every :data:`~handsteer.nodes.callbacks.FAILURES_LOGGED_EVERY_S`.

    Args:
        name: ROS node name.
        transport: Carries the messages.
        clock: The graph's clock, which timers follow.

    Attributes:
        is_quick: Whether all callbacks always return within a fraction of a millisecond.
        is_managed: Whether a graph with managed nodes may deactivate it (:meth:`set_active`).
        is_active: Whether it acts on what it receives. While it does not, callbacks and timers go on; the node itself
            ensures that nothing follows from them.
        ended: Set when the node has finished.
        callback_errors: Number of failed callbacks.
        stuck: True if a callback was still running when :meth:`stop` timed out.
        journal: Notes what the node reads from outside, for a replay; None without one.
    """

    is_quick = False
    is_managed = False
    is_active = True
    journal: Journal | None = None

    def __init__(self, name: str, transport: Transport, clock: Clock) -> None:
        self.name = name
        self.clock = clock
        self.ended = threading.Event()
        self.callback_errors = 0
        self.stuck = False
        self.transport = transport
        self._inboxes: list[Inbox[Any]] = []
        self._timers: list[Timer] = []
        self._new_config: Config | None = None
        self._failures = FailureLog(name)
        self._subscriptions: dict[Inbox[Any], Subscription] = {}
        self._wake = threading.Condition()
        self._serving = threading.Lock()
        self._running = False
        self._stopped = False
        self._thread: threading.Thread | None = None
        self._topics: dict[str, set[str]] = {"publishes": set(), "listens to": set()}
        self._diagnostics = self.publisher(DIAGNOSTICS)

    @functools.cached_property
    def auditor(self) -> Auditor:
        """Publishes on ``/audit``; nodes that do not use it do not advertise the topic."""
        self._topics["publishes"].add(self.transport.topic_name(AUDIT))
        return Auditor(self.transport, self.name, self.clock)

    @property
    def topics(self) -> str:
        """The topics it publishes and subscribes, in words, by their names in the graph."""
        return "; ".join(f"{does} {', '.join(sorted(names)) or 'nothing'}" for does, names in self._topics.items())

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Return a publisher of ``topic``."""
        self._topics["publishes"].add(self.transport.topic_name(topic))
        return self.transport.advertise(self.name, topic)

    def subscribe(
        self,
        topic: Topic[M],
        callback: Callable[[Received[M]], None],
        key: Callable[[M], Hashable] | None = None,
        queue: Queue[M] | None = None,
    ) -> Subscription:
        """Call ``callback`` with the newest message of ``topic``; older unprocessed messages are dropped.

        For a topic with a depth, that many of the newest messages are kept, and processed in order.

        Args:
            topic: What to subscribe to.
            callback: Runs on this node's thread.
            key: For a topic with several publishers: keeps the newest message for each value of ``key(message)``.
            queue: Where messages wait that are processed each, in order; one in each spin.

        Returns:
            Ends the subscription when closed, with what waits to be processed; so does the end of the node.
        """
        name = self.transport.topic_name(topic)
        self._topics["listens to"].add(name)
        inbox = Inbox(name, callback, key, 1 if key else topic.depth, queue)
        self._inboxes.append(inbox)

        def deliver(received: Received[M]) -> None:
            with self._wake:
                inbox.put(received)
            # If callbacks are running already, this thread may be inside one.
            if self.is_quick and self._running and self._serving.acquire(blocking=False):
                try:
                    self.spin_once()
                finally:
                    self._serving.release()
            else:
                with self._wake:
                    self._wake.notify()

        subscription = _Subscription(self.transport.subscribe(self.name, topic, deliver), lambda: self._remove(inbox))
        self._subscriptions[inbox] = subscription
        return subscription

    def _remove(self, inbox: Inbox[Any]) -> None:
        with self._wake:
            self._subscriptions.pop(inbox, None)
            if inbox in self._inboxes:
                self._inboxes.remove(inbox)

    def every(self, period_s: float, callback: Callable[[], None]) -> "Timer":
        """Call ``callback`` every ``period_s`` seconds; missed calls are skipped, not made up for."""
        timer = Timer(period_s, callback, self.clock.now())
        self._timers.append(timer)
        return timer

    def diagnose_every(self, period_s: float, status: Callable[[], Status]) -> None:
        """Publish ``status()``, the state of this node, on ``/diagnostics`` every ``period_s`` seconds.

        Without subscribers it is skipped; a new subscriber receives its first report within half a second. Faults are
        also published on ``/audit``, when they begin and end.
        """

        def beat() -> None:
            is_watched = self._diagnostics.has_subscribers
            if is_watched or self.auditor.has_listeners:
                report, now = status(), self.clock.now()
                if is_watched:
                    name = self.transport.full_name(self.name)
                    self._diagnostics.publish(write_status(report, name, self.clock.stamp(now)))
                self.auditor.look_at_status(report, now)
            if not is_watched:
                timer.delay_until(self.clock.now() + _LOOK_FOR_LISTENERS_S)

        _ = self.auditor  # advertised now, so that others find it before it is used
        timer = self.every(period_s, beat)

    def reconfigure(self, config: Config) -> None:
        """Apply the parameters of ``config`` that can change while the node runs (``live`` of each section).

        Returns at once; the node applies them on its own thread before its next callback. May be called from any
        thread.
        """
        with self._wake:
            self._new_config = config
            self._wake.notify()

    @property
    def next_due_s(self) -> float | None:
        """When the next timer is due, on the graph's clock; None without timers."""
        return min((timer.due_s for timer in self._timers), default=None)

    def spin_once(self) -> bool:
        """Apply a new configuration, and run the callbacks of received messages and the timers that are due.

        Returns:
            Whether anything was done.
        """
        with self._wake:
            config, self._new_config = self._new_config, None
            work = [(inbox, received) for inbox in self._inboxes if inbox.filled for received in inbox.take()]
        if self.journal is not None:
            self.journal.begin(config, [(inbox.topic, received) for inbox, received in work])
        if config is not None:
            self._guard("reconfigure", self.on_reconfigure, config)
        for inbox, received in work:
            self._guard(inbox.topic, inbox.callback, received)
        now = self.clock.now()
        due = [timer for timer in self._timers if timer.due_s <= now]
        for timer in due:
            timer.schedule_next(now)
            self._guard("timer", timer.callback)
        was_busy = bool(work or due or config is not None)
        if self.journal is not None:
            self.journal.end(keep=was_busy)
        return was_busy

    def start(self) -> None:
        """Run callbacks and timers on a thread of its own."""
        self._running = True
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    def stop(self, timeout_s: float = 0.5) -> None:
        """End all subscriptions and the thread, then call :meth:`on_stop`; may be called twice.

        Args:
            timeout_s: How long to wait for a running callback; after that :attr:`stuck` is True.
        """
        if self._stopped:
            return
        self._stopped = True
        for subscription in list(self._subscriptions.values()):
            self._guard("stop", subscription.close)
        with self._wake:
            self._running = False
            self._wake.notify()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout_s)
            self.stuck = self._thread.is_alive()
        is_free = self._serving.acquire(timeout=0.0 if self.stuck else timeout_s)
        try:
            self.stuck = not is_free
            if self.journal is not None:
                self.journal.begin(None, (), is_stop=True)
            self._guard("stop", self.on_stop)
            if self.journal is not None:
                self.journal.end()
        finally:
            if is_free:
                self._serving.release()

    def set_active(self, is_active: bool, timeout_s: float = 1.0) -> bool:
        """Activate or deactivate the node, between two of its callbacks; return whether it has happened.

        When it returns, what the node publishes last was published. May be called from any thread but the node's.

        Args:
            is_active: The new state; setting the current one has no effect.
            timeout_s: How long to wait for a running callback.
        """
        if not self._serving.acquire(timeout=timeout_s):
            return False
        try:
            if is_active != self.is_active:
                self._guard("lifecycle", self.on_activate if is_active else self.on_deactivate)
                self.is_active = is_active
                log.info("%s is %s", self.name, "active" if is_active else "deactivated")
        finally:
            self._serving.release()
        return True

    def check(self, config: Config) -> None:
        """Raise ConfigError if :meth:`reconfigure` could not apply ``config``; may be called from any thread."""

    def on_reconfigure(self, config: Config) -> None:
        """Apply the parameters of ``config`` that can change; by default there are none."""

    def services(self) -> dict[str, Call]:
        """Return the services of this node by name; by default there are none."""
        return {}

    def on_activate(self) -> None:
        """Begin again: what was received before says nothing of now."""

    def on_deactivate(self) -> None:
        """Publish what others need to know last."""

    def on_stop(self) -> None:
        """Clean up; called last, also after an exception."""

    def _run(self) -> None:
        while self._running:
            with self._serving:
                was_busy = self.spin_once()
            if not was_busy:
                self._wait()

    def _wait(self) -> None:
        with self._wake:
            while self._running and not self._has_work:
                due = self.next_due_s
                self.clock.wait(self._wake, None if due is None else max(0.0, due - self.clock.now()))

    @property
    def _has_work(self) -> bool:
        # A timer may have been delayed meanwhile.
        due = self.next_due_s
        is_due = due is not None and due <= self.clock.now()
        return is_due or self._new_config is not None or any(inbox.filled for inbox in self._inboxes)

    def _guard(self, source: str, callback: Callable[..., None], *args: object) -> None:
        try:
            callback(*args)
        except PLUGIN_FAILURES as error:
            self.callback_errors += 1
            self._failures.add(source, error, self.clock.now())
