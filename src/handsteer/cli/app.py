"""The command line: its verbs, the options that they share, and how errors are reported."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, CycloptsError, Parameter, ValidationError
from pydantic import ValidationError as PydanticError

from handsteer import __version__, config
from handsteer.cli import signals
from handsteer.cli.running import exit_code, fail, set_up_logging
from handsteer.parameters import section_model

Flag = Annotated[bool, Parameter(negative="")]
Parameters = Annotated[config.Config | None, Parameter(name="*", group="Every parameter (also in a --config file)")]
ConfigFile = Annotated[Path | None, Parameter(name="--config")]


_EXAMPLES = """Examples:
  handsteer run                                  drive, and open the page
  handsteer run --headless --duration 30 --json  no page, one summary at the end
  handsteer recognize photo.jpg                  which sign is it?
  handsteer study examples/study.yaml            compare interfaces with people
  handsteer run --record drive.mcap              drive, and keep all of it
  handsteer replay drive.mcap                    the same frames again: the same commands?
  handsteer report drive.mcap                    what happened, as an HTML page
  handsteer signs evaluate photos/               how well are signs recognised?
  handsteer bench --course slalom                how well does one drive?
  handsteer camera --transport ros1              one node, in a ROS 1 graph
  handsteer camera --transport auto              one node, in a ROS 2 graph
  handsteer doctor                               what works on this machine
"""

_NODES = ("camera", "recognition", "control", "robot", "steering")

app = App(
    name="handsteer",
    help="Drive a mobile robot with your hand signs.",
    help_epilogue=_EXAMPLES,
    version=__version__,
    help_format="plaintext",
    result_action="return_value",
)
# Named, not imported: a verb's module is loaded when it is used.
for verb in ("run", "recognize", "study"):
    app.command(f"handsteer.cli.{verb}:{verb}", name=verb)
for verb in ("models", "doctor", "ros"):
    app.command(f"handsteer.cli.installation:{verb}", name=verb)
for verb in ("record", "replay", "report"):
    app.command(f"handsteer.cli.recordings:{verb}", name=verb)
app.command("handsteer.cli.signs:app", name="signs")
app.command("handsteer.cli.bench:bench", name="bench")
for verb in _NODES:
    app.command(f"handsteer.cli.nodes:{verb}", name=verb, group="One node of a graph of several processes")
app.command("handsteer.cli.nodes:zenoh_router", name="zenoh-router", group="One node of a graph of several processes")
app.command("handsteer.cli.nodes:robots", name="robots", group="One node of a graph of several processes")


def run(words: list[str]) -> int:
    """Run the verb that ``words`` name; return the exit code: 0 for success, 2 for wrong input."""
    set_up_logging()
    words = [_by_new_name(word) for word in _ros_words_last(words)]
    _load_what_help_lists(app, words)
    return exit_code(lambda: _run(words))


def _run(words: list[str]) -> int:
    try:
        verb, given, _ = app.parse_args(words, exit_on_error=False, print_error=False)
        if words and words[0] in _NODES:
            from handsteer.cli.one_node import load  # noqa: PLC0415 - no other verb needs it

            load(words[0])
        # The verb is loaded; from here on, an interrupt must clean up what it started.
        signals.interrupt_on_signals()
        return int(verb(*given.args, **given.kwargs) or 0)
    except CycloptsError as error:
        return fail(_problem(error))


def _load_what_help_lists(group: App, arguments: list[str]) -> None:
    """Load the verbs of a group whose help will be printed, because it lists their descriptions."""
    if not arguments or arguments[0] in group.help_flags:
        for verb in group:
            group[verb]
    elif arguments[0] in set(group):
        _load_what_help_lists(group[arguments[0]], arguments[1:])


def _by_new_name(word: str) -> str:
    """Return an option that has an old name, such as ``--signs.bridge-time=0.2``, with its new name."""
    option, equals, value = word.partition("=")
    section, _, name = option.removeprefix("--").partition(".")
    if not word.startswith("--") or section not in config.Config.model_fields:
        return word
    new = section_model(section).new_name(name.replace("-", "_"))
    return word if new == name.replace("-", "_") else f"--{section}.{new.replace('_', '-')}{equals}{value}"


def _ros_words_last(arguments: list[str]) -> list[str]:
    """Return ``arguments`` with those between ``--ros-args`` and ``--`` moved to the end, after all options.

    ROS 2 allows them anywhere, and ``ros2 launch`` appends its own.
    """
    ours: list[str] = []
    ros: list[str] = []
    inside = False
    for argument in arguments:
        inside = inside or argument == "--ros-args"
        (ros if inside else ours).append(argument)
        inside = inside and argument != "--"
    return [*ours, *([] if "--" in ours else ["--"]), *ros] if ros else ours


def _problem(error: CycloptsError) -> str:
    if isinstance(error, ValidationError) and isinstance(error.__cause__, PydanticError):
        return config.describe(error.__cause__)
    return f"{str(error).rstrip('.')}; see handsteer --help"
