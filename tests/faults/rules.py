"""The rules of docs/safety.md as an onlooker would keep them: when may a robot be asked to move at all?

This is not a copy of the code: it knows no node, filter or velocity, only what was shown, said and done, and when.
It is generous: where nodes may take up to half a second, so does it.
"""

import math
from dataclasses import dataclass

PATIENCE_S = 0.5
"""What outlives its reason by more than this is a fault."""
SURELY_A_GAP_S = 0.6
"""A silence of this length is one for every node."""
STICK_PAUSE_S = 0.35
"""Steering that was silent for so long, and had not let go before, has to."""
BRIDGED_S = 0.2
"""A sign that was shown so recently may still be seen."""
CONFIRMED_S = 0.2
"""A new sign counts by then."""
CHANGES = 2
"""So many new signs, one after the other, may count as none."""
_EPSILON_S = 1e-6


@dataclass
class Rules:
    """What an onlooker knows.

    Attributes:
        now_s: The time.
        is_stopped: Whether somebody has said Stop, and nobody has taken it back.
        renew_s: For how long the same may be asked for without any change.
    """

    now_s: float = 0.0
    is_stopped: bool = False
    renew_s: float = math.inf
    _hand_asked_s: float = -math.inf
    _stick_asked_s: float = -math.inf
    _stick_spoke_s: float = -math.inf
    _stick_asks: bool = False
    _stick_speed: float = 0.0
    _stick_changed_s: float = -math.inf
    _picture_s: float = -math.inf
    _hand_was_neutral: bool = False
    _stick_was_neutral: bool = False
    _robot_waits: bool = False
    _sign: str = "NONE"
    _changed_s: float = -math.inf
    _is_neutral: bool = False
    _changes: int = 0
    _stands_by_s: float = math.inf

    def picture(self, sign: str, *, asks: bool) -> None:
        """A live camera shows a hand with a sign that asks for motion, or one that does not, or none."""
        if sign != self._sign:
            self._changed_s = self.now_s
        # While a new sign is not confirmed yet, zero is commanded: that is what a robot waits for that was away.
        self._robot_waits = self._robot_waits and asks and sign == self._sign
        if self.now_s - self._picture_s > SURELY_A_GAP_S:
            self._hand_was_neutral, self._changes = False, 0
        # A hand that changes its sign again and again shows none for half a second, as far as the control can tell.
        self._changes += sign != self._sign
        self._hand_was_neutral = self._hand_was_neutral or self._changes >= CHANGES
        self._sign, self._is_neutral = sign, not asks
        self._picture_s = self.now_s
        if asks:
            self._hand_asked_s = self.now_s
        else:
            self._hand_was_neutral = True

    def stick(self, *, asks: bool, speed: float) -> None:
        """Somebody holds the stick, or lets go: no pause stands for that."""
        if speed != self._stick_speed or not asks:
            self._stick_speed, self._stick_changed_s = speed, self.now_s
        paused = self.now_s - self._stick_spoke_s >= STICK_PAUSE_S - _EPSILON_S
        # A stick that was released before and is deflected now asks anew.
        self._robot_waits = self._robot_waits and asks and self._stick_asks
        is_lost = paused and self._stick_asks
        self._stick_asks = asks
        self._stick_was_neutral = not asks or (self._stick_was_neutral and not is_lost)
        self._stick_spoke_s = self.now_s
        if asks:
            self._stick_asked_s = self.now_s

    def stop(self) -> None:
        """Somebody says Stop: a robot that moves may do so for a moment yet, where the word takes its time."""
        self.is_stopped = True
        self._stands_by_s = min(self._stands_by_s, self.now_s + PATIENCE_S)

    def reset(self) -> None:
        """Somebody takes the Stop back: whoever drives has to let go before anything moves."""
        if self.is_stopped:
            # What is shown just now is still seen for a moment.
            shows_neutral = self._is_neutral and self.now_s - self._picture_s <= BRIDGED_S
            self.disarm()
            self._hand_was_neutral = shows_neutral
        self.is_stopped = False

    def disarm(self, *, stick: bool = True) -> None:
        """Something was started, frozen, or away: whoever drives, by the stick too, has to let go first."""
        self._hand_was_neutral = False
        self._stick_was_neutral = self._stick_was_neutral and not stick
        self._changes = 0
        self._stands_by_s = min(self._stands_by_s, self.now_s + PATIENCE_S)

    def robot_was_away(self) -> None:
        """The robot could not hear: whatever was asked of it then is not meant for it now.

        Where the sign has just changed, the zero that it waits for is still to come.
        """
        self._robot_waits = self.now_s - self._changed_s > CONFIRMED_S
        self._stands_by_s = min(self._stands_by_s, self.now_s + PATIENCE_S)

    def recognition_begins(self) -> None:
        """It knows no sign yet: until one is confirmed, zero is commanded, which is what a robot waits for."""
        self._robot_waits = False

    def stands(self) -> None:
        """The robot stands: if it has to, then from now on."""
        if self._stands_by_s < math.inf:
            self._stands_by_s = -math.inf

    def why_not(self) -> str | None:
        """Return why the robot must not be asked to move now; None where it may."""
        by_hand = self._is_live(self._hand_asked_s) and self._hand_was_neutral and self._is_new(self._changed_s)
        by_stick = (
            self._is_live(self._stick_asked_s) and self._stick_was_neutral and self._is_new(self._stick_changed_s)
        )
        if (by_hand or by_stick) and not (self.is_stopped or self._robot_waits):
            self._stands_by_s = math.inf
            return None
        if self.now_s <= self._stands_by_s < math.inf:
            return None
        if self.is_stopped:
            return "Stop was said, and not taken back"
        if self._robot_waits:
            return "the robot was away, and nothing else was asked since"
        if self._is_live(self._hand_asked_s) or self._is_live(self._stick_asked_s):
            return "nobody has let go since it was started, frozen, stopped or away, or the same was asked for too long"
        return f"nobody has asked for it for {PATIENCE_S} s"

    def _is_new(self, changed_s: float) -> bool:
        return self.now_s - changed_s <= self.renew_s + PATIENCE_S + _EPSILON_S

    def _is_live(self, asked_s: float) -> bool:
        return self.now_s - asked_s <= PATIENCE_S + _EPSILON_S
