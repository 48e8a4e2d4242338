"""The virtual hand as a camera: needs no webcam, and the content of each picture is known."""

from dataclasses import dataclass

from handsteer.cameras import VIRTUAL_HAND, Frame
from handsteer.cameras.files import SensorNoise
from handsteer.clock import Clock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.kinematics import Array, pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render, true_pixels
from handsteer.plugins.virtual_hand.script import Motion


@dataclass(frozen=True)
class Truth:
    """State of the virtual hand at one moment.

    Attributes:
        sign: The sign that is shown or approached.
        settled: Whether the hand has reached it.
        joints_px: (21, 2), positions of the joints in the picture, in pixels.
    """

    sign: str
    settled: bool
    joints_px: Array


class VirtualHandCamera:
    """A :class:`~handsteer.cameras.Camera` that draws a hand showing a script of signs.

    Args:
        config: Script and appearance.
        width: Pixels.
        height: Pixels.
        fps: Frames per second.
        clock: The script starts at its time of construction.

    Raises:
        PoseError: The script is invalid.
    """

    name = VIRTUAL_HAND

    def __init__(self, config: VirtualHandConfig, *, width: int, height: int, fps: float, clock: Clock) -> None:
        self.period_s = 1.0 / fps
        self._motion = Motion(config.script, config.handedness, config.seed)
        self._handedness = config.handedness
        self._look = Look(skin=config.skin, sleeve=config.sleeve)
        self._camera = Pinhole.webcam(width, height)
        self._background = make_background(config.background, width, height, config.seed)
        self._noise = SensorNoise(config.seed)
        self._clock = clock
        self._start_s = clock.now()

    def read(self) -> Frame:
        """Return the hand as it is now. Drawing takes the place of the exposure, so the capture time is its end."""
        pose = self._motion.at(self._clock.now() - self._start_s).pose
        skeleton, placement = pose_skeleton(pose.angles), pose.view.placement(self._handedness)
        image = render(skeleton, placement, self._camera, self._look, self._background)
        noisy = self._noise.on(image, self._clock.now())
        return Frame(noisy, self._clock.now())

    def truth(self, time_s: float) -> Truth:
        """Return the state of the hand at ``time_s`` of the clock."""
        moment = self._motion.at(time_s - self._start_s)
        skeleton, placement = pose_skeleton(moment.pose.angles), moment.pose.view.placement(self._handedness)
        return Truth(moment.sign, moment.settled, true_pixels(skeleton, placement, self._camera))

    def close(self) -> None:
        """Do nothing: no resource is held."""
