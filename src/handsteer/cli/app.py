"""The command line: its verbs, the options that they share, and how errors are reported.

Only what help needs is loaded here and at the top of each verb's file, so that help and shell completion are fast; a
verb names the modules it works with by :func:`loads`.
"""

import gc
import importlib
import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

from cyclopts import (
    App,
    CoercionError,
    CycloptsError,
    Parameter,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from handsteer import __version__
from handsteer.cli import signals
from handsteer.cli.options import take_parameters, with_section
from handsteer.cli.running import exit_code, fail, say, set_up_logging
from handsteer.errors import PluginError, did_you_mean, quoted

_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)


def _whole(_kind: object, tokens: Sequence[Any]) -> int:
    (token,) = tokens
    if not _WHOLE.fullmatch(token.value):
        raise CoercionError(token=token, target_type=int)
    return int(token.value)


Whole = Annotated[int, Parameter(converter=_whole)]
"""A whole number; cyclopts itself rounds any other."""
MaybeWhole = Annotated[int | None, Parameter(converter=_whole)]
Flag = Annotated[bool, Parameter(negative="", show_default=False)]
Parameters = Annotated[dict[str, Any] | None, Parameter(parse=False)]
"""Options with the full name of a parameter, such as --control.max-linear, by section."""
ConfigFile = Annotated[Path | None, Parameter(name="--config")]
Transport = Annotated[
    str,
    Parameter(
        help="ros2 (rclpy), dds or, experimentally, zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, "
        "else dds), or ros1."
    ),
]


@Parameter(name="*")
@dataclass(frozen=True)
class PageOptions:
    """Options of the verbs that serve the page.

    Parameters
    ----------
    host
        Address that the page is served on; 0.0.0.0 makes it reachable from other machines, with a token.
    port
        Port of the page; 0 picks a free one.
    token
        Require the token in the printed address from this machine too; for machines with several users.
    """

    host: str | None = None
    port: MaybeWhole = None
    token: Flag = False

    def parameters(self) -> dict[str, object]:
        """Return them as parameters of the section ``dashboard``; None is not given."""
        return {"host": self.host, "port": self.port, "token": "always" if self.token else None}


V = TypeVar("V", bound=Callable[..., int | None])

_EXAMPLES = """Examples:
  handsteer run                                  drive, and open the page
  handsteer run --headless --duration 30 --json  no page, one summary at the end
  handsteer recognize photo.jpg                  which sign is it?
  handsteer study examples/study.yaml            compare interfaces with people
  handsteer run --record drive.mcap              drive, and keep all of it
  handsteer replay drive.mcap                    the same frames again: the same commands?
  handsteer report drive.mcap                    what happened, as an HTML page
  handsteer signs evaluate photos/               how well are signs recognised?
  handsteer bench                                how well does one drive?
  handsteer camera --transport ros1              one node, in a ROS 1 graph
  handsteer camera --transport auto              one node, in a ROS 2 graph
  handsteer parameters control                   what can be set, each as an option
  handsteer doctor                               what works on this machine
"""

_NOT_A_NUMBER = re.compile(r"Invalid value for (\S+): unable to convert (.*) into (float|int)", re.DOTALL)

_GRAPH = "One node of a graph of several processes"
_NODES = ("camera", "recognition", "control", "robot", "steering")
_LOADS: dict[object, tuple[str, ...]] = {}
_OF_OTHERS: set[str] = set()

app = App(
    name="handsteer",
    help="Drive a mobile robot with your hand signs.",
    help_epilogue=_EXAMPLES,
    version=__version__,
    help_format="plaintext",
    result_action="return_value",
)
# Named, not imported: a verb's module is loaded when it is used.
for verb in ("run", "recognize", "parameters"):
    app.command(f"handsteer.cli.{verb}:{verb}", name=verb, help_epilogue="")
for verb in ("completion", "models", "ros"):
    app.command(f"handsteer.cli.installation:{verb}", name=verb, help_epilogue="")
for verb in (*_NODES, "robots"):
    app.command(f"handsteer.cli.nodes:{verb}", name=verb, group=_GRAPH, help_epilogue="")


@cache
def add_plugin_verbs() -> None:
    """Add the verbs of plug-ins to :data:`app`; they are loaded when they are used."""
    from handsteer import doors

    known = set(app)
    for verb in doors.VERBS.names():
        target = doors.VERBS.target(verb)
        # An app has an end of its own to its help; it is not loaded here, so its name tells.
        of_function = {} if target.endswith(":app") else {"help_epilogue": ""}
        if verb not in known:
            app.command(target, name=verb, **of_function)
            if not target.startswith("handsteer."):
                _OF_OTHERS.add(verb)


def load_verbs_of_others() -> None:
    """Load the verbs of plug-ins; those that cannot be loaded are left out of :data:`app`, with a line for each."""
    for verb in sorted(_OF_OTHERS):
        try:
            _load_verb(verb)
        except PluginError as error:
            say(" ".join(f"{error}; it is left out".split()))
            _OF_OTHERS.remove(verb)
            del app[verb]


def _load_verb(verb: str) -> None:
    """Load a verb of a plug-in.

    Raises:
        PluginError: It cannot be loaded or called.
    """
    # It looks for parameters of plug-ins, which may be in the module of a verb: that must not be half loaded then.
    importlib.import_module("handsteer.config")
    from handsteer import doors

    found = doors.VERBS.load(verb)
    if not callable(found):
        raise PluginError(f"{doors.VERBS.described(verb)} is of type {type(found).__name__}, not a function or an app")


def loads(*modules: str) -> Callable[[V], V]:
    """Declare the modules that a verb works with; they are imported before signals can interrupt an import."""

    def declared(verb: V) -> V:
        _LOADS[verb] = modules
        return verb

    return declared


def run(words: list[str]) -> int:
    """Run the verb that ``words`` name; return the exit code, as :func:`exit_code`."""
    set_up_logging()
    # To search what is installed takes a tenth of the time to load this.
    if not words or words[0] not in set(app) - set(app.help_flags):
        add_plugin_verbs()
    return exit_code(lambda: _run(words))


def _is_of_cyclopts(verb: Callable[..., object]) -> bool:
    """Return whether it prints the help or the version."""
    return verb.__module__.startswith("cyclopts")


def _run(words: list[str]) -> int:
    if not words or words[0] in app.help_flags:
        load_verbs_of_others()
    elif words[0] in _OF_OTHERS:
        _load_verb(words[0])
    _load_what_help_lists(app, words)
    own, parameters = take_parameters(_ros_words_last(words))
    try:
        verb, given, unparsed = app.parse_args(own, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        return fail(_problem(error))
    if "parameters" in unparsed:
        given.arguments["parameters"] = parameters
    elif parameters and not _is_of_cyclopts(verb):
        chain = " ".join(app.parse_commands(own)[0])
        return fail(f"{chain} takes no parameters of the configuration; see handsteer {chain} --help")
    if not _is_of_cyclopts(verb):  # help and version load little
        # First: it loads the parameters of plug-ins, whose modules may import any other, which must not be half loaded.
        importlib.import_module("handsteer.config")
    for module in _LOADS.get(verb, ()):
        importlib.import_module(module)
    gc.enable()
    # The verb is loaded; from here on, an interrupt must clean up what it started.
    signals.interrupt_on_signals()
    code = verb(*given.args, **given.kwargs)
    if not isinstance(code, int | None):
        raise PluginError(f"a verb should return an exit code or None, and {verb.__module__} returned {quoted(code)}")
    return code or 0


def _load_what_help_lists(group: App, arguments: list[str]) -> None:
    """Load the verbs of a group whose help will be printed, because it lists their descriptions."""
    if not arguments or arguments[0] in group.help_flags:
        for verb in group:
            group[verb]
    elif arguments[0] in set(group):
        _load_what_help_lists(group[arguments[0]], arguments[1:])


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


def _takes_parameters(verb: Callable[..., object] | None) -> bool:
    return verb is not None and "parameters" in inspect.signature(verb).parameters


def _problem(error: CycloptsError) -> str:
    chain = " ".join(("handsteer", *(error.command_chain or ())))
    if isinstance(error, UnknownCommandError) and error.app and error.unused_tokens:
        verbs = [name for name in error.app if not name.startswith("-")]
        near = did_you_mean(error.unused_tokens[0], verbs)
        return f'Unknown command "{error.unused_tokens[0]}"{near or ":"} the commands are {", ".join(verbs)}'
    text = str(error).rstrip(".")
    if isinstance(error, UnusedCliTokensError) and error.unused_tokens:
        further = len(error.unused_tokens) - 1
        text = f'unexpected argument "{error.unused_tokens[0]}"' + (f" and {further} more" if further else "")
    wrong = _NOT_A_NUMBER.fullmatch(text)
    if wrong:
        text = f"{wrong[1]}: {wrong[2]} should be {'a' if wrong[3] == 'float' else 'a whole'} number"
    if isinstance(error, UnknownOptionError) and "Did you mean" not in text and _takes_parameters(error.target):
        text += with_section((error.token.keyword or error.token.value).partition("=")[0])
    return f"{text}; see {chain} --help" if not text.endswith("?") else f"{text} See {chain} --help"
