"""The control's assist on a lap: what it lets through of the commands, by the robot's own scanner and odometry."""

from handsteer import doors
from handsteer.config import Config
from handsteer.control.assist import assist_named, held_back
from handsteer.control.footprint import points_of
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.messages import Header, Time
from handsteer.nodes.robot import scan_message
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RobotState
from handsteer.types import Velocity

ASSISTS = ("off", "brake", *doors.ASSISTS.names())
"""As ``control.assist``."""

_SCAN_S, _ODOMETRY_S = 0.1, 0.02
_HEADER = Header(Time(0, 0), "base_scan")


class Assistance:
    """Limits commands as the control does, with ten scans a second and odometry fifty times.

    Args:
        kind: What assists.
        config: Size and decelerations of the robot, and the limit of turns.
        robot: Whose scanner it is.
    """

    def __init__(self, kind: str, config: Config, robot: SimulatedRobot) -> None:
        self._robot, self._is_on = robot, kind != "off"
        self._limiter = ObstacleLimiter(config.collision_monitor)
        self._limiter.max_angular_radps = config.control.max_angular
        self._limiter.assist = assist_named(kind)
        self._scan_s = self._odometry_s = 0.0

    def note(self, state: RobotState) -> None:
        """Take the robot's state after one tick."""
        if not self._is_on:
            return
        now_s = state.time_s
        if now_s >= self._scan_s - 1e-9:
            self._scan_s = now_s + _SCAN_S
            points = points_of(scan_message(_HEADER, self._robot.scan()), self._limiter.rule)
            if points is not None:
                self._limiter.see(points, now_s)
        if now_s >= self._odometry_s - 1e-9:
            self._odometry_s = now_s + _ODOMETRY_S
            self._limiter.feel(Velocity(state.linear_mps, state.angular_radps), now_s)

    def admit(self, wanted: Velocity, now_s: float) -> tuple[Velocity, Velocity | None]:
        """Return the velocity to command, and from where the control continues if that is not ``wanted``."""
        if not self._is_on:
            return wanted, None
        allowed = self._limiter.limit(wanted, now_s)
        return allowed, None if allowed == wanted else held_back(wanted, allowed)
