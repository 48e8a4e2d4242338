"""Who publishes what in a ROS 1 graph, as its master says when it is asked now and then."""

import logging
import threading

import rosgraph
import rospy

from handsteer.errors import TransportError
from handsteer.transports.ros1.master import Master

_PERIOD_S = 4.0

log = logging.getLogger(__name__)


class SystemState:
    """Asks the master every four seconds, on a thread of its own, from the first question on."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = threading.Event()
        self._publishers: dict[str, list[str]] = {}

    def publishers_of(self, topic: str) -> list[str]:
        """Return the nodes that publish the topic of this full name; none before the master has answered."""
        with self._lock:
            if self._thread is None and not self._closed.is_set():
                self._thread = threading.Thread(target=self._run, name="ros1_system_state", daemon=True)
                self._thread.start()
            return sorted(self._publishers.get(topic, []))

    def close(self) -> None:
        """Ask no more; may be called twice."""
        self._closed.set()
        with self._lock:
            self._publishers = {}

    def _run(self) -> None:
        master = Master(rosgraph.get_master_uri())
        while not self._closed.is_set():
            try:
                publishers = master.publishers(rospy.get_name())
            except TransportError as error:
                log.debug("%s", error)  # the session says it, and ends the node
            else:
                with self._lock:
                    self._publishers = {} if self._closed.is_set() else publishers
            self._closed.wait(_PERIOD_S)
