"""Nodes that run only while somebody watches: no viewer, no cost."""

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from handsteer.nodes.node import Node

N = TypeVar("N", bound=Node)


class OnDemandNode(Generic[N]):
    """Makes and starts a node for the first viewer, and stops it after the last; may be used from any thread.

    Args:
        make: Returns a new node, not started.
    """

    def __init__(self, make: Callable[[], N]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._viewers: set[Hashable] = set()
        self._node: N | None = None
        self._closed = False

    def join(self, viewer: Hashable) -> N | None:
        """Return the running node, or None after :meth:`close`; ``viewer`` counts once, however often it joins."""
        with self._lock:
            if self._closed:
                return None
            self._viewers.add(viewer)
            if self._node is None:
                self._node = self._make()
                self._node.start()
            return self._node

    def is_watched_by(self, viewer: Hashable) -> bool:
        """Return whether ``viewer`` has joined, and neither left nor been sent away by :meth:`close`."""
        return viewer in self._viewers

    def leave(self, viewer: Hashable) -> None:
        """Do without the node; one that has not joined may leave."""
        with self._lock:
            self._viewers.discard(viewer)
            if not self._viewers:
                self._stop()

    def close(self) -> None:
        """Stop the node, whoever watches, for good."""
        with self._lock:
            self._closed = True
            self._viewers.clear()
            self._stop()

    def _stop(self) -> None:
        if self._node is not None:
            self._node.stop()
            self._node = None
