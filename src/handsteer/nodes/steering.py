"""The node ``steering``, which drives by hand as ``rqt_robot_steering`` does, and stops the robot."""

import re
import threading
from dataclasses import dataclass, replace
from typing import Any

from handsteer.clock import Clock
from handsteer.config import Config, ControlConfig
from handsteer.control import is_faster
from handsteer.control.safety import Ramp, Safety
from handsteer.errors import TransportError
from handsteer.messages import CMD_VEL, STEERING_CMD_VEL, STOP, Bool, Topic, Twist
from handsteer.nodes.base import Node
from handsteer.nodes.supervision import StopKeeper
from handsteer.nodes.timing import StallGuard
from handsteer.timeouts import STALE_S
from handsteer.transports.base import Transport
from handsteer.transports.commands import Commands
from handsteer.types import ZERO, Velocity

_PERIOD_S = 0.1
_TOPIC_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
_LONGEST_NAME = 200
_MOST_TOPICS = 8


@dataclass(frozen=True)
class _Target:
    name: str
    commands: Commands
    is_direct: bool


class SteeringNode(Node):
    """Repeats the velocity set by :meth:`steer` until :meth:`release`; silent otherwise.

    Its commands go to ``hand_sign_control``, where steering overrides signs, and which applies limits and Stop. They
    can be sent to another topic instead (:meth:`send_to`), for which this node applies limits and Stop itself. After
    :meth:`halt` it commands no movement on any topic, because ROS may have remapped it to that of a robot. At the
    start, and after this node stalled, steering must be released once (:meth:`release`, or a zero): what is received
    then may be old, and the situation may have changed.

    All methods may be called from any thread.

    Args:
        config: Limits on another topic; the defaults of ``control`` when None.
        cmd_vel: A topic of robot commands, with Twist, TwistStamped or either; the model for other topics.
        steering: Topic of the commands to ``hand_sign_control``.
        name: Name of the node.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        config: ControlConfig | None = None,
        cmd_vel: Topic[Any] = CMD_VEL,
        *,
        steering: Topic[Twist] = STEERING_CMD_VEL,
        name: str = "steering",
    ) -> None:
        super().__init__(name, transport, clock)
        self._config = config or ControlConfig()
        self._cmd_vel = cmd_vel
        self._lock = threading.RLock()
        self._wanted: Velocity | None = None
        self._halted = False
        self._heard_stop = False
        self._stall_guard = StallGuard(STALE_S, clock.now())
        self._was_held_up = False
        self._safety = Safety(self._config, arming=False)
        self._ramp = Ramp(self._config)
        self._last_step_s = self._last_sent_s = clock.now()
        self._steering = steering
        self._target = self._to(steering.name, steering, is_direct=False)
        self._targets = {self._target.name: self._target}
        self._stop = self.publisher(STOP)
        StopKeeper(self, self._on_stop_or_reset)
        self.every(_PERIOD_S, self._repeat)

    @property
    def topic(self) -> str:
        """Name of the topic that commands are sent to."""
        return self._target.name

    @property
    def is_direct(self) -> bool:
        """Whether commands bypass ``hand_sign_control``."""
        return self._target.is_direct

    @property
    def is_stopped(self) -> bool:
        """Whether a Stop is active: from here, or one of others where the control is bypassed, which has it else."""
        return self._halted or (self.is_direct and self._heard_stop)

    @property
    def waits(self) -> bool:
        """Whether steering has to be released before anything moves."""
        return self._safety.steering_waits

    def send_to(self, name: str) -> None:
        """Send commands to the topic ``name`` from now on; a zero is sent to the previous one first.

        Nothing moves on the new topic until steering was released once.

        Args:
            name: Such as ``/cmd_vel``, or relative to the namespace of this node, such as ``cmd_vel``.

        Raises:
            TransportError: It is not a topic name, or the topic has another type.
        """
        if name == self._steering.ros_name:
            name = self._steering.name
        with self._lock:
            target = self._targets.get(name) or self._find(name)
            self.release()
            self._safety.disarm()
            self._target = target

    def on_reconfigure(self, config: Config) -> None:
        """Apply the limits of ``control``; what would make faster what steers stops it until it is released."""
        with self._lock:
            if self._wanted is not None and is_faster("steering", config.control, self._config):
                self.lose()
            self._config = config.control
            self._safety.reconfigure(config.control)
            self._ramp.reconfigure(config.control)

    def steer(self, linear_mps: float, angular_radps: float) -> None:
        """Drive at this velocity from now on: m/s forward, rad/s to the left."""
        with self._lock:
            self._notice_interruption()
            wanted = Velocity(linear_mps, angular_radps)
            if self._was_held_up and (not wanted.is_zero or self._stall_guard.distrusts(self.clock.now())):
                return
            self._was_held_up = False
            self._wanted = self._admitted(wanted)
            self._publish(self._wanted)

    def release(self) -> None:
        """Stop, and release the robot to other inputs: the person has released what steers."""
        with self._lock:
            self._end()
            self._safety.note_rest("steering")

    def lose(self) -> None:
        """Stop as :meth:`release` does, where no release was seen: it is required then."""
        with self._lock:
            self._end()
            self._safety.disarm()

    def halt(self) -> None:
        """Stop the robot, overriding all inputs, until :meth:`reset`; repeated, for a control that restarts."""
        with self._lock:
            self._halted = True
            self._stand()
            self._stop.publish(Bool(data=True))

    def reset(self) -> None:
        """End a Stop; nothing moves until the active input has shown neutral."""
        with self._lock:
            if self._halted:
                self._safety.disarm()
            self._halted = False
            self._stop.publish(Bool(data=False))

    def on_stop(self) -> None:
        """Stop the robot."""
        self.release()

    def _end(self) -> None:
        if self._wanted is not None or self._was_held_up:
            self._wanted, self._was_held_up = None, False
            self._publish(ZERO)

    def _find(self, name: str) -> _Target:
        if len(name) > _LONGEST_NAME or not _TOPIC_NAME.fullmatch(name):
            raise TransportError(
                f"{name[:_LONGEST_NAME]!r} is not a valid topic name: letters, digits and _ between slashes, "
                "as in /cmd_vel"
            )
        if len(self._targets) > _MOST_TOPICS:
            raise TransportError(f"steering has had {_MOST_TOPICS} topics already: start it again for another")
        is_global = name.startswith("/")
        topic = Topic(name if is_global else f"/{name}", self._cmd_vel.type, is_global=is_global, depth=CMD_VEL.depth)
        topic = replace(topic, or_type=self._cmd_vel.or_type)
        target = self._to(name, topic, is_direct=True)
        self._targets[name] = target
        return target

    def _to(self, name: str, topic: Topic[Any], *, is_direct: bool) -> _Target:
        commands = Commands(self.transport, self.publisher, topic, self.clock, self._config.cmd_vel_frame_id)
        return _Target(name, commands, is_direct)

    def _admitted(self, wanted: Velocity) -> Velocity:
        """Return the velocity to send; ``hand_sign_control`` applies the limits unless it is bypassed."""
        now = self.clock.now()
        elapsed_s, self._last_step_s = now - self._last_step_s, now
        self._safety.step(elapsed_s)
        if not self._safety.admits_steering(is_zero=wanted.is_zero, is_valid=wanted.is_finite) or self.is_stopped:
            return ZERO
        if not self.is_direct:
            return wanted
        if not wanted.is_finite:
            return ZERO
        return wanted.clamped(self._config.max_linear, self._config.max_angular)

    def _on_stop_or_reset(self, is_stopped: bool) -> None:
        with self._lock:
            was_stopped, self._heard_stop = self.is_stopped, is_stopped
            if self.is_direct and is_stopped:
                self._stand()
            elif was_stopped and not self.is_stopped:
                self._safety.disarm()

    def _stand(self) -> None:
        """Clear the requested velocity; if the control is bypassed, send a zero."""
        self._wanted = None
        self._safety.disarm()
        if self.is_direct:
            self._publish(ZERO)

    def _notice_interruption(self) -> None:
        if self._stall_guard.note(self.clock.now()) and self._wanted is not None:
            self._wanted, self._was_held_up = None, True
            if self.is_direct:  # hand_sign_control would take a zero for a release
                self._publish(ZERO)

    def _repeat(self) -> None:
        with self._lock:
            if self._halted:
                self._stop.publish(Bool(data=True))
            self._notice_interruption()
            if self._target.commands.follow():
                self._stand()
            if self._wanted is not None:
                if not self._wanted.is_zero:  # what is repeated here does not pause; a zero would count as a release
                    self._wanted = self._admitted(self._wanted)
                self._publish(self._wanted)
            elif self.is_direct and self.is_stopped:
                self._publish(ZERO)

    def _publish(self, velocity: Velocity) -> None:
        now = self.clock.now()
        if self.is_direct:  # otherwise hand_sign_control applies the limits
            velocity = self._ramp.step(velocity, min(now - self._last_sent_s, _PERIOD_S))
            self._last_sent_s = now
        self._target.commands.send(velocity.linear_mps, velocity.angular_radps)
