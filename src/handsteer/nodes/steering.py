"""The node ``steering``: drives by hand, as ``rqt_robot_steering`` does, and stops the robot whoever drives."""

from handsteer.clock import Clock
from handsteer.control.sign_control import ZERO, Velocity
from handsteer.messages import STEERING_CMD_VEL, STOP, Bool, twist
from handsteer.nodes.node import Node
from handsteer.transports.protocol import Transport

_PERIOD_S = 0.1


class SteeringNode(Node):
    """Repeats the velocity asked for by :meth:`steer` until :meth:`release`; silent otherwise.

    All may be called from any thread.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        super().__init__("steering", transport, clock)
        self._wanted: Velocity | None = None
        self._halted = False
        self._cmd_vel = self.publisher(STEERING_CMD_VEL)
        self._stop = self.publisher(STOP)
        self.every(_PERIOD_S, self._repeat)

    def steer(self, linear_mps: float, angular_radps: float) -> None:
        """Drive at this velocity from now on: m/s forward, rad/s to the left."""
        self._wanted = Velocity(linear_mps, angular_radps)
        self._publish(self._wanted)

    def release(self) -> None:
        """Stop, and let others drive."""
        if self._wanted is not None:
            self._wanted = None
            self._publish(ZERO)

    def halt(self) -> None:
        """Stop the robot, whoever drives, until :meth:`reset`; said again and again, for a control that starts anew."""
        self._wanted = None
        self._halted = True
        self._stop.publish(Bool(data=True))

    def reset(self) -> None:
        """Let the robot be driven again; nothing moves before whoever drives has let go and begins anew."""
        self._halted = False
        self._stop.publish(Bool(data=False))

    def on_stop(self) -> None:
        """Leave nothing in motion."""
        self.release()

    def _repeat(self) -> None:
        if self._halted:
            self._stop.publish(Bool(data=True))
        wanted = self._wanted
        if wanted is not None:
            self._publish(wanted)

    def _publish(self, velocity: Velocity) -> None:
        self._cmd_vel.publish(twist(velocity.linear_mps, velocity.angular_radps))
