"""Slows the control's commands before obstacles on ``/scan``, or steers around them, and reports it."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

from handsteer.config import CollisionMonitorConfig, ControlConfig, assist_of
from handsteer.control.assist import assist_named, held_back
from handsteer.control.explain import Reason
from handsteer.control.footprint import points_of
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.messages import LaserScan, Odometry, Pose, Topic, velocity_in
from handsteer.nodes.base import Node
from handsteer.nodes.frozen_scans import FrozenScans, MixedScans
from handsteer.transports.base import Received
from handsteer.transports.timing import Repeats
from handsteer.types import Velocity

# Above all limits that can be configured: it is in other units, or wrong.
_FASTEST = Velocity(25.0, 60.0)
_NOT_VALID = Velocity(math.nan, math.nan)


def _is_finite(pose: Pose) -> bool:
    at, turned = pose.position, pose.orientation
    return all(map(math.isfinite, (at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w)))


class MeasuredVelocity:
    """Reads velocities from odometry, including sources that leave the twist at zero while the pose changes."""

    def __init__(self) -> None:
        self._pose: Pose | None = None

    def read(self, odometry: Odometry) -> Velocity | None:
        """Return the robot's velocity; None if it moves but its twist does not give the velocity.

        One that no robot has, above 25 m/s or 60 rad/s, is not finite; nor is that with a pose that is not finite,
        because odometry that is wrong in one part is not to be believed in the other.
        """
        velocity, pose = velocity_in(odometry.twist.twist), odometry.pose.pose
        if velocity != velocity.clamped(_FASTEST.linear_mps, _FASTEST.angular_radps) or not _is_finite(pose):
            return _NOT_VALID
        has_moved, self._pose = self._pose not in (None, pose), pose
        return None if velocity.is_zero and has_moved else velocity


log = logging.getLogger(__name__)


class CollisionMonitor:
    """Subscribes to the laser scan and the robot's odometry when first enabled.

    Args:
        node: The control.
        control: What is done before obstacles, and the limits.
        rule: Size of the robot, and how it brakes.
        on_slowed: Receives each velocity to continue from, where another one is commanded than was wanted.
        scan: Topic of the laser scans.
        odom: Topic of the robot's odometry.
    """

    def __init__(
        self,
        node: Node,
        control: ControlConfig,
        rule: CollisionMonitorConfig,
        on_slowed: Callable[[Velocity], None],
        *,
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
        self._repeats = Repeats()
        self._frozen, self._is_frozen = FrozenScans(), False
        self._mixed, self._is_mixed = MixedScans(), False
        self._stands = False
        self._kind = "off"
        self._beside = ""
        self.reconfigure(control, rule)

    def reconfigure(self, control: ControlConfig, rule: CollisionMonitorConfig) -> bool:
        """Change what is done before obstacles; return whether something held the robot back that may not any more.

        Raises:
            PluginError: The assist of a plug-in cannot be loaded.
        """
        limiter, kind = self._limiter, assist_of(control, rule)
        held_back = self._kind != "off" and (bool(self.why_blind()) or self.obstacle_m is not None)
        is_other = (kind, rule) != (self._kind, limiter.rule)
        if kind != self._kind:
            limiter.assist = assist_named(kind)
        self._kind = kind
        limiter.rule, limiter.max_angular_radps = rule, control.max_angular
        limiter.hit = limiter.avoided = None
        if kind != "off" and not self._listens:
            self._listens = True
            self._node.subscribe(self._scan, self._on_scan)
            self._node.subscribe(self._odom, self._on_odometry)
        return held_back and is_other

    def admit(self, wanted: Velocity) -> Velocity:
        """Return the velocity to command instead of ``wanted``."""
        self._stands, self._beside = False, ""
        if self._kind == "off":
            return wanted
        now = self._node.clock.now()
        allowed = self._limiter.limit(wanted, now) if wanted.is_finite else wanted
        if allowed != wanted:
            self._stands = allowed.is_zero
            self._beside = _beside(wanted, allowed) if self._limiter.avoided else ""
            self._on_slowed(held_back(wanted, allowed))
        return allowed

    def explain(self, reason: Reason) -> Reason:
        """Return the control's ``reason``, with the obstacle that slows or stops the robot."""
        hit, avoided, rule = self._limiter.hit, self._limiter.avoided, self._limiter.rule
        if self._kind == "off":
            return reason
        if avoided is not None and self._beside and not self._stands:
            return replace(reason, steered=f"{self._beside} of an {avoided.describe(rule)}")
        if hit is None:
            return reason
        obstacle = hit.describe(rule)
        return Reason("obstacle", obstacle) if self._stands else replace(reason, slowed=obstacle)

    def why_blind(self) -> str:
        """Return why nothing may move without scans; empty if scans are received or not required."""
        now = self._node.clock.now()
        rule = self._limiter.rule
        if self._kind == "off" or not self._limiter.is_blind(now):
            return ""
        if now - self._came_s > rule.source_timeout:
            since = f" for {now - self._came_s:.1f} s" if math.isfinite(self._came_s) else ""
            return f"no laser scan has come{since}, so what is in the way is not known"
        if self._is_mixed:
            return "laser scans of several scanners or sectors come on one topic, so what is in the way is not known"
        if self._is_frozen:
            return "the laser scans do not change while the robot moves, so what is in the way is not known"
        if self._is_broken:
            return "the laser scans that come have no valid range, so what is in the way is not known"
        return f"laser scans come {self._limiter.silence_s(now):.1f} s after their stamp: are the clocks synchronised?"

    @property
    def obstacle_m(self) -> float | None:
        """Distance of the obstacle that limited or changed the last command; None if none did."""
        hit = self._limiter.hit or self._limiter.avoided
        return None if hit is None else round(max(0.0, hit.gap_m), 2)

    @property
    def steers(self) -> bool:
        """Whether the last command turned otherwise than was wanted, around an obstacle."""
        return bool(self._beside)

    def _on_scan(self, received: Received[LaserScan]) -> None:
        now = self._node.clock.now()
        if self._repeats.has(received.message.header.stamp, now):
            return  # a scanner that hangs says nothing of now, whatever its stamps
        self._came_s = now
        if self._freezes(received.message):
            return
        points = points_of(received.message, self._limiter.rule)
        self._is_broken = _logged(self._is_broken, points is None, "have no valid range", "are valid again")
        if points is not None and not self._mixes(received.message, now):
            captured_s = now if received.captured_s is None else received.captured_s
            self._limiter.see(points, min(captured_s, now))

    def _mixes(self, scan: LaserScan, now_s: float) -> bool:
        """Return whether scans cover different angles in turn; then nothing is known of what is in the way."""
        is_mixed, begins = self._mixed.note(scan, now_s), "of several scanners or sectors come on one topic"
        self._is_mixed = _logged(self._is_mixed, is_mixed, begins, "are of one scanner")
        if is_mixed:
            self._limiter.forget()
        return is_mixed

    def _freezes(self, scan: LaserScan) -> bool:
        """Return whether scans are frozen; then nothing is known of what is in the way, until one differs."""
        is_same, is_frozen = self._frozen.note(scan, self._limiter.rule)
        is_frozen = is_frozen or (self._is_frozen and is_same)
        self._is_frozen = _logged(self._is_frozen, is_frozen, "do not change while the robot moves", "change again")
        if is_frozen:
            self._limiter.forget()
        return is_frozen

    def _on_odometry(self, received: Received[Odometry]) -> None:
        self._frozen.move(received.message.pose.pose)
        moving = self._measured.read(received.message)
        # If the velocity is unknown, the last command is the better estimate.
        if moving is not None and moving.is_finite:
            now = self._node.clock.now()
            captured_s = now if received.captured_s is None else received.captured_s
            self._limiter.feel(moving, min(captured_s, now))


def _logged(before: bool, now: bool, begins: str, ends: str) -> bool:
    """Return ``now``, whether something is wrong with the scans; log in words when that begins and ends."""
    if now != before:
        (log.warning if now else log.info)("laser scans %s", begins if now else ends)
    return now


def _beside(wanted: Velocity, allowed: Velocity) -> str:
    """Return to which side of what is ahead the robot steers, seen in its direction; empty if to none."""
    turned = (allowed.angular_radps - wanted.angular_radps) * (1.0 if wanted.linear_mps >= 0.0 else -1.0)
    return "left" if turned > 0.0 else "right" if turned < 0.0 else ""
