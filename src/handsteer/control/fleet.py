"""Which of several robots one hand drives."""

from collections.abc import Sequence

NEXT = "next"
"""What may be asked for instead of a name."""


class Fleet:
    """Robots of which one is driven at a time.

    After a change, neither signs nor steering drive the new robot before each has let go once: a hand that still shows
    what it showed the old robot does not set the new one in motion.

    Args:
        names: The robots' names, at least one; the first is driven first.

    Attributes:
        selected: Name of the robot that is driven.
        holds_signs: Whether signs wait for one that stops.
        holds_steering: Whether steering waits for a zero, or for a pause.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self.selected = self._names[0]
        self.holds_signs = False
        self.holds_steering = False

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
        self.holds_signs = self.holds_steering = True
        return True

    def let_sign_pass(self, *, stops: bool) -> bool:
        """Note a sign that ``stops`` or does not; return whether the robot may follow it."""
        self.holds_signs = self.holds_signs and not stops
        return not self.holds_signs

    def let_steering_pass(self, *, is_zero: bool, after_pause: bool) -> bool:
        """Note a steering command, zero or not, the first after a pause or not; return whether to follow it."""
        self.holds_steering = self.holds_steering and not (is_zero or after_pause)
        return not self.holds_steering
