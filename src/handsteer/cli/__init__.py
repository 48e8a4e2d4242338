"""The command ``handsteer``: one file per verb; only this package prints and exits.

The entry point handles signals first, then loads the rest.
"""

import atexit
import gc
import os
import sys

from handsteer.cli import signals

# These run until they are interrupted, so exit code 0 also if that comes early: a launcher must not see a failure.
_UNTIL_INTERRUPTED = frozenset(
    ("run", "study", "record", "camera", "recognition", "control", "robot", "robots", "steering", "zenoh-router")
)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit code 0 for success, 2 for wrong input, 130 if interrupted.

    Verbs that run until they are interrupted end with 0.
    """
    words = sys.argv[1:] if arguments is None else arguments
    interrupted = 0 if words and words[0] in _UNTIL_INTERRUPTED else 130
    signals.exit_on_signals(interrupted)
    is_process = arguments is None
    if is_process:
        atexit.register(signals.ignore)  # what is registered first is called last
    try:
        code = _run(words)
        _has_ended(code, is_process=is_process)
    except KeyboardInterrupt:
        code = interrupted
        _has_ended(code, is_process=is_process)
    except Exception:
        # A library that is being imported may convert the interrupt to an error of its own.
        if not signals.were_raised():
            _has_ended(interrupted, is_process=is_process)
            raise
        code = interrupted
        _has_ended(code, is_process=is_process)
    sys.exit(code)


def _has_ended(code: int, *, is_process: bool) -> None:
    """Let no further signal change the exit code: there is nothing left to stop."""
    if is_process:
        signals.exit_on_signals(code)
    else:
        signals.interrupt_on_signals()


def _run(words: list[str]) -> int:
    # Imports leave no garbage, and searching for it takes a tenth of the start. What runs then enables it.
    gc.disable()
    # pydantic would search all installed packages for plugins.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    try:
        # The full command line takes 0.1 s more to load.
        if _has_only_ros1_arguments(words):
            # First: it loads the parameters of plug-ins, whose modules may import any other of ours.
            import handsteer.config  # noqa: F401
            from handsteer.cli.one_node import run_ros1

            return run_ros1(words[0], words[3:])
        from handsteer.cli.app import run

        return run(words)
    finally:
        gc.enable()


def _has_only_ros1_arguments(words: list[str]) -> bool:
    """Return whether ``words`` are a node and ROS 1 arguments only, as launch files start it."""
    is_node = words[1:3] == ["--transport", "ros1"] and words[0] in ("camera", "recognition", "control", "robot")
    return is_node and all(":=" in word and not word.startswith("-") for word in words[3:])
