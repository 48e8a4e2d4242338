"""``handsteer signs calibrate``: a profile of how one person shows the six signs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Flag, Parameters, loads
from handsteer.cli.running import check_writable, settings
from handsteer.errors import ProfileError


@Parameter(name="*")
@dataclass(frozen=True)
class Timing:
    """How the signs are shown to a camera.

    Parameters
    ----------
    hands
        Hands that will drive: left, right, or both (left,right).
    seconds
        Time for each sign and hand, in seconds.
    countdown
        Countdown before each, in seconds.
    """

    hands: str = "left,right"
    seconds: float = 3.0
    countdown: float = 2.0

    def check(self) -> tuple[str, ...]:
        """Return the hands in order.

        Raises:
            ProfileError: A value is beyond its range.
        """
        hands = tuple(dict.fromkeys(word.strip().casefold() for word in self.hands.split(",")))
        if not set(hands) <= {"left", "right"}:
            raise ProfileError(f"--hands: {self.hands!r} should be left, right, or left,right")
        if not 0.2 <= self.seconds <= 30:
            raise ProfileError(f"--seconds: {self.seconds:g} should be from 0.2 to 30")
        if not 0 <= self.countdown <= 30:
            raise ProfileError(f"--countdown: {self.countdown:g} should be from 0 to 30 seconds")
        return hands


@loads("handsteer.plugins.teach.verbs.calibrating")
def calibrate(
    *,
    name: str = "me",
    out: Path | None = None,
    camera: str | None = None,
    from_: Annotated[Path | None, Parameter(name="--from")] = None,
    timing: Timing = Timing(),
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Adapt the six signs to one person: show each as you will when driving.

    For example:
      handsteer signs calibrate --name anna
      handsteer run --signs.profile anna
      handsteer signs calibrate --name anna --from photos/

    It asks for each sign with each hand, prints what it reads before and after,
    and how to hold a sign that it cannot adapt. Move the hand a little meanwhile:
    nearer, farther, tilted. The result is a profile, a small file without
    pictures, and its limits bound which hands of others it can let move the robot.

    Parameters
    ----------
    name
        Name of the profile.
    out
        File to write it to; by default NAME in the folder of the profiles, from which --signs.profile NAME takes it.
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address, a video file or a folder of photos.
    from_
        Labelled photos (an index.csv, or a subfolder for each sign), or a dataset (.npz) of `signs collect`, instead of
        a camera.
    json
        Print one JSON object.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
    """
    from handsteer.plugins.teach.verbs.calibrating import Plan, make_profile
    from handsteer.recognition.profile import load_profile, profile_name, profile_path

    timing.check()
    if from_ is not None and camera is not None:
        raise ProfileError("give either --from or --camera")
    path = out or profile_path(Path(profile_name(name)))
    if out is None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ProfileError(f"cannot make the folder of profiles {path.parent}: {error.strerror}") from None
    check_writable("--out" if out else "--name", path, ProfileError, load_profile)
    config = settings(config_file, parameters, {"camera": {"source": camera}})
    make_profile(config, Plan(profile_name(name), path, timing, from_), json=json)
    return 0
