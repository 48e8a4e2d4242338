"""Where the command line starts: signals end it in order from the first moment on, then all else is loaded."""

import gc
import os
import sys

from handsteer.cli import signals

# An interrupt is the ordinary end of these, also before they have begun: what starts them is not to call it a failure.
_UNTIL_INTERRUPTED = frozenset(
    ("run", "camera", "recognition", "control", "robot", "robots", "steering", "zenoh-router")
)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit code 0 when all went well, 2 when the input was wrong, 130 when it was interrupted.

    What runs until it is interrupted ends with 0 then.
    """
    words = sys.argv[1:] if arguments is None else arguments
    interrupted = 0 if words and words[0] in _UNTIL_INTERRUPTED else 130
    signals.end_at_once(interrupted)
    try:
        code = _run(words)
    except KeyboardInterrupt:
        code = interrupted
    except Exception:
        # What is loaded late in the start may turn the interrupt into an error of its own.
        if not signals.were_raised():
            raise
        code = interrupted
    finally:
        signals.end_in_order()
    sys.exit(code)


def _run(words: list[str]) -> int:
    # Both take some tenths of a second to load, the one with all our own options 0.1 s more.
    if _is_of_ros_alone(words):
        # Nothing of what is loaded is garbage, and looking for some takes a tenth of the start.
        gc.disable()
        # Nor is any plugin wanted for the parameters, for which all packages that are installed would be searched.
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
        try:
            from handsteer.cli.one_node import run_of_ros  # noqa: PLC0415

            return run_of_ros(words[0], words[3:])
        finally:
            gc.enable()
    from handsteer.cli.app import run  # noqa: PLC0415

    return run(words)


def _is_of_ros_alone(words: list[str]) -> bool:
    """Return whether there is nothing but a node and the words of ROS 1, as in what launch files start."""
    is_node = words[1:3] == ["--transport", "ros1"] and words[0] in ("camera", "recognition", "control", "robot")
    return is_node and all(":=" in word and not word.startswith("-") for word in words[3:])
