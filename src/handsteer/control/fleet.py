"""Which of several robots one hand drives."""

from collections.abc import Sequence

NEXT = "next"
"""What may be asked for instead of a name."""


class Fleet:
    """Robots of which one is driven at a time.

    Args:
        names: The robots' names, at least one; the first is driven first.

    Attributes:
        selected: Name of the robot that is driven.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self.selected = self._names[0]

    @property
    def names(self) -> tuple[str, ...]:
        """All robots, in their order."""
        return self._names

    def select(self, name: str) -> bool:
        """Drive the robot ``name``, or the next one for :data:`NEXT`; return whether that is another than before.

        A name that is not known changes nothing.
        """
        if name == NEXT:
            name = self._names[(self._names.index(self.selected) + 1) % len(self._names)]
        if name == self.selected or name not in self._names:
            return False
        self.selected = name
        return True
