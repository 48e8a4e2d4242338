"""The controller of a differential drive: a velocity command in, wheel speeds and odometry out.

It follows ``diff_drive_controller`` of ros2_controllers: limits on velocity and acceleration, a timeout after which it
brakes, and odometry from measured wheel angles. Everything here is a pure function; the caller keeps the state.
"""

import math
from dataclasses import dataclass

from handsteer.config import RobotConfig
from handsteer.types import ZERO, Pose2D, Velocity, changed_towards


@dataclass(frozen=True)
class DriveState:
    """The controller's state between two steps.

    Attributes:
        target: The last command; zero if it was not finite.
        target_age_s: Age of the last command, in the robot's own seconds.
        velocity: The velocity commanded to the wheels now, within all limits.
    """

    target: Velocity = ZERO
    target_age_s: float = 0.0
    velocity: Velocity = ZERO


def step(state: DriveState, command: Velocity | None, dt_s: float, config: RobotConfig) -> DriveState:
    """Return the state ``dt_s`` later.

    Args:
        state: The previous state.
        command: A new command, or None. One with NaN or infinity counts as zero, because an invalid command must not
            move the robot.
        dt_s: Elapsed time in seconds, >= 0.
        config: Limits and timeout.
    """
    if command is None:
        target, age_s = state.target, state.target_age_s + dt_s
    else:
        target, age_s = (command if command.is_finite else ZERO), 0.0
    wanted = target if age_s < config.cmd_vel_timeout else ZERO
    limited = wanted.clamped(config.max_linear, config.max_angular)
    change = Velocity(config.max_linear_acceleration * dt_s, config.max_angular_acceleration * dt_s)
    return DriveState(target, age_s, changed_towards(limited, state.velocity, change))


def wheel_speeds(velocity: Velocity, config: RobotConfig) -> tuple[float, float]:
    """Return the speeds of the left and right wheels in rad/s, forward positive: (v ∓ w L / 2) / r."""
    sideways = velocity.angular_radps * config.wheel_separation / 2
    left, right = velocity.linear_mps - sideways, velocity.linear_mps + sideways
    return left / config.wheel_radius, right / config.wheel_radius


def velocity_of(left: float, right: float, config: RobotConfig) -> Velocity:
    """Return the velocity of a robot whose wheels turn at ``left`` and ``right`` rad/s and do not slip.

    Given angles in rad instead of speeds, it returns the distance in m and the turn in rad.
    """
    return Velocity(
        (left + right) / 2 * config.wheel_radius, (right - left) * config.wheel_radius / config.wheel_separation
    )


def integrate(pose: Pose2D, left: float, right: float, config: RobotConfig) -> Pose2D:
    """Return the pose after the wheels have turned by ``left`` and ``right`` rad, along a circular arc.

    The chord of the arc is the midpoint rule (Runge-Kutta of second order) times sin(a) / a, where a is half the turn.
    This is exact, as ``Odometry::integrateExact`` of diff_drive_controller, and needs no special case for small turns
    other than zero.
    """
    moved = velocity_of(left, right, config)
    half_turn = moved.angular_radps / 2
    chord = moved.linear_mps * (math.sin(half_turn) / half_turn if half_turn else 1.0)
    return Pose2D(
        pose.x + chord * math.cos(pose.yaw + half_turn),
        pose.y + chord * math.sin(pose.yaw + half_turn),
        math.remainder(pose.yaw + moved.angular_radps, math.tau),
    )
