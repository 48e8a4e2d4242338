"""Slows the control's commands before obstacles on ``/scan``, and reports it."""

import logging
import math
from collections.abc import Callable

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import points_of
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.messages import ODOM, SCAN, LaserScan, Odometry
from handsteer.nodes.node import Node
from handsteer.nodes.odometry import MeasuredVelocity
from handsteer.transports.base import Received
from handsteer.types import Velocity

log = logging.getLogger(__name__)


class CollisionMonitor:
    """Subscribes to the laser scan and the robot's odometry when first enabled.

    Args:
        node: The control.
        rule: Whether it is enabled, and its parameters.
        on_slowed: Receives each velocity that is commanded instead of a faster one.
    """

    def __init__(self, node: Node, rule: CollisionMonitorConfig, on_slowed: Callable[[Velocity], None]) -> None:
        self._node = node
        self._on_slowed = on_slowed
        self._limiter = ObstacleLimiter(rule)
        self._listens = False
        self._came_s = -math.inf
        self._measured = MeasuredVelocity()
        self._is_broken = False
        self._stands = False
        self.reconfigure(rule)

    def reconfigure(self, rule: CollisionMonitorConfig) -> None:
        """Change the rule."""
        self._limiter.rule = rule
        self._limiter.hit = None
        if rule.enabled and not self._listens:
            self._listens = True
            self._node.subscribe(SCAN, self._on_scan)
            self._node.subscribe(ODOM, self._on_odometry)

    def admit(self, wanted: Velocity) -> Velocity:
        """Return the velocity to command instead of ``wanted``."""
        self._stands = False
        if not self._limiter.rule.enabled:
            return wanted
        now = self._node.clock.now()
        allowed = self._limiter.limit(wanted, now) if wanted.is_finite else wanted
        if allowed != wanted:
            self._stands = allowed.is_zero
            self._on_slowed(allowed)
        return allowed

    def explain(self, reason: str) -> str:
        """Return the control's ``reason`` and what slows the robot, as ``driving: Forward, slowed: obstacle …``."""
        hit = self._limiter.hit if self._limiter.rule.enabled else None
        if hit is None:
            return reason
        said = hit.describe(self._limiter.rule)
        return f"standing: stopped before an {said}" if self._stands else f"{reason}, slowed: {said}"

    def why_blind(self) -> str:
        """Return why nothing may move without scans; empty if scans are received or not required."""
        now = self._node.clock.now()
        rule = self._limiter.rule
        if not rule.enabled or not self._limiter.is_blind(now):
            return ""
        if now - self._came_s > rule.source_timeout:
            since = f" for {now - self._came_s:.1f} s" if math.isfinite(self._came_s) else ""
            return f"no laser scan has come{since}, so what is in the way is not known"
        if self._is_broken:
            return "the laser scans that come say nothing, so what is in the way is not known"
        return f"laser scans come {self._limiter.silence_s(now):.1f} s after their stamp: are the clocks in step?"

    def values(self) -> dict[str, str]:
        """Return the values for diagnostics."""
        hit = self._limiter.hit
        return {} if hit is None else {"obstacle_m": f"{max(0.0, hit.gap_m):.2f}"}

    def _on_scan(self, received: Received[LaserScan]) -> None:
        now = self._node.clock.now()
        self._came_s = now
        points = points_of(received.message, self._limiter.rule)
        if (points is None) != self._is_broken:
            self._is_broken = points is None
            (log.warning if self._is_broken else log.info)(
                "laser scans %s", "say nothing" if self._is_broken else "come again"
            )
        if points is not None:
            captured_s = now if received.captured_s is None else received.captured_s
            self._limiter.see(points, min(captured_s, now))

    def _on_odometry(self, received: Received[Odometry]) -> None:
        moving = self._measured.read(received.message)
        # If the velocity is unknown, the last command is the better estimate.
        if moving is not None and moving.is_finite:
            now = self._node.clock.now()
            captured_s = now if received.captured_s is None else received.captured_s
            self._limiter.feel(moving, min(captured_s, now))
