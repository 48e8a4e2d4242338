"""The robot at the end of the chain: what its motors are asked for, whatever became of the nodes before it."""

from handsteer.clock import Clock
from handsteer.config import RobotConfig
from handsteer.plugins.sim.diff_drive import DriveState, integrate, step, wheel_speeds
from handsteer.robots import Obstacle, RangeScan, RobotState
from handsteer.types import Pose2D, Velocity

_DT_S = 0.02


class Base:
    """A :class:`~handsteer.robots.Robot` with the real controller, and wheels that never slip.

    It has a watchdog of its own, as a robot has whose node has died.
    """

    description = "<robot name='base'/>"

    def __init__(self, clock: Clock, config: RobotConfig) -> None:
        self._clock = clock
        self._config = config
        self._drive = DriveState()
        self._command: Velocity | None = None
        self._asked = Velocity()
        self._asked_s = clock.now()
        self._pose = Pose2D(0.0, 0.0, 0.0)
        self._time_s = 0.0

    @property
    def is_asked_to_move(self) -> bool:
        """Whether its last command is still good, and not zero."""
        is_fresh = self._clock.now() - self._asked_s < self._config.cmd_vel_timeout
        return is_fresh and self._asked != Velocity()

    @property
    def speed_mps(self) -> float:
        """What it was last asked for, forward."""
        return self._asked.linear_mps

    def command(self, linear_mps: float, angular_radps: float) -> None:
        self._command = Velocity(linear_mps, angular_radps)
        self._drive = step(self._drive, self._command, 0.0, self._config)
        self._asked, self._asked_s = self._drive.target, self._clock.now()

    def step(self, dt_s: float) -> RobotState:
        self._time_s += dt_s
        self._drive = step(self._drive, None, dt_s, self._config)
        velocity = self._drive.velocity
        left, right = wheel_speeds(velocity, self._config)
        self._pose = integrate(self._pose, left * dt_s, right * dt_s, self._config)
        return RobotState(
            time_s=self._time_s,
            odometry=self._pose,
            linear_mps=velocity.linear_mps,
            angular_radps=velocity.angular_radps,
            joint_positions={},
            joint_velocities={},
            truth=self._pose,
            contacts=(),
            collisions=None,
        )

    def obstacles(self) -> list[Obstacle]:
        return []

    def scan(self) -> RangeScan | None:
        return None

    def commanders(self) -> list[str]:
        return []

    def close(self) -> None:
        self.command(0.0, 0.0)
