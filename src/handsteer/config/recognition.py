"""Parameters of the camera and of recognition."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import ConfigDict, Field, model_validator

from handsteer.config.section import OptionalPath, Section, live
from handsteer.doors import CLASSIFIERS
from handsteer.timeouts import STALE_S
from handsteer.types import Handedness

Recorded = Literal["auto", "always", "never"]
if TYPE_CHECKING:
    ClassifierName = str
else:
    ClassifierName = Literal[tuple(dict.fromkeys(("shipped", *CLASSIFIERS.names())))]


class CameraConfig(Section):
    """Where frames come from."""

    # A webcam's number is a number in YAML and on ROS's parameter server.
    model_config = ConfigDict(coerce_numbers_to_str=True)

    source: str = Field(
        "auto",
        description="auto (a webcam, else the virtual hand for the simulated robot of `handsteer run`), virtual, "
        "browser (of the device that shows the page), a webcam's index or /dev/videoN, an address (rtsp, http), a "
        "video file or a folder of photos",
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
        "auto",
        description="Signs to show, with their durations in seconds, repeated; NONE lowers the hand; auto shows what "
        "the run needs to drive: all six signs or, as a joystick, a fist that moves, and first what engages; "
        "Peace, Three, Four, Horns, Call and OK are for teaching; Go@0.1,-0.05:2 is 0.1 m to the right and 0.05 m up",
    )
    handedness: Handedness = Field("Right", description="Left or right hand")
    skin: Literal["light", "medium", "dark"] = Field("medium", description="Skin tone")
    background: Literal["plain", "cluttered"] = Field("plain", description="Background of the picture")
    sleeve: bool = Field(True, description="Whether the forearm wears a sleeve")
    seed: int = Field(0, ge=0, description="Random seed of the background and of the hand's small movements")


class LandmarksConfig(Section):
    """Detection and tracking of hands in a frame."""

    renamed: ClassVar[Mapping[str, str]] = {"second_look": "refine_new_hands"}

    model: Literal["fast", "full", "lite"] = Field(
        "fast",
        description="full is MediaPipe's own; fast is full in 8-bit integers, takes half the time, differs by up "
        "to a quarter of a pixel, and finds more hands in grey or dark pictures; lite is as fast, but less accurate",
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
        description="Also search a smoothed and a widened frame, and its middle; finds more dark and close hands",
    )
    reject_resting: bool = Field(
        True,
        description="Ignore signs, other than Stop, of hands that hang or lie in the lap; finds the person for that",
    )
    min_presence: float = Field(0.5, ge=0, le=1, description="Minimum score to keep tracking a hand")
    threads: int = Field(1, ge=1, le=64, description="CPU threads of the landmark model")


class SignsConfig(Section):
    """Recognition of signs from the landmarks, and when a sign counts."""

    renamed: ClassVar[Mapping[str, str]] = {"bridge_time": "dropout_hold", "keep_confidence": "release_confidence"}

    model: OptionalPath = live(
        None,
        description="File of taught signs, written by `handsteer signs train`; none for the shipped signs only",
    )
    classifier: ClassifierName = Field(
        "shipped",
        description="What recognises the sign of a hand: shipped knows the six, others are plug-ins",
    )
    profile: OptionalPath = live(
        None,
        description="How the driver shows the six signs, written by `handsteer signs calibrate`: a name, or a file; "
        "none reads them as everybody shows them",
    )
    min_confidence: float = live(0.8, ge=0, le=1, description="Minimum confidence to recognise a sign")
    release_confidence: float = live(
        0.5, ge=0, le=1, description="Minimum confidence to keep the sign that already counts"
    )
    confirm_time: float = live(
        0.1, ge=0, le=2, description="How long a sign must be recognised before it counts; Stop counts at once [s]"
    )
    dropout_hold: float = live(0.1, ge=0, le=2, description="How long a sign still counts after its hand is lost [s]")
    switch_time: float = live(
        0.5,
        ge=0,
        le=10,
        description="How long the selected hand must show no sign before another hand with a sign is selected [s]",
    )
    max_frame_age: float = live(STALE_S, gt=0, le=10, description="Older frames are ignored [s]")
    swap_sides: bool = live(
        False,
        description="Swap left and right of each frame before recognition, for a camera that looks the way the driver "
        "looks, as from behind or on the head; a turn is then the one that the driver shows",
    )
    recorded: Recorded = Field(
        "auto",
        description="Whether to accept frames with old stamps, as in recordings, and recognise each: auto accepts "
        "those of rosbag play and ros2 bag play; always accepts all that are stamped more than 5 s ago, so use it "
        "for recordings only",
    )
    image_transport: Literal["auto", "raw", "compressed"] = Field(
        "auto",
        description="Images to subscribe to: raw is /image_raw, compressed is /image_raw/compressed; auto is "
        "compressed if nodes may be on other machines (DDS beyond localhost), or the one that is published",
    )


class JoystickConfig(Section):
    """The hand as a joystick: its position while the fist is closed, relative to where it was closed.

    The defaults are those with which ``handsteer bench`` drives best (``docs/driving.md``).
    """

    dead_zone: float = live(
        0.1,
        ge=0,
        le=1,
        description="Movements of the fist below this have no effect, in each direction [palm lengths]",
    )
    full_deflection: float = live(
        1.2, gt=0, le=5, description="Movement of the fist for full speed [palm lengths]; a palm is about 0.09 m long"
    )
    expo: float = live(
        0.4, ge=0, le=1, description="Share of the cube in the response: 0 is linear, more is finer near the middle"
    )
    tilt_dead_zone: float = live(
        6.0, ge=0, le=30, description="With control.rule point, tilts of the finger below this have no effect [deg]"
    )
    full_tilt: float = live(
        40.0, gt=0, le=50, description="With control.rule point, tilt of the finger for the full turn [deg]"
    )
    slow_at: float = live(
        0.75, gt=0, le=1, description="With control.rule point, height of the palm for the lowest speed, 0 is the top"
    )
    fast_at: float = live(
        0.4, ge=0, lt=1, description="With control.rule point, height of the palm for the highest speed, 0 is the top"
    )
    min_cutoff: float = live(
        12.0, gt=0, le=100, description="Cutoff frequency of the One-Euro filter for a hand at rest [Hz]"
    )
    beta: float = live(
        1.0, ge=0, le=100, description="Increase of that frequency with speed [Hz per palm length a second]"
    )

    @model_validator(mode="after")
    def _has_room_beyond_the_dead_zone(self) -> "JoystickConfig":
        if self.full_deflection <= self.dead_zone:
            raise ValueError(
                f"full_deflection should be above dead_zone, {self.dead_zone:g}; it is {self.full_deflection:g}"
            )
        if self.slow_at <= self.fast_at:
            raise ValueError(f"slow_at should be above fast_at, {self.fast_at:g}; it is {self.slow_at:g}")
        if self.full_tilt <= self.tilt_dead_zone:
            raise ValueError(
                f"full_tilt should be above tilt_dead_zone, {self.tilt_dead_zone:g}; it is {self.full_tilt:g}"
            )
        return self


class JoyConfig(Section):
    """How messages of a gamepad on /joy are read, as by ROS's teleop_twist_joy."""

    enable_button: int = Field(0, ge=0, le=63, description="Button that must be held to drive")
    axis_linear: int = Field(1, ge=0, le=63, description="Axis for forward and backward")
    axis_angular: int = Field(0, ge=0, le=63, description="Axis for turning; positive is left")
