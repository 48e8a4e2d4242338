"""The ROS messages and topics of the graph.

The message classes are the typed dataclasses of ``rosbags``: the same definitions as ROS 2's own, without ROS. A
message must not be changed once it is published.
"""

import builtins
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros2

from handsteer.timeouts import STALE_S
from handsteer.types import ALWAYS_STOP, RELEASED, CmdVelType, Pose2D, Stick, Velocity

Duration = ros2.builtin_interfaces__msg__Duration
Time = ros2.builtin_interfaces__msg__Time
DiagnosticArray = ros2.diagnostic_msgs__msg__DiagnosticArray
DiagnosticStatus = ros2.diagnostic_msgs__msg__DiagnosticStatus
KeyValue = ros2.diagnostic_msgs__msg__KeyValue
Point = ros2.geometry_msgs__msg__Point
Pose = ros2.geometry_msgs__msg__Pose
PoseWithCovariance = ros2.geometry_msgs__msg__PoseWithCovariance
Quaternion = ros2.geometry_msgs__msg__Quaternion
Transform = ros2.geometry_msgs__msg__Transform
TransformStamped = ros2.geometry_msgs__msg__TransformStamped
Twist = ros2.geometry_msgs__msg__Twist
TwistStamped = ros2.geometry_msgs__msg__TwistStamped
TwistWithCovariance = ros2.geometry_msgs__msg__TwistWithCovariance
Vector3 = ros2.geometry_msgs__msg__Vector3
Odometry = ros2.nav_msgs__msg__Odometry
Log = ros2.rcl_interfaces__msg__Log
ParameterEvent = ros2.rcl_interfaces__msg__ParameterEvent
ClockMessage = ros2.rosgraph_msgs__msg__Clock
CameraInfo = ros2.sensor_msgs__msg__CameraInfo
CompressedImage = ros2.sensor_msgs__msg__CompressedImage
Image = ros2.sensor_msgs__msg__Image
JointState = ros2.sensor_msgs__msg__JointState
Joy = ros2.sensor_msgs__msg__Joy
LaserScan = ros2.sensor_msgs__msg__LaserScan
RegionOfInterest = ros2.sensor_msgs__msg__RegionOfInterest
Bool = ros2.std_msgs__msg__Bool
ColorRGBA = ros2.std_msgs__msg__ColorRGBA
Header = ros2.std_msgs__msg__Header
String = ros2.std_msgs__msg__String
TFMessage = ros2.tf2_msgs__msg__TFMessage
Marker = ros2.visualization_msgs__msg__Marker
MarkerArray = ros2.visualization_msgs__msg__MarkerArray
MeshFile = ros2.visualization_msgs__msg__MeshFile

M = TypeVar("M")


@dataclass
class TurtlePose:
    """``turtlesim/msg/Pose``, which rosbags does not have: pose and velocity of the turtle, in its own metres.

    Attributes:
        x: Metres to the right of the lower left corner.
        y: Metres above the lower left corner.
        theta: Yaw in rad, left positive.
        linear_velocity: Forward, in m/s.
        angular_velocity: To the left, in rad/s.
    """

    __msgtype__: ClassVar[str] = "turtlesim/msg/Pose"

    x: float
    y: float
    theta: float
    linear_velocity: float
    angular_velocity: float


@dataclass(frozen=True)
class Topic(Generic[M]):
    """A named stream of messages of one type.

    Attributes:
        name: Full ROS name in the root namespace, such as ``/image_raw``.
        type: The message class.
        latched: A late subscriber gets the last message at once (ROS 2: transient local).
        is_global: All namespaces share it, as ROS has it for transforms, time and diagnostics; other topics are in the
            namespace of their node.
        depth: How many messages may wait for a busy subscriber; older ones are dropped (ROS 2: keep last).
        lifespan_s: Messages that arrive later than this are dropped; None for no limit.
        beneath: The topic whose name it extends, or whose namespace it shares; it is renamed with it, as in ROS's
            image_transport.
        or_type: Another message class that its publisher may use instead, depending on subscribers; None if it has one.
        stops: Returns whether a message stops the robot, and is therefore obeyed however late; None if none does.
        any_reliability: Whether subscribers also receive what is published best effort, next to what is reliable.
    """

    name: str
    type: type[M]
    latched: bool = False
    is_global: bool = False
    depth: int = 1
    lifespan_s: float | None = None
    beneath: "Topic[Any] | None" = None
    stops: Callable[[Any], bool] | None = None
    or_type: builtins.type[Any] | None = None
    any_reliability: bool = False

    def moved_with(self, beneath: str) -> str:
        """Return its full name if the topic that it is ``beneath`` has the full name ``beneath``."""
        assert self.beneath is not None
        ending = self.name.removeprefix(self.beneath.name)
        return beneath + ending if ending != self.name else beneath.rpartition("/")[0] + self.name

    @property
    def ros_name(self) -> str:
        """The name for ROS: relative to the node's namespace (``image_raw``), or global (``/tf``)."""
        return self.name if self.is_global else self.name.removeprefix("/")


NO_STAMP = Time(sec=0, nanosec=0)
"""The stamp of a message without one."""


def is_zero(message: "Twist | TwistStamped") -> bool:
    """Return whether a velocity command is zero."""
    return velocity_in(message).is_zero


def is_set(message: Bool) -> bool:
    """Return whether a message of :data:`STOP` stops the robot."""
    return bool(message.data)


def is_stopping(sign: String) -> bool:
    """Return whether a sign stops the robot in every configuration."""
    return sign.data in ALWAYS_STOP


def is_released(message: Joy) -> bool:
    """Return whether the hand drives neither as a joystick nor by pointing."""
    sticks = stick_in(message), pointing_in(message)  # another recogniser's may lack the second
    return not any(stick.held and stick.is_valid for stick in sticks)


# The functions of topics are not lambdas, so that a topic can be pickled for another process.
IMAGE_RAW = Topic("/image_raw", Image)
IMAGE_COMPRESSED = Topic("/image_raw/compressed", CompressedImage, beneath=IMAGE_RAW)
# The name of the camera whose pictures follow, when another one was chosen; captured when it was.
CAMERA_CHANGED = Topic("/camera_changed", String)
CAMERA_INFO = Topic("/camera_info", CameraInfo, beneath=IMAGE_RAW)
# Each sign changes the speed by one step, so none may be lost when several arrive at once.
HAND_SIGN = Topic("/gesture/hand_sign", String, depth=10, lifespan_s=STALE_S, stops=is_stopping)
# The hand as a joystick: axes left and forward, -1 to 1, button 0 while it is held, button 1 when it engages.
GESTURE_JOY = Topic("/gesture/joy", Joy, lifespan_s=STALE_S, stops=is_released)
# A gamepad, from ROS's joy.
JOY = Topic("/joy", Joy, lifespan_s=STALE_S)
IMAGE_ANNOTATED = Topic("/gesture/image_annotated", Image)
# The same without the name of the sign, which the page shows in the language of each browser.
IMAGE_LANDMARKS = Topic("/gesture/image_landmarks", Image)
# And without the picture, for those who are not to see the person.
IMAGE_DRAWN = Topic("/gesture/image_drawn", Image)
CMD_VEL = Topic("/robot_diff_drive_controller/cmd_vel", Twist, depth=10, lifespan_s=STALE_S, stops=is_zero)
SELECT_ROBOT = Topic("/select_robot", String, depth=10)
SELECTED_ROBOT = Topic("/selected_robot", String, latched=True)
# True stops the robot and overrides all inputs; false ends the Stop. No message may be lost.
STOP = Topic("/stop", Bool, depth=10, stops=is_set, any_reliability=True)
# The state of /stop that each node remembers and publishes, for nodes that restart.
STOPPED = Topic("/stopped", Bool, latched=True)
# A pad begins with a zero, which must not be replaced by the deflection that follows.
STEERING_CMD_VEL = Topic("/steering/cmd_vel", Twist, depth=10, lifespan_s=STALE_S, stops=is_zero)
ODOM = Topic("/robot_diff_drive_controller/odom", Odometry)
TF = Topic("/tf", TFMessage, is_global=True, depth=10)
JOINT_STATES = Topic("/joint_states", JointState)
SCAN = Topic("/scan", LaserScan)
SAME_SCANNER_RAD = 0.2
"""By how much the angles of one scanner's scans may differ: some turn a little more or less for each."""
CLOCK = Topic("/clock", ClockMessage, is_global=True)
ROBOT_DESCRIPTION = Topic("/robot_description", String, latched=True)
WORLD_MARKERS = Topic("/world/markers", MarkerArray)
DIAGNOSTICS = Topic("/diagnostics", DiagnosticArray, is_global=True, depth=10)
# Who did what; see handsteer.audit.
AUDIT = Topic("/audit", Log, depth=50)

RECORDED: tuple[Topic[Any], ...] = (
    *(CAMERA_INFO, HAND_SIGN, GESTURE_JOY, JOY, STEERING_CMD_VEL, STOP, STOPPED, ODOM, TF, JOINT_STATES, CLOCK),
    *(ROBOT_DESCRIPTION, WORLD_MARKERS, DIAGNOSTICS, AUDIT),
)
"""What is recorded besides pictures, commands and laser scans: their topics depend on the graph."""


def type_name(message_type: type) -> str:
    """Return the ROS name of a message class, as ``std_msgs/msg/String``."""
    return str(getattr(message_type, "__msgtype__", message_type.__name__))


def twist(linear_mps: float, angular_radps: float) -> Twist:
    """Return the twist of a robot on a plane: forward in m/s, left turn in rad/s (REP 103)."""
    return Twist(linear=Vector3(linear_mps, 0.0, 0.0), angular=Vector3(0.0, 0.0, angular_radps))


def cmd_vel(kind: CmdVelType) -> Topic[Any]:
    """Return the topic of velocity commands with messages of ``kind``."""
    kinds = {"twist": (Twist, None), "twist_stamped": (TwistStamped, None), "auto": (Twist, TwistStamped)}
    of, instead = kinds[kind]
    return replace(CMD_VEL, type=of, or_type=instead)


def command(topic: Topic[Any], linear_mps: float, angular_radps: float, stamp: Time, frame_id: str) -> Any:
    """Return a velocity command for ``topic``: forward in m/s, left turn in rad/s (REP 103).

    Args:
        topic: Topic with Twist or TwistStamped.
        linear_mps: Forward velocity.
        angular_radps: Angular velocity, left positive.
        stamp: Time of the command, not of a frame's capture; for a TwistStamped.
        frame_id: Coordinate frame; for a TwistStamped.
    """
    bare = twist(linear_mps, angular_radps)
    return (
        TwistStamped(header=Header(stamp=stamp, frame_id=frame_id), twist=bare) if topic.type is TwistStamped else bare
    )


def twist_in(message: Twist | TwistStamped) -> Twist:
    """Return the twist in a velocity command."""
    return message.twist if isinstance(message, TwistStamped) else message


def velocity_in(message: Twist | TwistStamped) -> Velocity:
    """Return the velocity in a command, or in the twist of an odometry."""
    bare = twist_in(message)
    return Velocity(bare.linear.x, bare.angular.z)


def pose_in(message: Pose) -> Pose2D:
    """Return the pose on the floor."""
    return Pose2D(message.position.x, message.position.y, yaw_of(message.orientation))


def joy_of(stick: Stick, header: Header, *, engages: bool = False, pointing: Stick = RELEASED) -> Joy:
    """Return ``stick`` as a message for :data:`GESTURE_JOY`: axes (left, forward), button 0 while it is held.

    Button 1 is whether it ``engages``: the hand has just made that gesture. Axes 2 and 3 and button 2 are where the
    hand points, likewise.
    """
    axes = np.array([stick.left, stick.forward, pointing.left, pointing.forward], np.float32)
    return Joy(header=header, axes=axes, buttons=np.array([stick.held, engages, pointing.held], np.int32))


_NOT_VALID = Stick(True, math.nan, math.nan)


def engages_in(message: Joy) -> bool:
    """Return whether the hand has just made the gesture that engages, in a message from any source."""
    return len(message.buttons) > 1 and bool(message.buttons[1])


def pointing_in(message: Joy) -> Stick:
    """Return where the hand points in a message of :data:`GESTURE_JOY`, from any source, as :func:`stick_in` does."""
    return stick_in(message, enable_button=2, axis_linear=3, axis_angular=2)


def stick_in(message: Joy, *, enable_button: int = 0, axis_linear: int = 1, axis_angular: int = 0) -> Stick:
    """Return the joystick's state in a message from any source, by the conventions of ROS's ``teleop_twist_joy``.

    Args:
        message: From :data:`GESTURE_JOY` by default.
        enable_button: Index of the button that must be pressed.
        axis_linear: Index of the axis for forward.
        axis_angular: Index of the axis for left.

    Returns:
        Axes clamped to -1 to 1; not valid (:attr:`~handsteer.types.Stick.is_valid`) if the button or an axis is
        missing, or the axis of a pressed button is not finite.
    """
    buttons, axes = message.buttons, message.axes
    if enable_button >= len(buttons) or max(axis_linear, axis_angular) >= len(axes):
        return _NOT_VALID
    if not buttons[enable_button]:
        return RELEASED
    stick = Stick(True, float(axes[axis_linear]), float(axes[axis_angular]))
    if not stick.is_valid:
        return _NOT_VALID
    return Stick(True, max(-1.0, min(stick.forward, 1.0)), max(-1.0, min(stick.left, 1.0)))


def yaw_of(quaternion: Quaternion) -> float:
    """Return the yaw in rad of a ``quaternion``, of any length, that turns about z only; 0 for the all-zero one."""
    return 2 * math.atan2(quaternion.z, quaternion.w)
