"""Whether a person means it: the clutch between hand and robot, and whether what drives has changed lately.

Pure rules without a clock, as in :mod:`handsteer.control.safety`.
"""

import math
from typing import Literal

from handsteer.control.explain import Reason
from handsteer.timeouts import DISENGAGE_S, ENGAGE_S, FAULT_GAP_S
from handsteer.types import NONE, STOP

EngagedBy = Literal["gesture", "hold"]
SteeredBy = Literal["steering", "gamepad"]

Steered = SteeredBy | Literal["signs", "joystick"]
"""What can drive, each with a neutral of its own."""

_SLACK_S = 1e-9

_TREMOR = 0.05
"""A stick that moves by no more than this share of its range, as a held one does, has not changed."""


class Engagement:
    """The clutch between hand and robot: while disengaged, nothing moves whatever is shown.

    A gesture engages, which recognition sees: open, close, open. Or, if so configured, an open palm (``Stop``) held for
    :data:`~handsteer.timeouts.ENGAGE_S`, which a picture of one can do too. :data:`~handsteer.timeouts.DISENGAGE_S`
    without a sign, a Stop or a fault disengage. It prevents what is known as the Midas touch: everyday movements of the
    hand that are taken for commands.

    Args:
        enabled: If not, the hand is always engaged.
        by: What engages; may be changed.

    Attributes:
        engaged: Whether the hand drives.
    """

    def __init__(self, *, enabled: bool, by: EngagedBy = "hold") -> None:
        self._enabled = enabled
        self.by: EngagedBy = by
        self.engaged = not enabled
        self._was_done = True
        self._palm_s = 0.0
        self._idle_s = 0.0
        self._gap_s = math.inf

    @property
    def progress(self) -> float:
        """Progress of engaging, 0 to 1; that of the gesture is not known here."""
        if self.engaged or self.by == "gesture":
            return float(self.engaged)
        return min(1.0, self._palm_s / ENGAGE_S)

    @property
    def reason(self) -> Reason:
        """What has to be done to engage."""
        return Reason("disengaged", f"{ENGAGE_S:g}" if self.by == "hold" else "")

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds, >= 0."""
        self._idle_s += dt_s
        self._gap_s += dt_s
        if self._idle_s >= DISENGAGE_S - _SLACK_S:
            self.disengage()

    def note_sign(self, sign: str) -> None:
        """Record the sign of a frame."""
        if sign != NONE:
            self._idle_s = 0.0
        if sign != STOP:
            self._palm_s, self._gap_s = 0.0, math.inf
            return
        # The time before the first palm, or of a pause, was not observed.
        self._palm_s = self._palm_s + self._gap_s if self._gap_s < FAULT_GAP_S else 0.0
        self._gap_s = 0.0
        if self.by == "hold" and self._palm_s >= ENGAGE_S - _SLACK_S:
            self.engaged = True

    def note_gesture(self, *, is_done: bool) -> None:
        """Record of a frame whether the gesture has just been made; only where it was not yet in the frame before."""
        if is_done and not self._was_done and self.by == "gesture" and self._gap_s < FAULT_GAP_S:
            self.engaged = True
        self._was_done = is_done

    def disengage(self) -> None:
        """Require that the hand engages again; without effect if not enabled."""
        self._palm_s, self._gap_s = 0.0, math.inf
        self._was_done = True
        self.engaged = not self._enabled


class Renewal:
    """Whether what drives has changed lately, as the vigilance device of a train asks for.

    A picture that a camera repeats with noise cannot be distinguished from a still hand, nor a stick that is stuck from
    one that is held; neither changes. A change is another sign, a release, or a movement of the stick by more than
    :data:`_TREMOR`.

    Args:
        enabled: If not, nothing has to be renewed.
        limit_s: After this long without a change, in seconds; may be changed.
    """

    def __init__(self, *, enabled: bool, limit_s: float) -> None:
        self._enabled = enabled
        self.limit_s = limit_s
        self._shown: dict[Steered, str | tuple[float, ...]] = {}
        self._same_s: dict[Steered, float] = {}

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        for by in self._same_s:
            self._same_s[by] += dt_s

    def note(self, by: Steered, shown: str | tuple[float, ...]) -> None:
        """Record a sign, or the deflections of a stick, -1 to 1; at zero it is released."""
        before = self._shown.get(by)
        if isinstance(shown, str) or isinstance(before, str) or before is None:
            is_same = shown == before
        else:
            is_same = any(shown) and all(abs(now - then) <= _TREMOR for now, then in zip(shown, before, strict=True))
        if not is_same:
            self._shown[by], self._same_s[by] = shown, 0.0

    def left_s(self, by: Steered) -> float:
        """Return how long ``by`` may drive without a change from now on, in seconds."""
        return self.limit_s - self._same_s.get(by, 0.0) if self._enabled else math.inf
