"""Selects which of several robots is driven."""

from collections.abc import Sequence

NEXT = "next"
"""Accepted by :meth:`Fleet.select` instead of a name."""


class Fleet:
    """Several robots, one of which is driven at a time.

    Args:
        names: Names of the robots, at least one; the first is selected initially.

    Attributes:
        selected: Name of the robot that is driven.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self.selected = self._names[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all robots, in order."""
        return self._names

    def select(self, name: str) -> bool:
        """Select the robot ``name``, or the next one for :data:`NEXT`; return whether the selection changed.

        An unknown name changes nothing.
        """
        if name == NEXT:
            name = self._names[(self._names.index(self.selected) + 1) % len(self._names)]
        if name == self.selected or name not in self._names:
            return False
        self.selected = name
        return True
