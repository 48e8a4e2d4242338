"""Topics, types and limits of known robots. A preset overrides the defaults, and everything else overrides it.

Sources, by robot:

* TurtleBot 3: ``turtlebot3_teleop`` (highest speeds of each model), ``turtlebot3_node`` (``cmd_vel``, ``odom``; stamped
  from Jazzy on), ``turtlebot3_navigation2`` (accelerations of 2.5 m/s² and 3.2 rad/s²).
* TurtleBot 4: the documentation of Create 3, its base (0.306 m/s and 0.9 m/s² while its safety features are on), and
  ``turtlebot4_navigation`` (1.9 rad/s; stamped from Jazzy on).
* turtlesim: ``turtlesim/src/turtle.cpp`` (it stops a second after the last command), ``turtle_teleop_key`` (2 m/s and 2
  rad/s). Its field is 11 of its metres wide.
* generic: the speeds of ``teleop_twist_keyboard``.
"""

from typing import Any, Literal, get_args

Preset = Literal["generic", "turtlebot3_burger", "turtlebot3_waffle", "turtlebot4", "turtlesim"]
PRESETS: tuple[Preset, ...] = get_args(Preset)

_BRAKES = 0.7


def _preset(
    linear_mps: float, angular_radps: float, linear_mps2: float, angular_radps2: float, **robot: Any
) -> dict[str, Any]:
    """Return a preset: maximum speeds of control and robot, maximum accelerations and deceleration of the robot.

    The guaranteed deceleration of these robots is not documented; a part of their acceleration is used instead.
    """
    speeds = {"max_linear": linear_mps, "max_angular": angular_radps}
    accelerations = {"max_linear_acceleration": linear_mps2, "max_angular_acceleration": angular_radps2}
    brakes = {"deceleration": _BRAKES * linear_mps2, "angular_deceleration": _BRAKES * angular_radps2}
    return {"control": speeds, "robot": {**speeds, **accelerations, **robot}, "collision_monitor": brakes}


_TURTLESIM = {"cmd_vel_topic": "turtle1/cmd_vel", "odom_topic": "turtle1/pose", "odom_type": "turtlesim_pose"}
_KNOWN: dict[str, dict[str, Any]] = {
    "generic": _preset(0.5, 1.0, 0.5, 2.0),
    "turtlebot3_burger": _preset(0.22, 2.84, 2.5, 3.2),
    "turtlebot3_waffle": _preset(0.26, 1.82, 2.5, 3.2),
    "turtlebot4": _preset(0.306, 1.9, 0.9, 3.0),
    "turtlesim": _preset(2.0, 2.0, 2.0, 4.0, **_TURTLESIM),
}


def preset(name: object) -> dict[str, Any]:
    """Return the preset of this name, nested as in :class:`~handsteer.config.Config`.

    Args:
        name: One of :data:`PRESETS`; for any other value the result is empty, and validation reports it later.
    """
    return _KNOWN.get(name, {}) if isinstance(name, str) else {}
