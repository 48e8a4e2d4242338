"""The node ``hand_sign_control``: signs in, one velocity command out for each."""

import logging
import math
from typing import Any

from handsteer.clock import Clock
from handsteer.config import CollisionMonitorConfig, Config, ControlConfig
from handsteer.control.actions import action_of
from handsteer.control.driver import Driver
from handsteer.control.effects import tell
from handsteer.control.fleet import NEXT
from handsteer.control.hold import Hold
from handsteer.control.sign_control import ZERO, Velocity
from handsteer.messages import CMD_VEL, HAND_SIGN, STEERING_CMD_VEL, STOP, Bool, String, Topic, Twist, command
from handsteer.nodes.collision_monitor import CollisionMonitor
from handsteer.nodes.interruption import Interruption
from handsteer.nodes.latency import LatencyLog
from handsteer.nodes.node import OK, WARN, Node
from handsteer.nodes.rivals import Rivals
from handsteer.nodes.selection import Selection
from handsteer.signs.vocabulary import NONE
from handsteer.transports.protocol import Publisher, Received, Transport

log = logging.getLogger(__name__)

_WATCHDOG_PERIOD_S = 0.02
_DIAGNOSE_PERIOD_S = 0.1


class HandSignControlNode(Node):
    """Publishes one Twist a sign, one zero when signs stop, and one zero at the end, whatever ends it.

    True on ``/stop`` stops the robot whoever drives, until false comes; then signs and steering have to begin anew.
    With ``config.robots`` it drives one of them at a time; see :class:`~handsteer.nodes.selection.Selection`.

    Args:
        transport: Carries the messages.
        clock: The graph's clock.
        config: Limits, steps and timeouts.
        cmd_vel: The topic of the commands, of Twist or TwistStamped.
        collision_monitor: Whether and how commands are slowed before obstacles; not at all by default.

    Attributes:
        latency: From the capture of a frame to the Twist that it led to.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        config: ControlConfig,
        cmd_vel: Topic[Any] = CMD_VEL,
        collision_monitor: CollisionMonitorConfig | None = None,
    ) -> None:
        super().__init__("hand_sign_control", transport, clock)
        self.latency = LatencyLog()
        self._config = config
        self._driver = Driver(config)
        self._hold = Hold()
        self._monitor = CollisionMonitor(self, collision_monitor or CollisionMonitorConfig(), self._driver.hold_back)
        self._is_stopped = False
        self._last_step_s = clock.now()
        self._interruption = Interruption(config.sign_timeout, clock.now())
        self._topic = cmd_vel
        self._last_sign = NONE
        self._last_steering_s = -math.inf
        self._selection = (
            Selection(self, config.robots, cmd_vel, self._send, self._on_change) if config.robots else None
        )
        self._cmd_vel = self._selection.publisher if self._selection else self.publisher(cmd_vel)
        self._rivals = Rivals(self, [HAND_SIGN, *(self._selection.topics if self._selection else [cmd_vel])])
        self.subscribe(STOP, self._on_stop_or_reset)
        self.subscribe(STEERING_CMD_VEL, self._on_steering)
        self.subscribe(HAND_SIGN, self._on_sign)
        self.every(_WATCHDOG_PERIOD_S, self._watch)
        self.every(_DIAGNOSE_PERIOD_S, self._report)

    def on_reconfigure(self, config: Config) -> None:
        """Take all of ``control``; a robot that is faster than new limits allow is told so at once."""
        self._config = config.control
        self._interruption.limit_s = config.control.sign_timeout
        self._monitor.reconfigure(config.collision_monitor)
        self._publish(self._driver.reconfigure(config.control))

    def on_stop(self) -> None:
        """Leave the robot standing, and those that it left a moment ago."""
        self._driver.halt()
        self._publish(ZERO)
        if self._selection:
            self._selection.beat()

    def _on_stop_or_reset(self, received: Received[Bool]) -> None:
        was_stopped, self._is_stopped = self._is_stopped, bool(received.message.data)
        if self._is_stopped:
            self._driver.halt()
            self._publish(ZERO)
        elif was_stopped:
            log.info("stop is reset by false on %s, which is published by %s", STOP.name, self._voices(STOP))
            self._hold.begin()

    def _voices(self, topic: Topic[Any]) -> str:
        return ", ".join(self.transport.publishers_of(topic)) or "nobody that is known"

    def _on_sign(self, received: Received[String]) -> None:
        captured_s = received.captured_s
        if captured_s is not None and self.clock.now() - captured_s > self._config.sign_timeout:
            return  # a stale frame is no frame: the watchdog goes on counting
        elapsed_s = self._elapsed()
        sign = None if self._interruption.distrusts(self.clock.now()) else received.message.data
        self._publish(self._driver.step(elapsed_s, sign=self._admitted(sign)), captured_s)

    def _on_steering(self, received: Received[Twist]) -> None:
        wanted = Velocity(received.message.linear.x, received.message.angular.z)
        elapsed_s = self._elapsed()
        steering = None if self._interruption.distrusts(self.clock.now()) else self._steered(wanted)
        self._publish(self._driver.step(elapsed_s, steering=steering))

    def _watch(self) -> None:
        self._publish(self._driver.step(self._elapsed()))
        if self._selection:
            self._selection.beat()

    def _admitted(self, sign: str | None) -> str | None:
        """Return the sign to follow: ``NONE`` while the robot is stopped, or waits for a sign that stops."""
        if sign is None:
            return None
        action = action_of(sign, self._config.actions)
        if self._selection and action == "next_robot" and sign != self._last_sign:
            self._selection.select(NEXT)
        self._last_sign = sign
        passes = self._hold.let_sign_pass(stops=action == "stop")
        return sign if passes and not self._is_stopped else NONE

    def _steered(self, wanted: Velocity) -> Velocity:
        """Return the steering to follow: zero while the robot is stopped, or waits for the steering to let go."""
        now = self.clock.now()
        after_pause = now - self._last_steering_s >= self._config.steering_timeout
        self._last_steering_s = now
        passes = self._hold.let_steering_pass(is_zero=wanted.is_zero, after_pause=after_pause)
        return wanted if passes and not self._is_stopped else ZERO

    def _on_change(self) -> None:
        """Start from standing with another robot."""
        assert self._selection is not None
        self._driver.halt()
        self._hold.begin()
        self._cmd_vel = self._selection.publisher

    def _publish(self, velocity: Velocity | None, captured_s: float | None = None) -> None:
        if velocity is None:
            return
        self._send(self._cmd_vel, self._monitor.admit(velocity), captured_s)
        if captured_s is not None:
            self.latency.add(self.clock.now() - captured_s)

    def _send(self, publisher: Publisher[Any], velocity: Velocity, captured_s: float | None = None) -> None:
        stamp, frame_id = self.clock.stamp(self.clock.now()), self._config.cmd_vel_frame_id
        message = command(self._topic, velocity.linear_mps, velocity.angular_radps, stamp, frame_id)
        publisher.publish(message, captured_s)

    def _elapsed(self) -> float:
        now = self.clock.now()
        elapsed_s, self._last_step_s = now - self._last_step_s, now
        self._interruption.note(now)
        return elapsed_s

    def _report(self) -> None:
        velocity = self._driver.velocity
        self.diagnose(
            WARN if self._rivals.warning or self._monitor.why_blind() else OK,
            self._reason,
            source=self._driver.source,
            stopped=self._is_stopped,
            linear_mps=f"{velocity.linear_mps:.3f}",
            angular_radps=f"{velocity.angular_radps:.3f}",
            **({"robot": self._selection.fleet.selected} if self._selection else {}),
            **tell(self._config),
            **self._monitor.values(),
            **({"warning": self._rivals.warning} if self._rivals.warning else {}),
            **self._latencies(),
        )

    @property
    def _reason(self) -> str:
        if self._is_stopped:
            return "standing: stopped, until it is reset"
        source = self._driver.source
        if self._hold.signs and source == "signs":
            return f"standing: {self._disarmed}, moves once Stop is shown, or no hand"
        if self._hold.steering and source == "steering":
            return f"standing: {self._disarmed}, steers once the steering has been let go"
        return self._monitor.explain(self._driver.reason)

    @property
    def _disarmed(self) -> str:
        return f"{self._selection.fleet.selected} was selected and is disarmed" if self._selection else "disarmed"

    def _latencies(self) -> dict[str, str]:
        """Return the latency's figures; none where the transport does not carry the frame's time with a sign."""
        percents = {"latency_median_ms": 50, "latency_p99_ms": 99} if len(self.latency) else {}
        return {name: f"{self.latency.percentile_ms(percent):.1f}" for name, percent in percents.items()}
