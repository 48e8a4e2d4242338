"""The door of the virtual hand."""

from handsteer.cameras import Camera
from handsteer.clock import Clock
from handsteer.config import Config


def open_camera(config: Config, clock: Clock) -> Camera:
    """Return the virtual hand, with the script that drives where none is set.

    Raises:
        PoseError: The script is invalid.
    """
    from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
    from handsteer.plugins.virtual_hand.script import chosen_script

    engage = config.control.engage == "on" or (config.control.engage == "auto" and config.robot.kind != "sim")
    script = chosen_script(config.virtual_hand.script, joystick=config.control.mode == "joystick", engage=engage)
    hand = config.virtual_hand.model_copy(update={"script": script})
    size = config.camera
    return VirtualHandCamera(hand, width=size.width, height=size.height, fps=size.fps, clock=clock)
