"""``handsteer completion``: words for the shell to complete."""

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

if TYPE_CHECKING:
    from handsteer.parameters import Description


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
    from handsteer.cli.app import app

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
