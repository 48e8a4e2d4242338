"""Handsteer without nodes, topics and threads: an image in, a velocity out. Start reading here.

::

    image ─▶ pipeline: is it new? which sign? ─▶ sign ─▶ control ─▶ velocity

:class:`Teleop` drives a robot in a program of your own. In a ROS graph the same parts run in nodes joined by topics
(:mod:`handsteer.graph`): the camera's node reads the images,
:class:`~handsteer.nodes.recognition.HandSignRecognitionNode` runs the same :class:`~handsteer.pipeline.FramePipeline`,
and :class:`~handsteer.nodes.control.HandSignControlNode` the same control.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handsteer.config import Config, checked
from handsteer.control import Control
from handsteer.control.explain import Reason, seconds_to_renew, warned
from handsteer.pipeline import FramePipeline, Sight
from handsteer.recognition.recognizer import Recognition, Recognizer
from handsteer.types import RELEASED, ZERO, Stick, Velocity


class Teleop:
    """Drives a robot by the hand signs in a stream of images.

    Nothing moves before the hand has engaged: it opens, closes and opens. That is required again after a pause or a
    frozen camera (:doc:`/safety`), and a sign that drives for 20 s has to be shown again. To disable this, for example
    for a simulated robot, set ``control.engage``, ``arming`` and ``renew`` to ``off``.

    Args:
        config: All parameters; the defaults when None.
        recognizer: Recognises the signs; constructed from ``config`` when None.

    Attributes:
        recognition: Result for the last image; None if it was not a new image.

    Raises:
        ConfigError: ``config`` is something else, such as a dictionary.
        ModelError: A landmark model or the sign model is missing or broken.
    """

    def __init__(self, config: Config | None = None, recognizer: Recognizer | None = None) -> None:
        config = checked(config)
        self.recognition: Recognition | None = None
        self._pipeline = FramePipeline(recognizer or Recognizer(config), config.joystick)
        self._max_frame_age_s = config.signs.max_frame_age
        self._refused: str | None = "no image has come"
        self._since_image_s = self._since_seen_s = 0.0
        self._config = config.control
        self._stick = RELEASED
        self._control = Control(
            config.control,
            arming=config.control.arming != "off",
            engage=config.control.engage != "off",
            renew=config.control.renew != "off",
        )
        self._velocity = ZERO

    def step(self, image: NDArray[np.uint8] | None, dt_s: float) -> Velocity:
        """Process the next image and return the velocity from now on.

        Call it for each image, and without one at least every 0.1 s while none arrives.

        Args:
            image: (height, width, 3) uint8, BGR, as the camera saw it, not mirrored; None if there is no new one.
            dt_s: Seconds since the last call, >= 0; any other value is a fault and stops the robot.

        Raises:
            FrameError: The image has another shape or type; the robot is stopped.
        """
        if not _is_duration(dt_s):
            self._refused = f"the time between two images is {dt_s} s"
            return self._fault(self._refused)
        self._command(self._control.step(dt_s))  # the sign timeout applies before the new image counts
        self._since_image_s += dt_s
        self._since_seen_s += dt_s
        sight = None if image is None else self._look_at(image)
        if sight is not None and sight.recognition is not None and sight.refused is None:
            self._command(self._control.step(0.0, sign=sight.recognition.sign, stick=self._stick))
            self._control.note_gesture(is_done=sight.engages)
        elif self._since_seen_s > self._max_frame_age_s:
            self._pipeline.forget()
            self._stick = RELEASED
            self.recognition = None
        return self._velocity

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``: the slower one that was commanded instead of what :meth:`step` returned.

        From zero, if it is not finite.
        """
        self._control.hold_back(velocity)

    def stop(self) -> None:
        """Stop until :meth:`reset`; signs are ignored."""
        self._command(self._control.stop())

    def reset(self) -> None:
        """End a Stop; nothing moves before neutral was seen."""
        self._control.reset()

    @property
    def stick(self) -> Stick:
        """By which the hand drives in the last image: as a joystick, or where it points; released if signs drive."""
        return self._stick

    @property
    def reason(self) -> str:
        """A sentence on what is commanded, and why the robot is stopped if it is."""
        return warned(str(self._reason()), seconds_to_renew(self._control.renew_left_s))

    def _reason(self) -> Reason:
        safety = self._control.safety
        if safety.is_stopped:
            return Reason("stopped")
        if self._refused is not None and self._velocity.is_zero:
            return Reason("no_image", self._refused)
        if not safety.engagement.engaged:
            return safety.engagement.reason
        if safety.signs_wait is not None and not safety.must_renew("signs"):
            return Reason("disarmed", safety.signs_wait or "reset")
        return self._control.reason

    def _look_at(self, image: NDArray[np.uint8]) -> Sight:
        since_image_s, self._since_image_s = self._since_image_s, 0.0
        try:
            sight = self._pipeline.step(image, since_image_s)
        except Exception:
            self._fault("an image could not be looked at")
            raise
        self._refused = sight.refused
        if sight.recognition is not None:
            self.recognition = sight.recognition
            self._since_seen_s = 0.0
            by_hand = sight.stick if self._config.mode == "joystick" else sight.pointing
            self._stick = by_hand if self._config.by_stick else RELEASED
        return sight

    def _fault(self, why: str) -> Velocity:
        self._control.safety.fault(why)
        self._command(self._control.halt())
        return self._velocity

    def _command(self, velocity: Velocity | None) -> None:
        if velocity is not None:
            self._velocity = velocity


def _is_duration(value: Any) -> bool:
    try:
        return math.isfinite(value) and value >= 0
    except (TypeError, OverflowError):
        return False
