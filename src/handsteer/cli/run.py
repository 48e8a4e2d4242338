"""``handsteer run``: drive the robot."""

import json as json_format
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Flag, MaybeWhole, PageOptions, Parameters, loads
from handsteer.cli.running import default_file
from handsteer.cli.running import settings as make_settings
from handsteer.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    from handsteer.config import Config


@Parameter(name="*")
@dataclass(frozen=True)
class CameraAndRobot:
    """What drives, and what is driven.

    Parameters
    ----------
    camera
        auto, virtual, browser (of the device that shows the page), a webcam's index or /dev/videoN, an address (rtsp,
        http), a video file or a folder of photos.
    robot
        sim, the simulated robot. For a real one that subscribes to cmd_vel: ros2 (rclpy), dds or zenoh (ROS 2 without
        a ROS installation), auto (ros2 if installed, else dds) or ros1. Or a preset of topics and limits, with auto:
        turtlebot3_burger, turtlebot3_waffle, turtlebot4 or turtlesim.
    world
        Name of a shipped world, or a YAML file.
    """

    camera: str | None = None
    robot: str | None = None
    world: str | None = None

    def parameters(self) -> dict[str, dict[str, str | None]]:
        """Return them as parameters by section; None is not given."""
        return {"camera": {"source": self.camera}, "robot": {**_robot(self.robot), "world": self.world}}


@Parameter(name="*")
@dataclass(frozen=True)
class Mode:
    """How long a run lasts, and whether it serves the page.

    Parameters
    ----------
    headless
        Run without the page.
    duration
        End after this many seconds.
    fast
        Run as fast as possible on simulated time, without the page; the same input gives the same commands.
    """

    headless: Flag = False
    duration: float | None = None
    fast: Flag = False

    @property
    def has_page(self) -> bool:
        """Whether it serves the page."""
        return not (self.headless or self.fast)

    def check(self, config: "Config") -> None:
        """Raise a ConfigError if ``config`` or the duration does not fit it."""
        if not self.has_page and config.camera.source == "browser":
            raise ConfigError("--camera browser needs the page, which --headless and --fast leave out")
        if self.fast and config.foxglove.port >= 0:
            raise ConfigError(
                "--foxglove shows a run in real time: leave out --fast, or record the run and open the file"
            )
        if self.duration is not None and not self.duration > 0:
            raise ConfigError(f"--duration: {self.duration:g} should be greater than 0 seconds")


@loads("handsteer.cli.drive", "tqdm")
def run(
    *ros_args: str,
    what: CameraAndRobot = CameraAndRobot(),
    page: PageOptions = PageOptions(),  # noqa: B008 - it is frozen
    mode: Mode = Mode(),
    record: Path | None = None,
    foxglove: MaybeWhole = None,
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Drive the robot with the signs that the camera sees.

    For example:
      handsteer run                                  drive, and open the page
      handsteer run --camera 0 --robot turtlebot4    a webcam drives a real robot
      handsteer run --control.mode joystick          the hand as a joystick
      handsteer run --headless --duration 30 --json  no page; a summary

    Parameters
    ----------
    ros_args
        ROS arguments, for a real robot. ROS 2: --ros-args -r cmd_vel:=/base/cmd_vel -r __ns:=/r1.
        ROS 1: cmd_vel:=/base/cmd_vel.
    record
        Record all topics to this MCAP file, which must not exist yet, for `handsteer replay` and `handsteer report`.
    foxglove
        Serve all topics to Foxglove and PlotJuggler on this port, such as 8765; 0 picks a free one. With
        --foxglove.drive true they may also drive.
    json
        Print a summary in JSON at the end, and nothing else.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
        Without it, handsteer.yaml of the working directory, if there is one; the page saves to it.
    """
    from handsteer.cli.drive import drive, linked, summary_text
    from handsteer.cli.installation import fetch_missing

    config_file = config_file or default_file()
    shorthand = {**what.parameters(), "dashboard": page.parameters(), "foxglove": {"port": foxglove}}
    base = {} if mode.has_page else {"camera": {"at_end": "end"}}

    def settle(service: dict[str, Any]) -> "Config":
        return make_settings(config_file, parameters, shorthand, base, service)

    mode.check(settle({}))
    fetch_missing(settle({}))
    with linked(settle, ros_args, fast=mode.fast) as (settings, link):
        summary = drive(
            settings, link, mode.duration, config_file, record=record, headless=not mode.has_page, fast=mode.fast
        )
    print(json_format.dumps(summary.as_dict()) if json else summary_text(summary))
    return 0


def _robot(name: str | None) -> dict[str, str | None]:
    """Return the parameters that ``--robot name`` stands for: the kind of the robot, or a preset."""
    from handsteer.config.driving import PRESETS, ROBOT_KINDS

    if name is None or name in ROBOT_KINDS:
        return {"kind": name}
    if name in PRESETS:
        return {"kind": "auto", "preset": name}
    known = (*ROBOT_KINDS, *PRESETS)
    raise ConfigError(f"--robot: there is no {name!r}{did_you_mean(name, known) or ':'} give {', '.join(known)}")
