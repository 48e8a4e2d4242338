"""Nodes that run only while a page has viewers."""

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from handsteer.nodes.base import Node

N = TypeVar("N", bound=Node)


class OnDemandNode(Generic[N]):
    """Starts a new node from ``make`` for the first viewer, and stops it after the last; thread-safe."""

    def __init__(self, make: Callable[[], N]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._viewers: set[Hashable] = set()
        self._node: N | None = None
        self._closed = False

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
