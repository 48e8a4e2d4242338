"""Parameters of the control and of the robot, and presets: the topics, types and limits of known robots.

A preset overrides the defaults, and everything else overrides it. Sources, by robot:

* TurtleBot 3: ``turtlebot3_teleop`` (highest speeds of each model), ``turtlebot3_node`` (``cmd_vel``, ``odom``; stamped
  from Jazzy on), ``turtlebot3_navigation2`` (accelerations of 2.5 m/s² and 3.2 rad/s²).
* TurtleBot 4: the documentation of Create 3, its base (0.306 m/s and 0.9 m/s² while its safety features are on), and
  ``turtlebot4_navigation`` (1.9 rad/s; stamped from Jazzy on).
* turtlesim: ``turtlesim/src/turtle.cpp`` (it stops a second after the last command), ``turtle_teleop_key`` (2 m/s and 2
  rad/s). Its field is 11 of its metres wide.
* generic: the speeds of ``teleop_twist_keyboard``.
"""

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import Field, field_validator

from handsteer.config.section import EMPTY_IS_NONE, Section, live
from handsteer.doors import ACTIONS, ASSISTS, ROBOTS, TRANSPORTS
from handsteer.errors import quoted
from handsteer.timeouts import ODOMETRY_S, RENEW_S, ROBOT_S, STALE_S
from handsteer.types import ALWAYS_STOP, BUILT_IN, LONGEST_SIGN, Action, CmdVelType, bare_sign, find_sign

Preset = Literal["generic", "turtlebot3_burger", "turtlebot3_waffle", "turtlebot4", "turtlesim"]

_BRAKES = 0.7

_TURTLESIM = {"cmd_vel_topic": "turtle1/cmd_vel", "odom_topic": "turtle1/pose", "odom_type": "turtlesim_pose"}

_KINDS = ("sim", "auto", "ros2", "dds", "zenoh", "ros1")
ROBOT_KINDS = tuple(dict.fromkeys((*_KINDS, *ROBOTS.names(), *TRANSPORTS.names())))
"""The kinds of robots: those of plug-ins, and the transports to one behind a topic."""
if TYPE_CHECKING:
    RobotKind = str
    SignEffect = Action
    AssistKind = str
else:
    RobotKind = Literal[ROBOT_KINDS]
    AssistKind = Literal[("off", "brake", *ASSISTS.names())]
    SignEffect = Literal[(*get_args(Action), *ACTIONS.names())]
SIGN_EFFECTS: tuple[Any, ...] = (*get_args(Action), *ACTIONS.names())
"""What signs can do: the built-in actions, and those of plug-ins."""
NEXT = "next"
"""On ``/select_robot``, the following robot instead of the name of one."""
MOST_ACTIONS = 100
"""Entries of ``control.actions``: any node of the graph may add some, and each sign is compared with all of them."""
_NAMESPACE = re.compile(r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


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


PRESETS: dict[str, dict[str, Any]] = {
    "generic": _preset(0.5, 1.0, 0.5, 2.0),
    "turtlebot3_burger": _preset(0.22, 2.84, 2.5, 3.2),
    "turtlebot3_waffle": _preset(0.26, 1.82, 2.5, 3.2),
    "turtlebot4": _preset(0.306, 1.9, 0.9, 3.0),
    "turtlesim": _preset(2.0, 2.0, 2.0, 4.0, **_TURTLESIM),
}
"""Nested as in :class:`~handsteer.config.Config`, by name."""


class ControlConfig(Section):
    """Conversion of signs, or of the hand as a joystick, to velocities."""

    mode: Literal["signs", "joystick"] = live(
        "signs",
        description="What the hand is: signs, as in the tutorial, or a joystick (/gesture/joy), with a gamepad on /joy",
    )
    rule: Literal["course", "point"] = live(
        "course",
        description="How signs drive: course is the tutorial's rule; point drives where the index finger points, the "
        "faster the higher the hand is, and keeps the speed with Go",
    )
    ramp: Literal["per_message", "per_second"] = live(
        "per_message",
        description="per_message adds a step per message, as in the tutorial; per_second is independent of frame rate",
    )
    linear_step: float = live(0.01, gt=0, le=1, description="Change of linear speed per message [m/s]")
    angular_step: float = live(0.1, gt=0, le=5, description="Change of angular speed per message [rad/s]")
    linear_acceleration: float = live(0.3, gt=0, le=10, description="Change of linear speed with per_second [m/s²]")
    angular_acceleration: float = live(3.0, gt=0, le=50, description="Change of angular speed with per_second [rad/s²]")
    # The defaults are those with which handsteer bench drives best (docs/driving.md).
    point_time: float = live(
        0.8, gt=0, le=10, description="With point, time from zero to the full speed while a finger points [s]"
    )
    point_turn: float = live(1.5, gt=0, le=20, description="With point, turn rate of a finger at its full tilt [rad/s]")
    max_sign_rate: float = live(
        60.0,
        gt=0,
        le=1000,
        description="Signs above this rate do not speed the robot up further, with per_message [1/s]",
    )
    max_linear: float = live(1.0, gt=0, le=10, description="Maximum linear speed [m/s]")
    max_angular: float = live(2.0, gt=0, le=20, description="Maximum angular speed [rad/s]")
    max_linear_acceleration: float = live(
        0.0,
        ge=0,
        le=1000,
        description="Maximum linear acceleration of commands from any input when speeding up; 0 is unlimited [m/s²]",
    )
    max_angular_acceleration: float = live(
        0.0,
        ge=0,
        le=1000,
        description="Maximum angular acceleration of commands from any input when speeding up; 0 is unlimited [rad/s²]",
    )
    max_linear_jerk: float = live(
        0.0,
        ge=0,
        le=1000,
        description="Maximum linear jerk of commands from any input when speeding up; 0 is unlimited [m/s³]",
    )
    max_angular_jerk: float = live(
        0.0,
        ge=0,
        le=1000,
        description="Maximum angular jerk of commands from any input when speeding up; 0 is unlimited [rad/s³]",
    )
    sign_timeout: float = live(
        STALE_S, gt=0, le=5, description="The robot is stopped after this long without a sign [s]"
    )
    steering_timeout: float = live(
        STALE_S,
        gt=0,
        le=5,
        description="Manual steering overrides the signs until this long after its last command [s]",
    )
    actions: dict[str, SignEffect] = live(
        {}, description="Actions of signs, such as {Hi: stop, Peace: turbo}; Stop and NONE always stop"
    )
    assist: AssistKind = live(
        "off",
        description="What the robot does before obstacles that a laser scanner sees: brake slows down and stops, steer "
        "also drives around them where it can; both need the topic `scan`",
    )
    arming: Literal["auto", "on", "off", "course"] = Field(
        "auto",
        description="Whether signs move the robot only after neutral (Stop, or no hand) at start-up and after each "
        "fault; auto is on unless the robot is simulated in the same process; course is also off while commands go to "
        "robot_diff_drive_controller/cmd_vel, that of the tutorial's simulated robot",
    )
    engage: Literal["auto", "on", "off", "course"] = Field(
        "auto",
        description="Whether the hand drives only after it has engaged, until 5 s without a sign, a Stop or a fault; "
        "auto and course are as for arming",
    )
    engage_by: Literal["gesture", "hold"] = live(
        "gesture",
        description="How the hand engages: gesture is open, close, open, which no picture can do; hold is an open palm "
        "for 1 s, for recognisers without /gesture/joy",
    )
    renew: Literal["auto", "on", "off", "course"] = Field(
        "auto",
        description="Whether a sign or stick that drives without any change for renew_time stops the robot until it is "
        "released and shown again, as the vigilance device of a train; auto and course are as for arming",
    )
    renew_time: float = live(
        RENEW_S, ge=1, le=600, description="After this long without any change, what drives is to be shown again [s]"
    )
    cmd_vel_type: CmdVelType = Field(
        "auto",
        description="Type of commands to send: geometry_msgs/Twist or TwistStamped; auto follows robot.cmd_vel_type, "
        "in ROS 2 also the robot's subscriber, and is otherwise twist",
    )
    cmd_vel_frame_id: str = Field("base_link", description="Coordinate frame in the header of TwistStamped commands")
    robots: tuple[str, ...] = Field(
        (),
        max_length=32,
        description="Namespaces of robots that one hand drives in turn, such as [r1, r2]; empty for a single robot",
    )

    @property
    def points(self) -> bool:
        """Whether the hand drives where it points."""
        return self.mode == "signs" and self.rule == "point"

    @property
    def by_stick(self) -> bool:
        """Whether the hand drives by the states on ``/gesture/joy``, not by the signs."""
        return self.mode == "joystick" or self.points

    @field_validator("arming", "assist", "engage", "renew", mode="before")
    @classmethod
    def _from_yaml(cls, value: object) -> object:
        # YAML, and so ROS, converts on and off to true and false.
        return {True: "on", False: "off"}[value] if isinstance(value, bool) else value

    @field_validator("robots")
    @classmethod
    def _names_of_robots(cls, robots: tuple[str, ...]) -> tuple[str, ...]:
        wrong = [name for name in robots if not _NAMESPACE.fullmatch(name) or robots.count(name) > 1]
        if wrong:
            raise ValueError(f"should name each robot once, with letters, digits and _; {wrong[0]!r} does not")
        if NEXT in robots:
            raise ValueError(f"should not name a robot {NEXT!r}: on /select_robot it selects the following one")
        return robots

    @field_validator("actions")
    @classmethod
    def _known_names_and_a_way_to_stop(cls, actions: dict[str, Action]) -> dict[str, Action]:
        if len(actions) > MOST_ACTIONS:
            raise ValueError(f"should have at most {MOST_ACTIONS} entries, not {len(actions)}")
        named: dict[str, Action] = {}
        taken: set[str] = set()
        for name, action in actions.items():
            if len(name) > LONGEST_SIGN:
                raise ValueError(
                    f"should have names of at most {LONGEST_SIGN} characters; {quoted(name)} has {len(name)}"
                )
            sign = find_sign(name, BUILT_IN) or name.strip()
            if not sign or bare_sign(sign) in taken:
                raise ValueError(f"should name each sign once; {name!r} does not")
            if sign in ALWAYS_STOP and action != "stop":
                raise ValueError(f"should leave {sign} at 'stop', so that the robot can always be stopped")
            named[sign] = action
            taken.add(bare_sign(sign))
        return named


class CollisionMonitorConfig(Section):
    """Obstacles that a laser scanner sees: the size of the robot and how it brakes, for the assist of the control."""

    enabled: bool = live(
        False, description="For older configurations: the same as control.assist brake, where that is off"
    )
    source_timeout: float = live(
        0.45, gt=0, le=5, description="The robot is stopped after this long without a scan, or if the scan is older [s]"
    )
    margin: float = live(
        0.15, ge=0, le=5, description="Distance to an obstacle in its path at which the robot stops [m]"
    )
    deceleration: float = live(0.7, gt=0, le=20, description="Guaranteed linear deceleration of the robot [m/s²]")
    angular_deceleration: float = live(
        1.5, gt=0, le=50, description="Guaranteed angular deceleration of the robot [rad/s²]"
    )
    reaction_time: float = live(
        0.25, ge=0, le=5, description="Delay until a command takes effect, including the wait for the next scan [s]"
    )
    front: float = live(0.26, gt=0, le=10, description="Extent of the robot ahead of its base frame [m]")
    back: float = live(0.26, gt=0, le=10, description="Extent of the robot behind its base frame [m]")
    side: float = live(0.245, gt=0, le=10, description="Extent of the robot to either side [m]")
    scan_x: float = live(0.0, ge=-10, le=10, description="Position of the scanner ahead of the base frame [m]")
    scan_y: float = live(0.0, ge=-10, le=10, description="Position of the scanner to the left of the base frame [m]")
    scan_yaw: float = live(0.0, ge=-7, le=7, description="Rotation of the scanner to the left [rad]")


def assist_of(control: ControlConfig, monitor: CollisionMonitorConfig) -> str:
    """Return what the control does before obstacles: ``off``, ``brake``, or the name of an assist."""
    return "brake" if control.assist == "off" and monitor.enabled else control.assist


class RobotConfig(Section):
    """The robot: simulated in a world, or a real one with its topics."""

    kind: RobotKind = Field(
        "sim",
        description="sim is the simulated robot; ros2, dds, zenoh and ros1 drive a real one, auto uses ros2 if "
        "installed, else dds",
    )
    preset: Annotated[Preset | None, EMPTY_IS_NONE] = Field(
        None, description="A robot with known topics, types and limits; the default for a real robot is generic"
    )
    cmd_vel_type: CmdVelType = Field(
        "auto",
        description="Type of commands it subscribes to: geometry_msgs/Twist or TwistStamped; auto follows "
        "control.cmd_vel_type, for a real ROS 2 robot its subscriber, and is otherwise twist",
    )
    cmd_vel_topic: str = Field("cmd_vel", min_length=1, description="Topic of a real robot's commands")
    odom_topic: str = Field("odom", description="Topic of a real robot's odometry; empty for none")
    odom_type: Literal["odometry", "turtlesim_pose"] = Field(
        "odometry", description="Type of the odometry: nav_msgs/Odometry or turtlesim/Pose"
    )
    odom_timeout: float = Field(
        ODOMETRY_S, gt=0, le=10, description="A real robot is stopped if its odometry stops for this long [s]"
    )
    scan_topic: str = Field("scan", description="Topic of a real robot's laser scanner; empty for none")
    command_rate: float = Field(
        20.0, ge=5, le=50, description="Rate at which commands to a real robot are repeated [1/s]"
    )
    world: str = Field("obstacles", description="Name of a shipped world, or a YAML file")
    wheel_separation: float = Field(0.45, gt=0, le=10, description="Distance between the left and right wheels [m]")
    wheel_radius: float = Field(0.06, gt=0, le=2, description="Radius of the wheels [m]")
    max_linear: float = Field(2.0, gt=0, le=20, description="Maximum linear speed of the controller [m/s]")
    max_linear_acceleration: float = Field(
        1.0, gt=0, le=50, description="Maximum linear acceleration of the controller [m/s²]"
    )
    max_angular: float = Field(8.0, gt=0, le=50, description="Maximum angular speed of the controller [rad/s]")
    max_angular_acceleration: float = Field(
        2.0, gt=0, le=50, description="Maximum angular acceleration of the controller [rad/s²]"
    )
    cmd_vel_timeout: float = Field(
        ROBOT_S,
        gt=0,
        le=10,
        description="It brakes after this long without a command, or if a stamped one is older [s]",
    )
    odom_frame_id: str = Field("odom", description="Coordinate frame of the odometry")
    base_frame_id: str = Field("base_link", description="Coordinate frame of the robot")
    scan_frame_id: str = Field("base_scan", description="Coordinate frame of the laser scanner")
    frame_prefix: str = Field(
        "auto",
        description="Prefix of these coordinate frames, as in robot_state_publisher; auto is the node's namespace, "
        "such as r1/, or empty if /tf is remapped",
    )
    publish_clock: bool = Field(False, description="Whether to publish /clock; the robot itself then runs on real time")
