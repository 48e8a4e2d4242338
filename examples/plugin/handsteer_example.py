"""A robot that prints, a camera that draws, and a sign that blinks: ``pip install ./examples/plugin``."""

import math

import numpy as np
from pydantic import Field

from handsteer.cameras import Frame
from handsteer.clock import Clock
from handsteer.config import Config, Section
from handsteer.robots import RobotState
from handsteer.types import ZERO, Pose2D, Velocity


class PrinterConfig(Section):
    """The robot that prints."""

    period: float = Field(1.0, gt=0, le=60, description="Time between two lines [s]")


class PrintingRobot:  # --robot printer --printer.period 2
    description = "<robot name='printer'/>"

    def __init__(self, config: Config, _clock: Clock) -> None:
        self._timeout_s, self._period_s = config.robot.cmd_vel_timeout, config.section(PrinterConfig).period
        self._wanted, self._silent_s, self._time_s, self._pose = ZERO, 0.0, 0.0, Pose2D(0, 0, 0)
        self.obstacles, self.commanders, self.scan, self.close = list, list, lambda: None, lambda: None

    def command(self, linear_mps: float, angular_radps: float) -> None:
        self._wanted, self._silent_s = Velocity(linear_mps, angular_radps), 0.0

    def step(self, dt_s: float) -> RobotState:
        self._silent_s += dt_s
        now = self._wanted if self._silent_s < self._timeout_s and self._wanted.is_finite else ZERO
        if (self._time_s + dt_s) // self._period_s > self._time_s // self._period_s:
            print(f"printer: {now.linear_mps:.2f} m/s, {now.angular_radps:.2f} rad/s", flush=True)
        self._time_s += dt_s
        x, y, yaw = self._pose.x, self._pose.y, self._pose.yaw + now.angular_radps * dt_s
        self._pose = Pose2D(x + now.linear_mps * dt_s * math.cos(yaw), y + now.linear_mps * dt_s * math.sin(yaw), yaw)
        return RobotState(self._time_s, self._pose, now.linear_mps, now.angular_radps, self._pose)


class DrawingCamera:  # --camera drawing
    name, period_s = "drawing", 1 / 30

    def __init__(self, config: Config, clock: Clock) -> None:
        self._clock, self._size, self.close = clock, (config.camera.height, config.camera.width, 3), lambda: None

    def read(self) -> Frame:
        image = np.zeros(self._size, np.uint8)
        image[:, int(100 * self._clock.now()) % self._size[1]] = 255
        return Frame(image, self._clock.now())


class Blink:  # --control.actions.Go blink
    effect = "blinks; goes on as it does"

    def velocity(self, now: Velocity, _since_last_s: float) -> Velocity:
        print("blink", flush=True)
        return now
