"""Slows the control's commands before obstacles on ``/scan``, and reports it."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

from handsteer.config import CollisionMonitorConfig
from handsteer.control.explain import Reason
from handsteer.control.footprint import points_of
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.messages import LaserScan, Odometry, Pose, Topic
from handsteer.nodes.base import Node
from handsteer.transports.base import Received
from handsteer.types import Velocity


class MeasuredVelocity:
    """Reads velocities from odometry, including sources that leave the twist at zero while the pose changes."""

    def __init__(self) -> None:
        self._pose: Pose | None = None

    def read(self, odometry: Odometry) -> Velocity | None:
        """Return the robot's velocity; None if it moves but its twist does not give the velocity."""
        twist, pose = odometry.twist.twist, odometry.pose.pose
        velocity = Velocity(twist.linear.x, twist.angular.z)
        has_moved, self._pose = self._pose not in (None, pose), pose
        return None if velocity.is_zero and has_moved else velocity


log = logging.getLogger(__name__)


class CollisionMonitor:
    """Subscribes to the laser scan and the robot's odometry when first enabled.

    Args:
        node: The control.
        rule: Whether it is enabled, and its parameters.
        on_slowed: Receives each velocity that is commanded instead of a faster one.
        scan: Topic of the laser scans.
        odom: Topic of the robot's odometry.
    """

    def __init__(
        self,
        node: Node,
        rule: CollisionMonitorConfig,
        on_slowed: Callable[[Velocity], None],
        scan: Topic[LaserScan],
        odom: Topic[Odometry],
    ) -> None:
        self._node = node
        self._on_slowed = on_slowed
        self._scan, self._odom = scan, odom
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
            self._node.subscribe(self._scan, self._on_scan)
            self._node.subscribe(self._odom, self._on_odometry)

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

    def explain(self, reason: Reason) -> Reason:
        """Return the control's ``reason``, with the obstacle that slows or stops the robot."""
        hit = self._limiter.hit if self._limiter.rule.enabled else None
        if hit is None:
            return reason
        obstacle = hit.describe(self._limiter.rule)
        return Reason("obstacle", obstacle) if self._stands else replace(reason, slowed=obstacle)

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
            return "the laser scans that come have no valid range, so what is in the way is not known"
        return f"laser scans come {self._limiter.silence_s(now):.1f} s after their stamp: are the clocks synchronised?"

    @property
    def obstacle_m(self) -> float | None:
        """Distance of the obstacle that limited the last command; None if none did."""
        hit = self._limiter.hit
        return None if hit is None else round(max(0.0, hit.gap_m), 2)

    def _on_scan(self, received: Received[LaserScan]) -> None:
        now = self._node.clock.now()
        self._came_s = now
        points = points_of(received.message, self._limiter.rule)
        if (points is None) != self._is_broken:
            self._is_broken = points is None
            (log.warning if self._is_broken else log.info)(
                "laser scans %s", "have no valid range" if self._is_broken else "are valid again"
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
