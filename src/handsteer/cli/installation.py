"""``handsteer models``, ``ros`` and ``completion``: the installation on this machine."""

import inspect
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from handsteer.cli.app import add_plugin_verbs, app, load_verbs_of_others, loads
from handsteer.cli.running import say
from handsteer.errors import ModelMissing

if TYPE_CHECKING:
    from handsteer.config import Config
    from handsteer.parameters import Description

_PACKAGE = Path(__file__).parents[1]


@loads("handsteer.recognition.landmark_models", "tqdm")
def models() -> int:
    """Fetch the landmark models, once, into the user's data directory.

    For example:
      handsteer models

    On a machine without network, set HANDSTEER_MODELS to a folder that contains them.
    """
    print(f"the landmark models are in {_fetch()}")
    return 0


def _fetch() -> Path:
    """Return the folder of the landmark models, after fetching those that are missing."""
    from tqdm import tqdm

    from handsteer.recognition.landmark_models import fetch_models

    bar: tqdm[Any] | None = None

    def progress(done: int, total: int) -> None:
        nonlocal bar
        if bar is None:
            say(f"downloading the landmark models, once: {total / 1e6:.0f} MB")
            bar = tqdm(total=total, unit="B", unit_scale=True, disable=not sys.stderr.isatty())
        bar.update(done - bar.n)

    try:
        return fetch_models(progress)[0].parent
    finally:
        if bar is not None:
            bar.close()


def fetch_missing(config: "Config") -> None:
    """Fetch the models if those that ``config`` needs are missing, unless HANDSTEER_MODELS names their folder.

    Raises:
        ModelError: They cannot be fetched or stored, or one is damaged.
    """
    from handsteer.recognition.landmark_models import are_elsewhere
    from handsteer.recognition.recognizer import model_files

    try:
        model_files(config)
    except ModelMissing:
        if are_elsewhere():
            raise
        _fetch()


def ros() -> int:
    """Print the folder of the ROS packages: the tutorial's for ROS 1, and handsteer_ros2.

    For example:
      . "$(handsteer ros)/setup.sh"  for roslaunch and ros2 launch
      ls "$(handsteer ros)"          see what is there
    """
    installed = _PACKAGE / "ros"
    print(installed if installed.is_dir() else _PACKAGE.parents[1] / "ros")  # the latter in a checkout
    return 0


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a script with which a shell completes verbs, options, parameters and their values.

    For example:
      handsteer completion bash > handsteer.bash  # then: . ./handsteer.bash
      handsteer completion zsh > ~/.zfunc/_handsteer
      handsteer completion fish > ~/.config/fish/completions/handsteer.fish

    Parameters
    ----------
    shell
        The shell; the script works without starting Python.
    """
    add_plugin_verbs()
    load_verbs_of_others()
    print(_listing(app, list(_parameters())).generate_completion(shell=shell))
    return 0


def _listing(group: App, parameters: list[inspect.Parameter]) -> App:
    """Return verbs like those of ``group`` whose options include all ``parameters``, if they accept these."""
    listing = App(name=group.name, help=group.help)
    for name in group:
        if name in (*group.help_flags, *group.version_flags):
            continue
        verb = group[name]
        if verb.default_command is None:
            listing.command(_listing(verb, parameters), name=name)
        else:
            listing.command(_with(verb.default_command, parameters), name=name)
    return listing


def _with(verb: Callable[..., Any], parameters: list[inspect.Parameter]) -> Callable[..., Any]:
    own = inspect.signature(verb)
    if "parameters" not in own.parameters:
        return verb

    def listed() -> None: ...

    kept = [each for name, each in own.parameters.items() if name != "parameters"]
    listed.__signature__ = own.replace(parameters=[*kept, *parameters])  # type: ignore[attr-defined]
    listed.__doc__ = verb.__doc__
    return listed


def _parameters() -> Iterator[inspect.Parameter]:
    from handsteer.config import Config
    from handsteer.parameters import describe, section_model

    for section in Config.model_fields:
        model = section_model(section)
        for name, field in model.model_fields.items():
            option = f"--{section}.{name}".replace("_", "-")
            how = Parameter(name=option, help=field.description, negative=option.replace(".", ".no-", 1))
            kind = _kind(describe(model, name))
            usage = Annotated[kind | None, how]  # type: ignore[valid-type]
            yield inspect.Parameter(f"{section}_{name}", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=usage)


def _kind(known: "Description") -> Any:
    """Return the type that lets a shell complete a parameter's values: choices, files, or none for a boolean."""
    if known.choices:
        return Literal[known.choices]
    if known.is_path:
        return Path
    return bool if known.kind == "bool" else str
