"""Every parameter of handsteer: type, unit, range, default and a one-line description.

The YAML file, the command line and the settings of the page are generated from these models. Names are as in ROS nodes,
units are SI (REP 103), in brackets in each description.
"""

import logging
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from handsteer.errors import ConfigError
from handsteer.presets import CmdVelType, Preset, preset
from handsteer.timeouts import ODOMETRY_S, ROBOT_S, STALE_S
from handsteer.types import ALWAYS_STOP, BUILT_IN, Action, Handedness, find_sign

log = logging.getLogger(__name__)

S = TypeVar("S", bound="Section")

RobotKind = Literal["sim", "auto", "ros2", "dds", "zenoh", "ros1"]
Recorded = Literal["auto", "always", "never"]
# ROS parameters have no null.
OptionalPath = Annotated[Path | None, BeforeValidator(lambda path: None if path == "" else path)]
_LONGEST_SHOWN = 200
_OLD_NAMES_SEEN: set[str] = set()
_NAMESPACE = re.compile(r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


class Section(BaseModel):
    """A group of parameters; unknown names and values out of range are rejected.

    Attributes:
        live: Those that can change while a node runs; the others are read at start-up.
        renamed: New names of parameters by their old ones, which are still accepted.
    """

    live: ClassVar[frozenset[str]] = frozenset()
    renamed: ClassVar[Mapping[str, str]] = {}
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True)

    @classmethod
    def new_name(cls, name: str) -> str:
        """Return the current name of the parameter ``name``, and warn once of an old name."""
        new = cls.renamed.get(name, name)
        if new != name and name not in _OLD_NAMES_SEEN:
            _OLD_NAMES_SEEN.add(name)
            log.warning("parameter %s is deprecated: use %s", name, new)
        return new

    @model_validator(mode="before")
    @classmethod
    def by_new_names(cls, values: Any) -> Any:
        """Return ``values`` with old names of parameters replaced by new ones, unless the new one is given too."""
        if not (isinstance(values, dict) and cls.renamed.keys() & values.keys()):
            return values
        renamed = {name: value for name, value in values.items() if name not in cls.renamed}
        for old in cls.renamed.keys() & values.keys():
            renamed.setdefault(cls.new_name(old), values[old])
        return renamed


class CameraConfig(Section):
    """Where frames come from."""

    # A webcam's number is a number in YAML and on ROS's parameter server.
    model_config = ConfigDict(coerce_numbers_to_str=True)

    source: str = Field(
        "auto",
        description="auto, virtual, browser (of the device that shows the page), a webcam's index or /dev/videoN, "
        "an address (rtsp, http), a video file or a folder of photos",
    )
    width: int = Field(
        640, ge=64, le=4096, description="Width requested from a webcam, or of the virtual hand's picture [px]"
    )
    height: int = Field(
        480, ge=48, le=4096, description="Height requested from a webcam, or of the virtual hand's picture [px]"
    )
    fps: float = Field(
        30.0, gt=0, le=240, description="Frame rate requested from a webcam, or of the virtual hand [1/s]"
    )
    at_end: Literal["loop", "hold", "end"] = Field(
        "loop",
        description="At the end of a file: start again, hold (no frames, so NONE), or end (default if headless)",
    )
    photo_duration: float = Field(1.0, gt=0, le=3600, description="How long each photo of a folder is shown [s]")
    frame_id: str = Field(
        "camera_optical_frame",
        description="Coordinate frame in the header of each image, optical as in REP 103: z forward, x right; the "
        "default in a namespace that shares /tf, such as /r1, is r1/camera_optical_frame",
    )
    calibration: OptionalPath = Field(
        None,
        description="YAML file of ROS's camera_calibration, for camera_info; without it, camera_info is all zeros "
        "(uncalibrated)",
    )


class VirtualHandConfig(Section):
    """The rendered hand that replaces a webcam."""

    script: str = Field(
        "Forward:3 Turn Left:2 Forward:2 Turn Right:2 Go:1 Backward:3 Stop:2 NONE:1",
        description="Signs to show, with their durations in seconds, repeated; NONE lowers the hand; "
        "Peace, Three, Four, Horns, Call and OK are for teaching",
    )
    handedness: Handedness = Field("Right", description="Left or right hand")
    skin: Literal["light", "medium", "dark"] = Field("medium", description="Skin tone")
    background: Literal["plain", "cluttered"] = Field("plain", description="Background of the picture")
    sleeve: bool = Field(True, description="Whether the forearm wears a sleeve")
    seed: int = Field(0, ge=0, description="Random seed of the background and of the hand's small movements")


class LandmarksConfig(Section):
    """Detection and tracking of hands in a frame."""

    renamed = {"second_look": "refine_new_hands"}

    model: Literal["fast", "full", "lite"] = Field(
        "fast",
        description="full is MediaPipe's own; fast is full in 8-bit integers, takes half the time and differs by up "
        "to a quarter of a pixel; lite is as fast, but less accurate",
    )
    max_hands: int = Field(
        2,
        ge=1,
        le=2,
        description="Maximum number of hands in a frame, from which the one that shows a sign is selected",
    )
    min_detection_confidence: float = Field(0.3, ge=0, le=1, description="Minimum score to accept a detected palm")
    refine_new_hands: bool = Field(True, description="Run the landmark model twice on a new hand, for better landmarks")
    wide_search: bool = Field(
        True,
        description="Also search a widened frame, where hands are smaller, and its middle; finds more close hands",
    )
    min_presence: float = Field(0.5, ge=0, le=1, description="Minimum score to keep tracking a hand")
    threads: int = Field(1, ge=1, le=64, description="CPU threads of the landmark model")


class SignsConfig(Section):
    """Recognition of signs from the landmarks, and when a sign counts."""

    renamed = {"bridge_time": "dropout_hold", "keep_confidence": "release_confidence"}

    live = frozenset(
        {
            "model",
            "min_confidence",
            "release_confidence",
            "confirm_time",
            "dropout_hold",
            "switch_time",
            "max_frame_age",
        }
    )

    model: OptionalPath = Field(
        None,
        description="File of taught signs, written by `handsteer signs train`; none for the shipped signs only",
    )
    min_confidence: float = Field(0.8, ge=0, le=1, description="Minimum confidence to recognise a sign")
    release_confidence: float = Field(
        0.5, ge=0, le=1, description="Minimum confidence to keep the sign that already counts"
    )
    confirm_time: float = Field(
        0.1, ge=0, le=2, description="How long a sign must be recognised before it counts; Stop counts at once [s]"
    )
    dropout_hold: float = Field(0.1, ge=0, le=2, description="How long a sign still counts after its hand is lost [s]")
    switch_time: float = Field(
        0.5,
        ge=0,
        le=10,
        description="How long the selected hand must show no sign before another hand with a sign is selected [s]",
    )
    max_frame_age: float = Field(STALE_S, gt=0, le=10, description="Older frames are ignored [s]")
    recorded: Recorded = Field(
        "auto",
        description="Whether to accept frames with old stamps, as in recordings: auto accepts those of rosbag play; "
        "always accepts all that are stamped more than 5 s ago, so use it for recordings only",
    )
    image_transport: Literal["auto", "raw", "compressed"] = Field(
        "auto",
        description="Images to subscribe to: raw is /image_raw, compressed is /image_raw/compressed; auto is "
        "compressed if nodes may be on other machines (DDS beyond localhost), or the one that is published",
    )


class ControlConfig(Section):
    """Conversion of signs to velocities."""

    live = frozenset(
        {
            "ramp",
            "linear_step",
            "angular_step",
            "linear_acceleration",
            "angular_acceleration",
            "max_linear",
            "max_angular",
            "sign_timeout",
            "steering_timeout",
            "actions",
            "max_sign_rate",
            "max_linear_acceleration",
            "max_angular_acceleration",
            "max_linear_jerk",
            "max_angular_jerk",
        }
    )

    ramp: Literal["per_message", "per_second"] = Field(
        "per_message",
        description="per_message adds a step per message, as in the tutorial; per_second is independent of frame rate",
    )
    linear_step: float = Field(0.01, gt=0, le=1, description="Change of linear speed per message [m/s]")
    angular_step: float = Field(0.1, gt=0, le=5, description="Change of angular speed per message [rad/s]")
    linear_acceleration: float = Field(0.3, gt=0, le=10, description="Change of linear speed with per_second [m/s²]")
    angular_acceleration: float = Field(
        3.0, gt=0, le=50, description="Change of angular speed with per_second [rad/s²]"
    )
    max_sign_rate: float = Field(
        60.0,
        gt=0,
        le=1000,
        description="Signs above this rate do not speed the robot up further, with per_message [1/s]",
    )
    max_linear: float = Field(1.0, gt=0, le=10, description="Maximum linear speed [m/s]")
    max_angular: float = Field(2.0, gt=0, le=20, description="Maximum angular speed [rad/s]")
    max_linear_acceleration: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Maximum linear acceleration of commands from any input when speeding up; 0 is unlimited [m/s²]",
    )
    max_angular_acceleration: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Maximum angular acceleration of commands from any input when speeding up; 0 is unlimited [rad/s²]",
    )
    max_linear_jerk: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Maximum linear jerk of commands from any input when speeding up; 0 is unlimited [m/s³]",
    )
    max_angular_jerk: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Maximum angular jerk of commands from any input when speeding up; 0 is unlimited [rad/s³]",
    )
    sign_timeout: float = Field(
        STALE_S, gt=0, le=5, description="The robot is stopped after this long without a sign [s]"
    )
    steering_timeout: float = Field(
        STALE_S,
        gt=0,
        le=5,
        description="Manual steering overrides the signs until this long after its last command [s]",
    )
    actions: dict[str, Action] = Field(
        {}, description="Actions of signs, such as {Hi: stop, Peace: turbo}; Stop and NONE always stop"
    )
    arming: Literal["auto", "on", "off"] = Field(
        "auto",
        description="Whether the robot moves only after neutral (Stop, or no hand) at start-up and after each fault; "
        "auto is on unless the robot is simulated in the same process",
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

    @field_validator("arming", mode="before")
    @classmethod
    def _from_yaml(cls, arming: object) -> object:
        # YAML, and so ROS, converts on and off to true and false.
        return {True: "on", False: "off"}[arming] if isinstance(arming, bool) else arming

    @field_validator("robots")
    @classmethod
    def _names_of_robots(cls, robots: tuple[str, ...]) -> tuple[str, ...]:
        wrong = [name for name in robots if not _NAMESPACE.fullmatch(name) or robots.count(name) > 1]
        if wrong:
            raise ValueError(f"should name each robot once, with letters, digits and _; {wrong[0]!r} does not")
        return robots

    @field_validator("actions")
    @classmethod
    def _known_names_and_a_way_to_stop(cls, actions: dict[str, Action]) -> dict[str, Action]:
        named: dict[str, Action] = {}
        for name, action in actions.items():
            sign = find_sign(name, BUILT_IN) or name.strip()
            if not sign or sign in named:
                raise ValueError(f"should name each sign once; {name!r} does not")
            if sign in ALWAYS_STOP and action != "stop":
                raise ValueError(f"should leave {sign} at 'stop', so that the robot can always be stopped")
            named[sign] = action
        return named


class CollisionMonitorConfig(Section):
    """Slows and stops the robot before obstacles that a laser scanner sees in its path."""

    live = frozenset(
        {
            "enabled",
            "source_timeout",
            "margin",
            "deceleration",
            "angular_deceleration",
            "reaction_time",
            "front",
            "back",
            "side",
            "scan_x",
            "scan_y",
            "scan_yaw",
        }
    )

    enabled: bool = Field(False, description="Whether to slow commands before obstacles; needs the topic `scan`")
    source_timeout: float = Field(
        0.45, gt=0, le=5, description="The robot is stopped after this long without a scan, or if the scan is older [s]"
    )
    margin: float = Field(
        0.15, ge=0, le=5, description="Distance to an obstacle in its path at which the robot stops [m]"
    )
    deceleration: float = Field(0.7, gt=0, le=20, description="Guaranteed linear deceleration of the robot [m/s²]")
    angular_deceleration: float = Field(
        1.5, gt=0, le=50, description="Guaranteed angular deceleration of the robot [rad/s²]"
    )
    reaction_time: float = Field(
        0.25, ge=0, le=5, description="Delay until a command takes effect, including the wait for the next scan [s]"
    )
    front: float = Field(0.26, gt=0, le=10, description="Extent of the robot ahead of its base frame [m]")
    back: float = Field(0.26, gt=0, le=10, description="Extent of the robot behind its base frame [m]")
    side: float = Field(0.245, gt=0, le=10, description="Extent of the robot to either side [m]")
    scan_x: float = Field(0.0, ge=-10, le=10, description="Position of the scanner ahead of the base frame [m]")
    scan_y: float = Field(0.0, ge=-10, le=10, description="Position of the scanner to the left of the base frame [m]")
    scan_yaw: float = Field(0.0, ge=-7, le=7, description="Rotation of the scanner to the left [rad]")


class RobotConfig(Section):
    """The robot: simulated in a world, or a real one with its topics."""

    kind: RobotKind = Field(
        "sim",
        description="sim is the simulated robot; ros2, dds, zenoh and ros1 drive a real one, auto uses ros2 if "
        "installed, else dds",
    )
    preset: Preset | None = Field(
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


class TeachConfig(Section):
    """Teaching of signs on the page."""

    dataset: Path = Field(Path("signs.npz"), description="File to add takes to, as with `handsteer signs collect`")
    model: Path = Field(
        Path("my-signs.npz"),
        description="File to write the learnt signs to, as with `handsteer signs train`; signs.model overrides it",
    )
    takes: int = Field(5, ge=2, le=50, description="Number of takes of a sign")
    take_time: float = Field(3.0, ge=0.2, le=60, description="Duration of each take [s]")
    countdown: float = Field(3.0, ge=0, le=60, description="Countdown before each take [s]")


class DashboardConfig(Section):
    """The web page."""

    host: str = Field(
        "127.0.0.1",
        min_length=1,
        description="Address that the page is served on; any other than 127.0.0.1 makes it reachable from other "
        "machines, which need the token in the printed address",
    )
    port: int = Field(8080, ge=0, le=65535, description="Port of the page; 0 picks a free one")
    certificate: Path | None = Field(
        None, description="PEM file with the certificate for https, without which browsers do not share a camera"
    )
    private_key: Path | None = Field(None, description="PEM file with its key, if not in the certificate's file")
    token: Literal["auto", "always"] = Field(
        "auto",
        description="When the page needs the token: auto if other machines can reach it, or always, for machines with "
        "several users",
    )
    open_browser: bool = Field(
        True,
        description="Whether run opens the page in a browser; never with token: always, as command lines are public",
    )

    @property
    def opens_browser(self) -> bool:
        """Whether to open the page in a browser; not with ``token: always``, because command lines are public."""
        return self.open_browser and self.token == "auto"


class Config(Section):
    """All parameters, by section."""

    camera: CameraConfig = CameraConfig()
    virtual_hand: VirtualHandConfig = VirtualHandConfig()
    landmarks: LandmarksConfig = LandmarksConfig()
    signs: SignsConfig = SignsConfig()
    control: ControlConfig = ControlConfig()
    collision_monitor: CollisionMonitorConfig = CollisionMonitorConfig()
    robot: RobotConfig = RobotConfig()
    teach: TeachConfig = TeachConfig()
    dashboard: DashboardConfig = DashboardConfig()

    @model_validator(mode="after")
    def _monitors_one_robot(self) -> "Config":
        if self.collision_monitor.enabled and self.control.robots:
            raise ValueError("collision_monitor.enabled should be false with control.robots: it is for one robot")
        return self


def load(path: Path | None = None, base: dict[str, Any] | None = None, *overrides: dict[str, Any]) -> Config:
    """Return the parameters from the defaults, ``base``, ``path`` and ``overrides``, each overriding the ones before.

    Args:
        path: A YAML file with some of the fields of :class:`Config`, or None; it overrides ``base``.
        base: Nested dictionary of fields, such as ``{"control": {"linear_step": 0.02}}``; overrides the defaults.
        overrides: Further dictionaries; they override the file.

    Raises:
        ConfigError: The file cannot be read, or a field is unknown or out of range; the message names it.
    """
    values: dict[str, Any] = {}
    for changes in (base or {}, _read_yaml(path) if path else {}, *overrides):
        values = _merge(values, _with_new_names(changes))
    return validate(Config, _merge(_preset(values), values), f" (also read: {path})" if path else "")


def cmd_vel_type(config: Config) -> CmdVelType:
    """Return the message type for both ends of ``cmd_vel``: if only one has it configured, it applies to the other too.

    Raises:
        ConfigError: They are configured differently.
    """
    control, robot = config.control.cmd_vel_type, config.robot.cmd_vel_type
    if "auto" not in {control, robot} and control != robot:
        raise ConfigError(
            f"control.cmd_vel_type is {control} and robot.cmd_vel_type {robot}: "
            "they should be the same, or the robot receives no command"
        )
    return robot if control == "auto" else control


def validate(section: type[S], values: Any, where: str = "") -> S:
    """Return ``section`` built from ``values``; ``where`` is added to the message of an error.

    Raises:
        ConfigError: A field is unknown, of a wrong type or out of range.
    """
    try:
        return section.model_validate(values)
    except ValidationError as error:
        raise ConfigError(describe(error) + where) from None


def describe(error: ValidationError) -> str:
    """Return the first problem of ``error`` in one line: the field, the value, what is allowed."""
    problem = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in problem["loc"]) or "configuration"
    if problem["type"] == "extra_forbidden":
        return f"{field}: there is no such parameter"
    reason = problem["msg"].removeprefix("Input ").removeprefix("Value error, ")
    given = repr(problem["input"])
    return f"{field}: {given if len(given) <= _LONGEST_SHOWN else given[:_LONGEST_SHOWN] + '...'} {reason}"


def _preset(values: dict[str, Any]) -> dict[str, Any]:
    """Return the preset of the robot that ``values`` name; it overrides only the defaults."""
    robot = values["robot"] if isinstance(values.get("robot"), dict) else {}
    name, kind = robot.get("preset"), robot.get("kind", "sim")
    if name is None and kind != "sim":
        name = "generic"
    return preset(name)


def _read_yaml(path: Path) -> dict[str, Any]:
    # Imported late: programs without a file, such as those that only recognise signs, load faster.
    from handsteer import plain_yaml  # noqa: PLC0415

    values = plain_yaml.read(path, str(path), ConfigError, f"cannot read the configuration {path}")
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected sections such as 'control:' at the top, found {type(values).__name__}")
    return values


def _with_new_names(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of ``values`` with new names only, so that an old name in a later source takes effect."""
    models = {name: field.annotation for name, field in Config.model_fields.items()}
    return {
        name: models[name].by_new_names(of) if name in models else of  # type: ignore[union-attr]
        for name, of in values.items()
    }


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        merged[key] = _merge(below, value) if isinstance(value, dict) and isinstance(below, dict) else value
    return merged
