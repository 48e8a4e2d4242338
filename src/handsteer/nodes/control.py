"""The node ``hand_sign_control``, which publishes a velocity per sign, or per frame of the hand as a joystick."""

import logging
import math
from dataclasses import replace
from typing import Any

from handsteer.clock import Clock, SimulatedClock
from handsteer.config import CollisionMonitorConfig, Config, ControlConfig, JoyConfig, assist_of
from handsteer.config.driving import NEXT
from handsteer.control import Control
from handsteer.control.actions import AddedActions
from handsteer.control.assist import assist_named
from handsteer.control.engagement import SteeredBy
from handsteer.control.explain import Reason, seconds_to_renew
from handsteer.control.following import Following
from handsteer.errors import ConfigError, PluginError
from handsteer.messages import (
    CMD_VEL,
    GESTURE_JOY,
    HAND_SIGN,
    ODOM,
    SCAN,
    STEERING_CMD_VEL,
    STOP,
    Bool,
    Joy,
    LaserScan,
    Odometry,
    String,
    Topic,
    Twist,
    engages_in,
    pointing_in,
    stick_in,
    velocity_in,
)
from handsteer.nodes.auditing import ControlAudit
from handsteer.nodes.base import Node
from handsteer.nodes.collision_monitor import CollisionMonitor, MeasuredVelocity
from handsteer.nodes.joysticks import Joysticks
from handsteer.nodes.selection import Selection
from handsteer.nodes.status import ControlStatus
from handsteer.nodes.supervision import Rivals, StopKeeper
from handsteer.nodes.timing import CALM_S, LatencyLog, StallGuard
from handsteer.timeouts import ODOMETRY_S
from handsteer.transports.base import Call, Received, Transport
from handsteer.transports.commands import Commands
from handsteer.transports.timing import Repeats
from handsteer.types import LONGEST_SIGN, NONE, ZERO, Stick, Velocity, action_of

log = logging.getLogger(__name__)

_WATCHDOG_PERIOD_S = 0.02
_DIAGNOSE_PERIOD_S = 0.1
_STOPPED = "stopped, until it is reset"


class HandSignControlNode(Node):
    """Publishes one Twist per sign, one zero when signs stop, and one zero at the end, however the node ends.

    With ``config.mode`` ``joystick`` it is one Twist per message of the hand as a joystick; signs then only engage, and
    a gamepad on ``/joy`` steers.

    True on ``/stop`` stops the robot and overrides all inputs, until false is received; then signs and steering must
    show neutral first. With ``config.robots`` it drives one of them at a time; see
    :class:`~handsteer.nodes.selection.Selection`.

    Args:
        config: Limits, steps and timeouts.
        cmd_vel: Topic of the commands, with Twist, TwistStamped or either.
        collision_monitor: The size of the robot and how it brakes, for ``config.assist``.
        gamepad: How ``/joy`` is read.
        arming: Whether nothing moves before neutral was seen, or while no robot is subscribed
            (:mod:`handsteer.control.safety`).
        engage: Whether the hand drives nothing before it has engaged.
        renew: Whether what drives without any change must be shown again.
        others_keep_stop: Whether nodes of other processes may remember a Stop from before the start; nothing moves
            before one of them was heard, for at most :data:`~handsteer.timeouts.HEAR_STOP_S`.
        sign, joy, steering, odom, scan: Topics of what it subscribes to.
        camera_changed: Topic on which it is published that another camera was chosen; none where it cannot be.

    Attributes:
        latency: From the capture of a frame to the resulting Twist.
    """

    is_quick = is_managed = True

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        config: ControlConfig,
        cmd_vel: Topic[Any] = CMD_VEL,
        collision_monitor: CollisionMonitorConfig | None = None,
        *,
        gamepad: JoyConfig | None = None,
        arming: bool = False,
        engage: bool = False,
        renew: bool = False,
        others_keep_stop: bool = False,
        sign: Topic[String] = HAND_SIGN,
        joy: Topic[Joy] = GESTURE_JOY,
        camera_changed: Topic[String] | None = None,
        steering: Topic[Twist] = STEERING_CMD_VEL,
        odom: Topic[Odometry] = ODOM,
        scan: Topic[LaserScan] = SCAN,
    ) -> None:
        super().__init__("hand_sign_control", transport, clock)
        self.latency = LatencyLog()
        self._config = config
        self._control = Control(config, arming=arming, engage=engage, renew=renew)
        self._safety, self._mux = self._control.safety, self._control.mux
        self._following = None if config.robots else Following(checks_motion=arming)
        self._measured, self._repeats, self._hand_repeats = MeasuredVelocity(), Repeats(), Repeats()
        self._moved: tuple[float, bool] | None = None
        self._commanded = ZERO
        self._last_step_s = clock.now()
        self._camera_since_s = -math.inf
        rule = collision_monitor or CollisionMonitorConfig()
        self._monitor = CollisionMonitor(self, config, rule, self._control.hold_back, scan=scan, odom=odom)
        self._stall_guard = StallGuard(config.sign_timeout, clock.now())
        self._last_sign = NONE
        self._selection = (
            Selection(self, config.robots, cmd_vel, self._commands, self._on_change) if config.robots else None
        )
        self._cmd_vel = self._selection.commands if self._selection else self._commands(cmd_vel)
        self._rivals = Rivals(self, [sign, *(self._selection.topics if self._selection else [cmd_vel])])
        self._audit = ControlAudit(self.auditor, lambda: self._published_by(STOP)[1])
        stops = StopKeeper(self, self._on_stop_or_reset)
        self._stops = stops if others_keep_stop else None
        if camera_changed is not None:
            self.subscribe(camera_changed, self._on_other_camera)
        self.subscribe(steering, self._on_steering)
        self.subscribe(sign, self._on_sign)
        self._joysticks = Joysticks(self, joy, self._on_stick, gamepad or JoyConfig(), self._on_gamepad)
        self._engages = engage
        self._listen()
        if self._following:
            self.subscribe(odom, self._on_odometry)
        self._watchdog = self.every(_WATCHDOG_PERIOD_S, self._watch)
        self.diagnose_every(_DIAGNOSE_PERIOD_S, self._report)

    def check(self, config: Config) -> None:
        """Raise ConfigError if an action of ``control.actions``, or the assist, is of a plug-in and cannot be made."""
        try:
            AddedActions().make(config.control.actions.values())
        except PluginError as error:
            raise ConfigError(f"control.actions: {error}") from None
        try:
            assist_named(assist_of(config.control, config.collision_monitor))
        except PluginError as error:
            raise ConfigError(f"control.assist: {error}") from None

    def on_reconfigure(self, config: Config) -> None:
        """Apply all of ``control``; a robot that exceeds new limits is slowed at once."""
        self._config = config.control
        self._stall_guard.limit_s = config.control.sign_timeout
        if self._monitor.reconfigure(config.control, config.collision_monitor):
            self._safety.disarm("its limits have changed")
            self._publish(self._control.halt())
        self._publish(self._control.reconfigure(config.control))
        self._listen()

    def _listen(self) -> None:
        by_gesture = self._engages and self._config.engage_by == "gesture"
        self._joysticks.listen(hand=self._config.by_stick or by_gesture, gamepad=self._config.mode == "joystick")

    def services(self) -> dict[str, Call]:
        """Return ``stop`` and ``reset``, as true and false on ``/stop``, and ``engage_state``, engaged or stopped?"""
        publisher = self.publisher(STOP)

        def publish(is_stopped: bool) -> str:
            publisher.publish(Bool(data=is_stopped))
            return _STOPPED if is_stopped else "reset"

        return {"stop": lambda: publish(True), "reset": lambda: publish(False), "engage_state": self._engage_state}

    def _engage_state(self) -> str:
        engagement = self._safety.engagement
        state = "engaged" if engagement.engaged else str(engagement.reason)
        return f"{state}; {_STOPPED}" if self._safety.is_stopped else state

    def on_activate(self) -> None:
        """Wait for neutral, and for the gesture that engages: what was shown before does not count."""
        self._control.halt()
        self._safety.disarm("was activated")

    def on_deactivate(self) -> None:
        """Stop the robot; from then on nothing is commanded."""
        self._publish(self._control.halt())
        if self._selection:
            self._selection.beat()
            self._selection.forget()
        self._look_for_changes(self.clock.now())

    def on_stop(self) -> None:
        """Stop the robot, and those that were selected a moment ago."""
        self._control.halt()
        if not self._commanded.is_zero:
            self._audit.ended(self._last_step_s)
        self._publish(ZERO)
        if self._selection:
            self._selection.beat()

    def _on_stop_or_reset(self, is_stopped: bool) -> None:
        if is_stopped:
            self._control.stop()
            self._publish(ZERO)
        else:
            if self._safety.is_stopped:
                log.info("stop is reset by false on %s, which is published by %s", *self._published_by(STOP))
            self._control.reset()
        self._look_for_changes(self.clock.now())

    def _published_by(self, topic: Topic[Any]) -> tuple[str, str]:
        publishers = self.transport.publishers_of(topic)
        return self.transport.topic_name(topic), ", ".join(publishers) or "no known node"

    def _on_sign(self, received: Received[String]) -> None:
        sign = received.message.data
        if len(sign) > LONGEST_SIGN or not sign.isprintable():
            self._take(received.captured_s, is_late=True, is_stop=True)
            return
        is_stop = action_of(sign, self._config.actions) == "stop"
        self._take(received.captured_s, is_late=self._is_stale(received), is_stop=is_stop, sign=sign)

    def _on_other_camera(self, received: Received[String]) -> None:
        """Stop, and wait for neutral in a frame of the other camera."""
        self._camera_since_s = self.clock.now() if received.captured_s is None else received.captured_s
        self._safety.disarm("the camera was changed")
        self._publish(self._control.halt())
        self._look_for_changes(self.clock.now())

    def _on_stick(self, received: Received[Joy]) -> None:
        """Note whether the hand engages; follow it if it drives as a joystick or by pointing."""
        if not (self._is_stale(received) or self._waits_for_others()):
            self._control.note_gesture(is_done=engages_in(received.message))
        is_again = self._hand_repeats.has(received.message.header.stamp, self.clock.now())
        if self._config.by_stick:
            stick = (stick_in if self._config.mode == "joystick" else pointing_in)(received.message)
            if is_again and stick.held:
                return  # it says nothing of now
            self._take(received.captured_s, is_late=self._is_stale(received), is_stop=not stick.held, stick=stick)

    def _on_gamepad(self, stick: Stick, received: Received[Joy], *, is_at_rest: bool) -> None:
        """Follow a gamepad; one that stays at rest leaves the robot to others, and was seen released."""
        limits, is_late = self._config, self._is_stale(received)
        if not is_at_rest:
            wanted = Velocity(stick.forward * limits.max_linear, stick.left * limits.max_angular)
            self._steer(wanted, is_late=is_late, by="gamepad")
        elif not (is_late or self._waits_for_others() or self._stall_guard.distrusts(self.clock.now())):
            self._safety.note_rest("gamepad")

    def _is_stale(self, received: Received[Any]) -> bool:
        """Return whether a message shows what is too old, or was seen by another camera; the watchdog keeps running."""
        captured_s = received.captured_s
        is_old = captured_s is not None and self.clock.now() - captured_s > self._config.sign_timeout
        is_of_other = captured_s is not None and captured_s < self._camera_since_s
        return is_old or is_of_other or received.is_late

    def _on_steering(self, received: Received[Twist]) -> None:
        self._steer(velocity_in(received.message), is_late=received.is_late, by="steering")

    def _steer(self, wanted: Velocity, *, is_late: bool, by: SteeredBy) -> None:
        self._take(None, is_late=is_late, is_stop=wanted.is_zero, steering=wanted, by=by)

    def _take(
        self,
        captured_s: float | None,
        *,
        is_late: bool,
        is_stop: bool,
        sign: str | None = None,
        stick: Stick | None = None,
        steering: Velocity | None = None,
        by: SteeredBy = "steering",
    ) -> None:
        """Follow an input; a late one can only stop: it does not show what is seen now, so it does not arm."""
        if not self.is_active:
            return
        if self._waits_for_others():
            self._publish(ZERO, captured_s)
        elif isinstance(self.clock, SimulatedClock) and self.clock.is_paused:
            self._safety.stall("the clock stands still")
            self._publish(self._control.halt())
        elif is_late:
            self._publish(self._control.halt() if is_stop else None)
        else:
            elapsed_s = self._elapsed()
            if self._stall_guard.distrusts(self.clock.now()):
                sign = stick = steering = None
            away = self._look_after_the_robot(elapsed_s)
            self._select_by(sign)
            velocity = self._control.step(elapsed_s, sign=sign, stick=stick, steering=steering, by=by)
            if away is not None:
                self._lose_the_robot(away)  # neutral that it could not follow does not count
            self._publish(velocity, captured_s)
            self._calm_down()

    def _waits_for_others(self) -> bool:
        return self._stops is not None and self._stops.waits_for_others

    def _on_odometry(self, received: Received[Odometry]) -> None:
        assert self._following is not None
        if self._repeats.has(received.message.header.stamp, self.clock.now()):
            return  # it says nothing of now: a robot that hangs is as silent
        measured = self._measured.read(received.message)
        now = self.clock.now()
        self._following.note(self._commanded if measured is None else measured, now - self._last_step_s)
        self._moved = (now, measured is None or not measured.is_rest)

    def _watch(self) -> None:
        elapsed_s = self._elapsed()
        if not self.is_active:
            self._look_for_changes(self._last_step_s)
            return
        self._look_after_the_robot(elapsed_s)
        self._publish(self._control.step(elapsed_s))
        self._look_for_changes(self._last_step_s)
        if self._selection:
            self._selection.beat()
        if self._mux.source == "none":
            self._calm_down()

    def _calm_down(self) -> None:
        """Delay the watchdog while nothing moves: waking up fifty times a second costs more than all signs."""
        self._look_for_changes(self._last_step_s)
        # The selection uses the same timer, and steering must time out even while signs arrive.
        if self._selection is None and self._mux.source != "steering":
            self._watchdog.delay_until(self.clock.now() + CALM_S)

    def _look_for_changes(self, now_s: float) -> None:
        source = "none" if self._safety.is_stopped else self._mux.source
        self._audit.look(self._safety, source, self._reason, now_s)

    def _look_after_the_robot(self, elapsed_s: float) -> str | None:
        """Stop, and wait for neutral, if the robot does not follow; return why, or None."""
        changed = self._selection.follow() if self._selection else self._cmd_vel.follow()
        away = "another robot listens" if changed else None if self._cmd_vel.has_subscribers else "no robot listens"
        if away is None and self._following is not None:
            away = self._following.step(elapsed_s, self._commanded)
        if self._monitor.why_blind():
            away = "laser scans did not come"
        if away is not None:
            self._lose_the_robot(away)
            self._publish(self._control.halt())
        return away

    def _lose_the_robot(self, away: str) -> None:
        if self._following is not None and self._following.is_silent:
            self._safety.disarm(away)  # whatever the robot is: what it does now is not known
        else:
            self._safety.robot_is_away(away)

    def _select_by(self, sign: str | None) -> None:
        """Select the next robot when a sign with that action begins."""
        if sign is None:
            return
        if self._selection and sign != self._last_sign and action_of(sign, self._config.actions) == "next_robot":
            self._selection.select(NEXT)
        self._last_sign = sign

    def _on_change(self) -> None:
        """Start from zero with another robot."""
        assert self._selection is not None
        self._control.halt()
        self._safety.disarm("it was selected")
        self._cmd_vel = self._selection.commands

    def _publish(self, velocity: Velocity | None, captured_s: float | None = None) -> None:
        if velocity is None or not self.is_active:
            return
        try:
            self._commanded = self._monitor.admit(velocity)
        except Exception:
            self._safety.stall("the collision monitor has failed")
            self._control.halt()
            self._commanded = ZERO
            self._cmd_vel.send(0.0, 0.0, captured_s)
            raise
        self._cmd_vel.send(self._commanded.linear_mps, self._commanded.angular_radps, captured_s)
        if captured_s is not None:
            self.latency.add(self.clock.now() - captured_s)

    def _commands(self, topic: Topic[Any]) -> Commands:
        return Commands(self.transport, self.publisher, topic, self.clock, self._config.cmd_vel_frame_id)

    def _elapsed(self) -> float:
        now = self.clock.now()
        elapsed_s, self._last_step_s = now - self._last_step_s, now
        if self._stall_guard.note(now):
            self._safety.stall("the control was stalled")
            self._audit.stalled(now)
        return elapsed_s

    def _report(self) -> ControlStatus:
        velocity = self._commanded if self._monitor.steers else self._mux.velocity
        # There are no latencies if the transport does not carry capture times with signs.
        is_measured = len(self.latency) > 0
        return ControlStatus(
            reason=self._reason,
            source=self._mux.source,
            stopped=self._safety.is_stopped,
            armed=self._safety.signs_wait is None,
            engaged=self._safety.engagement.engaged,
            engage_progress=round(self._safety.engagement.progress, 2),
            linear_mps=round(velocity.linear_mps, 3),
            angular_radps=round(velocity.angular_radps, 3),
            moving=self._is_moving,
            renew_s=seconds_to_renew(self._control.renew_left_s),
            robot=self._selection.robot if self._selection else None,
            blind=bool(self._monitor.why_blind()),
            obstacle_m=self._monitor.obstacle_m,
            warning=self._rivals.warning or None,
            latency_median_ms=round(self.latency.percentile_ms(50), 1) if is_measured else None,
            latency_p99_ms=round(self.latency.percentile_ms(99), 1) if is_measured else None,
            rule=self._config,
        )

    @property
    def _is_moving(self) -> bool | None:
        if self._moved is None or self.clock.now() - self._moved[0] > ODOMETRY_S:
            return None
        return self._moved[1]

    @property
    def _reason(self) -> Reason:
        safety = self._safety
        if safety.is_stopped:
            return Reason("stopped")
        if not self.is_active:
            return Reason("inactive")
        if self._waits_for_others():
            return Reason("starting")
        if why_blind := self._monitor.why_blind():
            return Reason("no_scan", why_blind)
        return self._reason_by_input()

    def _reason_by_input(self) -> Reason:
        safety, source, why = self._safety, self._mux.source, self._safety.signs_wait
        robot = self._selection.robot if self._selection else ""
        # Without any input, that is the reason after a reset, which needs no explanation.
        if source != "steering" and not safety.engagement.engaged:
            return replace(safety.engagement.reason, robot=robot)
        if self._control.must_renew:
            return replace(self._control.reason, robot=robot)
        if source == "steering" and safety.steering_waits:
            return Reason("steering_disarmed", robot=robot)
        if source == "steering" or why is None or (source == "none" and not why):
            return self._monitor.explain(self._mux.reason)
        return Reason("disarmed", why, robot)
