"""Computes the commands sent to a robot behind a topic, without topic or clock."""

import math

from handsteer.config import RobotConfig
from handsteer.types import ZERO, Velocity

_LAST_ZEROS = 10
"""How many zeros follow the last command: one may be lost, and a publisher keeps ten messages for its subscribers."""

_SLACK_S = 1e-9


class CommandLimiter:
    """Passes commands on to a robot within its limits, and only while they are received.

    * A command is sent at once, and repeated at ``command_rate`` to satisfy the robot's own watchdog. After
      ``cmd_vel_timeout`` without a new one, a few zeros are sent, then nothing, so that others can drive.
    * Speeds are clamped, and increase no faster than the robot's accelerations. A decrease is sent at once, because the
      robot itself knows best how hard to brake.
    * After the link to the robot was lost, only zeros are sent until the link is back *and* a zero was commanded, so
      that no robot starts to move because it is reconnected.

    Attributes:
        velocity: The last velocity sent.
        holds: Whether it waits for a zero before the robot may move.
    """

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self._wanted = ZERO
        self._age_s = math.inf
        self._since_sent_s = math.inf
        self._zeros_left = 0
        self._linked = False
        self.velocity = ZERO
        self.holds = True

    @property
    def waits(self) -> bool:
        """Whether a movement is commanded but held back."""
        return self._linked and self.holds and self._wanted != ZERO and self._is_fresh

    @property
    def _is_fresh(self) -> bool:
        return self._age_s < self._config.cmd_vel_timeout - _SLACK_S

    def command(self, wanted: Velocity) -> Velocity | None:
        """Take a command; return what to send now, or None. For one that is not finite the robot stands."""
        if not wanted.is_finite:
            return self.stand()
        if self._linked and wanted == ZERO:
            self.holds = False
        return self._take(wanted)

    def stand(self) -> Velocity | None:
        """Stop as by a zero, which was not commanded: a robot that waits for one still does."""
        return self._take(ZERO)

    def step(self, dt_s: float, *, linked: bool) -> Velocity | None:
        """Advance time by ``dt_s`` seconds; return what to send now, or None.

        Args:
            dt_s: Seconds since the last step, >= 0.
            linked: Whether the robot receives commands, as far as is known.
        """
        self._age_s += dt_s
        self._since_sent_s += dt_s
        self._linked = linked
        self.holds = self.holds or not linked
        return self._advance(dt_s)

    def _take(self, wanted: Velocity) -> Velocity | None:
        self._wanted, self._age_s, self._zeros_left = wanted, 0.0, _LAST_ZEROS
        return self._advance(0.0)

    def _advance(self, dt_s: float) -> Velocity | None:
        config, now = self._config, self.velocity
        wanted = self._wanted if self._is_fresh and not self.holds else ZERO
        self.velocity = Velocity(
            _approach(wanted.linear_mps, now.linear_mps, config.max_linear, config.max_linear_acceleration * dt_s),
            _approach(
                wanted.angular_radps, now.angular_radps, config.max_angular, config.max_angular_acceleration * dt_s
            ),
        )
        is_due = self._since_sent_s >= 1 / config.command_rate - _SLACK_S
        if not (is_due or self.velocity != now):
            return None
        if not self._is_fresh:
            if not self._zeros_left:
                return None
            self._zeros_left -= 1
        self._since_sent_s = 0.0
        return self.velocity


def _approach(wanted: float, now: float, highest: float, growth: float) -> float:
    """Return the value nearest to ``wanted`` within ``highest``, at most ``growth`` above ``now`` in magnitude.

    A change of direction goes through zero first.
    """
    same_way = now if now * wanted > 0 else 0.0
    limit = min(highest, abs(same_way) + growth)
    return math.copysign(min(abs(wanted), limit), wanted) if wanted else 0.0
