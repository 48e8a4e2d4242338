"""Constructs each node of the graph from a configuration, on the standard topics unless others are given.

``topics`` of each function are those of the node's constructor, such as ``image`` or ``cmd_vel``. A ConfigError is
raised if control and robot are configured with different types of commands. The imports are in the functions, so that a
process with one node does not load what others need.
"""
# ruff: noqa: PLC0415

import logging
from typing import TYPE_CHECKING, Any

from handsteer import doors
from handsteer.clock import Clock, SimulatedClock, WallClock
from handsteer.config import Config, RobotConfig, cmd_vel_type
from handsteer.errors import ConfigError
from handsteer.messages import CMD_VEL, STEERING_CMD_VEL, TF, Topic, Twist, cmd_vel
from handsteer.transports.base import Session, Transport
from handsteer.types import NONE, find_sign

if TYPE_CHECKING:
    from handsteer.cameras import Camera
    from handsteer.cameras.choice import ChoiceOfCameras
    from handsteer.nodes.camera import CameraNode
    from handsteer.nodes.control import HandSignControlNode
    from handsteer.nodes.recognition import HandSignRecognitionNode
    from handsteer.nodes.robot import RobotNode
    from handsteer.nodes.steering import SteeringNode
    from handsteer.recognition.recognizer import Recognizer
    from handsteer.robots import Robot

log = logging.getLogger(__name__)


def make_camera(
    config: Config,
    transport: Transport,
    clock: Clock,
    camera: "Camera | None" = None,
    **topics: Topic[Any],
) -> "CameraNode":
    """Return the node ``my_camera``; without a ``camera``, it opens the one that ``config`` names.

    What robot its pictures drive is not known, so it may be a real one.

    Raises:
        CameraError: The camera, or its calibration, cannot be used.
    """
    from handsteer.cameras.choose import open_camera, read_calibration
    from handsteer.nodes.camera import CameraNode

    camera = camera or open_camera(config, clock, may_be_real=True)
    calibration = (
        None if config.camera.calibration is None else read_calibration(config.camera.calibration.expanduser())
    )
    frame_id = config.camera.frame_id
    if "frame_id" not in config.camera.model_fields_set:
        frame_id = frame_prefix(transport, "my_camera") + frame_id
    return CameraNode(transport, clock, camera, frame_id, calibration, **topics)


def open_cameras(
    config: Config, clock: Clock, own: "Camera | None" = None, *, may_be_real: bool = False
) -> "ChoiceOfCameras":
    """Return this machine's cameras and the browser's, one of which is selected at a time.

    ``own`` is selected first; without it, the camera that ``config`` names is opened, which is not the virtual hand
    without being named if the robot ``may_be_real``.

    Raises:
        CameraError: The machine's own camera cannot be used.
    """
    from handsteer.cameras.browser import BrowserCamera, NoCamera
    from handsteer.cameras.choice import BROWSER, OWN, ChoiceOfCameras
    from handsteer.cameras.choose import MachineCameras, open_camera

    has_own = own is not None or config.camera.source != "browser"
    own = own or (open_camera(config, clock, may_be_real=may_be_real) if has_own else NoCamera())
    machine = MachineCameras(config, clock, own)
    return ChoiceOfCameras(own, BrowserCamera(clock), machine, OWN if has_own else BROWSER)


def make_recognition(
    config: Config, transport: Transport, clock: Clock, recognizer: "Recognizer | None" = None, **topics: Topic[Any]
) -> "HandSignRecognitionNode":
    """Return the node ``hand_sign_recognition``; without a ``recognizer``, it opens the one that ``config`` names.

    Raises:
        ModelError: A landmark model or the sign model is missing or broken.
    """
    from handsteer.nodes.recognition import HandSignRecognitionNode
    from handsteer.recognition.recognizer import Recognizer

    recognizer = recognizer or Recognizer(config)
    _warn_of_unknown_signs(config, recognizer.signs)
    points = config.control.points
    return HandSignRecognitionNode(
        transport, clock, recognizer, config.signs, joystick=config.joystick, points=points, **topics
    )


def cmd_vel_topic(config: Config) -> Topic[Any]:
    """Return the topic of the commands from control to robot, with Twist or TwistStamped."""
    return cmd_vel(cmd_vel_type(config))


def make_control(
    config: Config,
    transport: Transport,
    clock: Clock,
    *,
    simulated: bool = False,
    others_keep_stop: bool = False,
    **topics: Topic[Any],
) -> "HandSignControlNode":
    """Return the node ``hand_sign_control``.

    ``simulated`` is whether the robot is known to be simulated; ``control.arming``, ``engage`` and ``renew`` are then
    off if they are ``auto`` or ``course``. ``others_keep_stop`` is whether other processes' nodes may remember a Stop.
    """
    from handsteer.nodes.control import HandSignControlNode

    topics = {"cmd_vel": cmd_vel_topic(config), **topics}
    of_course = _is_the_courses(topics["cmd_vel"], transport)
    choices = {"on": True, "off": False, "auto": not simulated, "course": not (simulated or of_course)}
    return HandSignControlNode(
        transport,
        clock,
        config.control,
        collision_monitor=config.collision_monitor,
        gamepad=config.joy,
        arming=choices[config.control.arming],
        engage=choices[config.control.engage],
        renew=choices[config.control.renew],
        others_keep_stop=others_keep_stop,
        **topics,
    )


def _is_the_courses(cmd_vel: Topic[Any], transport: Transport) -> bool:
    """Return whether commands go where the simulated robot of the ROS 101 course has them, in its namespace or none."""
    namespace = _namespace(transport, "hand_sign_control")
    return transport.topic_name(cmd_vel) in (CMD_VEL.name, f"/{namespace}{CMD_VEL.name}")


def make_robot(
    config: Config,
    transport: Transport,
    clock: Clock,
    link: Session | None = None,
    robot: "Robot | None" = None,
    **topics: Topic[Any],
) -> "RobotNode":
    """Return the node ``robot``; one that publishes ``/clock`` runs on real time, not on its own ``/clock``.

    Without a ``robot``, it opens the one that ``config`` names; arguments and errors are those of :func:`open_robot`.
    """
    from handsteer.nodes.robot import RobotNode

    if config.robot.publish_clock and isinstance(clock, SimulatedClock):
        clock = WallClock()
    topics = {"cmd_vel": cmd_vel_topic(config), **topics}
    robot = robot or open_robot(config, clock, link, topics["cmd_vel"])
    try:
        return RobotNode(transport, clock, robot, prefixed(config.robot, transport), **topics)
    except BaseException:
        robot.close()
        raise


def open_robot(config: Config, clock: Clock, link: Session | None = None, cmd_vel: Topic[Any] = CMD_VEL) -> "Robot":
    """Return the robot that ``config.robot.kind`` names: a plug-in, or one behind a topic of a transport.

    Args:
        config: Names and configures the robot.
        clock: The graph's clock.
        link: This process in the graph of a robot behind a topic.
        cmd_vel: Topic of that robot's commands, with Twist or TwistStamped.

    Raises:
        ConfigError: It is behind a topic, and there is no link to it.
        PluginError: It is a plug-in that cannot be loaded.
        WorldError: The world of a simulated robot cannot be used.
        PackageMissing: The simulator is not installed.
    """
    kind = config.robot.kind
    if kind in doors.ROBOTS.names():
        return doors.ROBOTS.open(kind, config, clock)
    if link is None:
        raise ConfigError(f"robot.kind is {kind}: only `handsteer run` drives a real robot; here it is sim")
    from handsteer.robots.remote import RemoteRobot

    return RemoteRobot(config.robot, cmd_vel, config.control.cmd_vel_frame_id, link)


def make_steering(
    config: Config,
    transport: Transport,
    clock: Clock,
    *,
    cmd_vel: Topic[Any] | None = None,
    steering: Topic[Twist] = STEERING_CMD_VEL,
) -> "SteeringNode":
    """Return the node ``steering``, whose methods are called to steer by hand, as the page does."""
    from handsteer.nodes.steering import SteeringNode

    return SteeringNode(transport, clock, config.control, cmd_vel or cmd_vel_topic(config), steering=steering)


def _warn_of_unknown_signs(config: Config, signs: tuple[str, ...]) -> None:
    for name in config.control.actions:
        if find_sign(name, (*signs, NONE)) is None:
            log.warning("control.actions: the sign %s is not known; the signs are %s", name, ", ".join(signs))


def frame_prefix(transport: Transport, node: str) -> str:
    """Return the prefix that distinguishes the coordinate frames of ``node`` from those of others, such as ``r1/``.

    It is empty without a namespace, and if ``/tf`` is remapped so that each robot has its own tree.
    """
    namespace = _namespace(transport, node)
    return f"{namespace}/" if namespace and transport.topic_name(TF) == TF.name else ""


def _namespace(transport: Transport, node: str) -> str:
    """Return the namespace of ``node``, such as ``r1``; empty without one."""
    return transport.full_name(node).partition(":")[0].rpartition("/")[0].strip("/")


def prefixed(config: RobotConfig, transport: Transport) -> RobotConfig:
    """Return ``config`` with the prefix of :func:`frame_prefix` added to its coordinate frames."""
    prefix = frame_prefix(transport, "robot") if config.frame_prefix == "auto" else config.frame_prefix
    frames = {name: getattr(config, name) for name in ("odom_frame_id", "base_frame_id", "scan_frame_id")}
    return config.model_copy(
        update={name: frame if frame.startswith(prefix) else prefix + frame for name, frame in frames.items()}
    )
