"""From a frame to the sign that counts, or why none does: what :class:`~handsteer.teleop.Teleop` and the node run.

::

    image ─▶ is it new? ─▶ recogniser ─▶ joystick, gesture ─▶ in time? ─▶ is the hand's part of it new? ─▶ Sight
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.freshness import Freshness
from handsteer.config import JoystickConfig
from handsteer.recognition.engage_gesture import EngageGesture
from handsteer.recognition.hand import check_picture
from handsteer.recognition.hand_joystick import HandJoystick
from handsteer.recognition.pointing import Pointing
from handsteer.recognition.recognizer import Recognition, Recognizer
from handsteer.types import RELEASED, Stick


@dataclass(frozen=True)
class Sight:
    """The result of one frame.

    Attributes:
        recognition: What is seen in it; None if the image is old, or its result came too late.
        refused: Why the frame does not count, in words; None if it counts.
        stick: The hand as a joystick.
        pointing: Where the hand points.
        engages: Whether the gesture that engages is completed.
    """

    recognition: Recognition | None = None
    refused: str | None = None
    stick: Stick = RELEASED
    pointing: Stick = RELEASED
    engages: bool = False


class FramePipeline:
    """Processes a stream of frames.

    Args:
        recognizer: Recognises the signs.
        config: Of the hand as a joystick, and of where it points; the defaults when None.
    """

    def __init__(self, recognizer: Recognizer, config: JoystickConfig | None = None) -> None:
        self.recognizer = recognizer
        self.joystick, self.pointing, self.gesture = HandJoystick(config), Pointing(config), EngageGesture()
        self._freshness = Freshness()
        self._unseen_s = 0.0

    @property
    def frozen_s(self) -> float:
        """How long old pictures have been received, in seconds; 0 after a new one."""
        return self._freshness.frozen_s

    def step(
        self,
        image: NDArray[np.uint8],
        dt_s: float,
        *,
        recorded: bool = False,
        as_joystick: bool = True,
        why_too_late: Callable[[], str | None] = lambda: None,
    ) -> Sight:
        """Process the next frame.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored.
            dt_s: Seconds since the last frame was captured, >= 0, those that were passed over included.
            recorded: Whether it is from a recording, which may start again.
            as_joystick: Whether sticks and gesture are wanted; otherwise they are reset.
            why_too_late: Called when the sign is known: why it must not count any more, in words; None if it may.

        Raises:
            FrameError: The image has another shape or type.
        """
        check_picture(image)
        # The time of skipped pictures counts: a sign is bridged from when it was last seen.
        self._unseen_s += dt_s
        refused = self._freshness.why_refused(image, dt_s, recorded=recorded)
        if refused is not None:
            return Sight(refused=refused)
        recognition = self.recognizer.step(image, self._unseen_s)
        if as_joystick:
            self.joystick.step(recognition, self._unseen_s)
            self.pointing.step(recognition, self._unseen_s)
            self.gesture.step(recognition, self._unseen_s)
        else:
            self.forget_gestures()
        self._unseen_s = 0.0
        refused = why_too_late()
        if refused is not None:
            self.forget()
            return Sight(refused=refused)
        if recognition.hand is not None:
            refused = self._freshness.why_hand_refused(recognition.hand.box_px, dt_s)
        engages = self.gesture.progress == 1.0
        return Sight(recognition, refused, self.joystick.stick, self.pointing.stick, engages=engages)

    def reconfigure(self, config: JoystickConfig) -> None:
        """Change the parameters of both sticks."""
        self.joystick.reconfigure(config)
        self.pointing.reconfigure(config)

    def draw(self, picture: NDArray[np.uint8], *, points: bool) -> None:
        """Draw the stick that drives into a mirrored ``picture``, (height, width, 3) uint8, BGR.

        That is where the hand points, if ``points``, else the hand as a joystick, if it is held.
        """
        (self.pointing if points else self.joystick).draw(picture)

    def pass_over(self, image: NDArray[np.uint8]) -> None:
        """Record a picture that is skipped: it is not new either when it comes again."""
        self._freshness.pass_over(image)

    def begin_again(self) -> None:
        """Forget everything: a recording begins, perhaps once more, so its pictures are new."""
        self._freshness = Freshness()
        self._unseen_s = 0.0
        self.forget()

    def forget(self) -> None:
        """Forget the hand, and what it showed: after a pause, and with another camera."""
        self.recognizer.reset()
        self.forget_gestures()

    def forget_gestures(self) -> None:
        """Release both sticks, and begin the gesture again."""
        self.joystick.reset()
        self.pointing.reset()
        self.gesture.reset()
