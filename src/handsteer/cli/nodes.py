"""``handsteer camera``, ``recognition``, ``control``, ``robot``, ``steering``: one node of a graph, as a process."""

import logging
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handsteer import graph
from handsteer.cli import signals
from handsteer.cli.options import ConfigFile, Flag, Parameters, keep_what_is_loaded, say, settings, uninterrupted
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import needing
from handsteer.nodes.node import Node
from handsteer.nodes.steering import SteeringNode
from handsteer.parameters import NodeParameters, from_parameters
from handsteer.transports import join
from handsteer.transports.protocol import Session, Transport

_LOOK_PERIOD_S = 0.2

log = logging.getLogger(__name__)


def camera(
    *words: str,
    transport: str,
    camera: str | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Publish a camera's frames on image_raw.

    Example: handsteer camera --transport ros1 --camera /dev/video0 image_raw:=/front/image_raw

    Parameters
    ----------
    words
        In the transport's own words. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        What joins the nodes: ros2 (by rclpy), dds or zenoh (ROS 2 without ROS here), auto (ros2 where it is, else dds),
        or ros1.
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address (rtsp, http), a video file or a folder of photos.
    config_file
        YAML file with parameters; ROS parameters go before it, options before both.
    """
    job = _Job("my_camera", "camera", graph.make_camera, config_file, parameters, {"camera": {"source": camera}})
    return _run(job, transport, words)


def recognition(*words: str, transport: str, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Tell the sign of each frame of image_raw, and publish it on gesture/hand_sign.

    Example: handsteer recognition --transport ros1 image_raw:=/front/image_raw

    Parameters
    ----------
    words
        In the transport's own words. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        What joins the nodes: ros2 (by rclpy), dds or zenoh (ROS 2 without ROS here), auto (ros2 where it is, else dds),
        or ros1.
    config_file
        YAML file with parameters; ROS parameters go before it, options before both.
    """
    job = _Job("hand_sign_recognition", "signs", graph.make_recognition, config_file, parameters)
    return _run(job, transport, words)


def control(*words: str, transport: str, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Turn the signs of gesture/hand_sign into velocities on robot_diff_drive_controller/cmd_vel.

    Example: handsteer control --transport ros1 robot_diff_drive_controller/cmd_vel:=/cmd_vel _max_linear:=0.5

    Parameters
    ----------
    words
        In the transport's own words. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        What joins the nodes: ros2 (by rclpy), dds or zenoh (ROS 2 without ROS here), auto (ros2 where it is, else dds),
        or ros1.
    config_file
        YAML file with parameters; ROS parameters go before it, options before both.
    """
    job = _Job("hand_sign_control", "control", graph.make_control, config_file, parameters)
    return _run(job, transport, words)


def robot(
    *words: str,
    transport: str,
    world: str | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Simulate the robot that follows robot_diff_drive_controller/cmd_vel.

    Example: handsteer robot --transport ros1 --world obstacles

    Parameters
    ----------
    words
        In the transport's own words. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        What joins the nodes: ros2 (by rclpy), dds or zenoh (ROS 2 without ROS here), auto (ros2 where it is, else dds),
        or ros1.
    world
        Name of a shipped world, or a YAML file.
    config_file
        YAML file with parameters; ROS parameters go before it, options before both.
    """
    job = _Job("robot", "robot", graph.make_robot, config_file, parameters, {"robot": {"world": world}})
    return _run(job, transport, words)


def steering(
    *words: str,
    transport: str,
    host: str | None = None,
    port: int | None = None,
    token: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Serve the page: it shows what the graph does, and steers the robot on steering/cmd_vel.

    Example: handsteer steering --transport ros1 --port 8080

    Parameters
    ----------
    words
        In the transport's own words. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        What joins the nodes: ros2 (by rclpy), dds or zenoh (ROS 2 without ROS here), auto (ros2 where it is, else dds),
        or ros1.
    host
        Address of this machine that the page is served on; 0.0.0.0 lets other machines in, with a token.
    port
        Port of the page; 0 takes a free one.
    token
        Ask everybody for the token in the printed address, on this machine too: for machines that several people use.
    config_file
        YAML file with parameters; ROS parameters go before it, options before both.
    """
    shorthand = {"dashboard": {"host": host, "port": port, "token": "always" if token else None}}
    job = _Job("steering", "dashboard", graph.make_steering, config_file, parameters, shorthand, _served)
    return _run(job, transport, words)


def _alone(_node: Any, _config: Config) -> AbstractContextManager[None]:
    return nullcontext()


@contextmanager
def _served(node: SteeringNode, config: Config) -> Iterator[None]:
    # The page's libraries take a second to load, which the other nodes need not wait for.
    with needing("the page", "page", "nicegui"):
        from handsteer.dashboard.server import Dashboard  # noqa: PLC0415

    wires = (node.transport, node.clock, node)
    dashboard = Dashboard(*wires, config.dashboard, cmd_vel=graph.cmd_vel_topic(config), topics=True)
    url = dashboard.start()
    try:
        say(f"the page is at {url}")
        if config.dashboard.opens_browser:
            webbrowser.open(url)
        yield
    finally:
        dashboard.stop()


@dataclass(frozen=True)
class _Job:
    """What one verb runs.

    Attributes:
        node: Name of the node, unless it is renamed.
        section: Its own section of the configuration.
        make: Makes the node.
        file: YAML file with parameters.
        given: Options by full name.
        shorthand: Options by short name.
        beside: What runs beside the node.
    """

    node: str
    section: str
    make: Callable[[Config, Transport, Clock], Node]
    file: Path | None
    given: Config | None
    shorthand: dict[str, Any] | None = None
    beside: Callable[[Any, Config], AbstractContextManager[None]] = _alone

    def settings(self, service: dict[str, Any] | None = None) -> Config:
        return settings(self.file, self.given, self.shorthand, service=service)


def _run(job: _Job, transport: str, words: tuple[str, ...]) -> int:
    job.settings()  # what is wrong already is said before others see this node
    session: Session | None = None
    try:
        session = join(transport, job.node, words)
        config = job.settings(from_parameters(session.parameters, job.section, session.name))
        node = job.make(config, session.transport, session.clock)
        session.serve(NodeParameters(config, job.section, node.reconfigure, node.check))
        session.offer(node.services)
        _run_until_end(node, session, job.beside(node, config))
    except KeyboardInterrupt:
        pass  # the ordinary end of a node
    finally:
        if session is not None:
            with uninterrupted():
                session.close()
    return 0


def _run_until_end(node: Node, session: Session, beside: AbstractContextManager[None]) -> None:
    try:
        with beside:
            keep_what_is_loaded()
            node.start()
            log.info("%s is ready: %s", session.name, node.topics)
            while not (node.ended.is_set() or session.wait(_LOOK_PERIOD_S) or signals.were_raised()):
                pass
    finally:
        with uninterrupted():
            node.stop()
