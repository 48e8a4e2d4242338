"""Keeps a robot standing after it was stopped, or chosen, until whoever drives has let go once."""


class Hold:
    """While it lasts, neither signs nor steering set the robot in motion; each ends it for itself by letting go.

    A hand that still shows what it showed before, or a pad that is still held, moves nothing: to begin, one has to
    begin anew.

    Attributes:
        signs: Whether signs wait for one that stops.
        steering: Whether steering waits for a zero, or for a pause.
    """

    def __init__(self) -> None:
        self.signs = False
        self.steering = False

    def begin(self) -> None:
        """Hold both from now on."""
        self.signs = self.steering = True

    def let_sign_pass(self, *, stops: bool) -> bool:
        """Note a sign that ``stops`` or does not; return whether the robot may follow it."""
        self.signs = self.signs and not stops
        return not self.signs

    def let_steering_pass(self, *, is_zero: bool, after_pause: bool) -> bool:
        """Note a steering command, zero or not, the first after a pause or not; return whether to follow it."""
        self.steering = self.steering and not (is_zero or after_pause)
        return not self.steering
