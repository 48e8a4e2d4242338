"""Parameters of the configuration as options, such as ``--control.max-linear 0.5``.

They are taken out of a command line before its verb's own options are read, because a verb's help does without them:
the configuration takes longer to load than the rest of the command line.
"""

import re
from typing import TYPE_CHECKING, Any, get_args, get_origin

from handsteer.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    from handsteer.config import Section

_PARAMETER = re.compile(r"--([A-Za-z][\w-]*)\.([^=]+)(?:=(.*))?", re.DOTALL)
_CALLED = {"page": "dashboard"}
"""Sections by what people call what they are for."""

_NUMBER = re.compile(r"-[\d.].*")


def take_parameters(words: list[str]) -> tuple[list[str], dict[str, Any]]:
    """Return ``words`` without the options of parameters, and these parameters by section.

    A boolean one may have the value true or false; ``--robot.publish-clock`` alone is true, and
    ``--robot.no-publish-clock`` false. A list's option is repeated, and an entry of a table has a further part:
    ``--control.actions.Peace turbo``. What follows ``--`` is not read. The values are texts, which are not checked
    here.

    Raises:
        ConfigError: There is no such parameter, or its value is missing or given twice.
    """
    own: list[str] = []
    found: dict[str, Any] = {}
    rest = list(words)
    while rest:
        word = rest.pop(0)
        match = _PARAMETER.fullmatch(word)
        if word == "--":
            return [*own, word, *rest], found
        if match is None:
            own.append(word)
            continue
        section, name, value = match.groups()
        _take(section.replace("-", "_"), name, value, rest, found)
    return own, found


def with_section(option: str) -> str:
    """Return a hint to the parameters that an unknown ``option`` without a section, as ``--max-linear``, may mean."""
    from handsteer.config import Config
    from handsteer.parameters import section_model

    name = option.removeprefix("--").replace("-", "_")
    sections = [each for each in Config.model_fields if name in section_model(each).model_fields]
    full = [f"--{section}.{name}".replace("_", "-") for section in sections]
    return f". Did you mean {' or '.join(full)}?" if full else ""


def _take(section: str, given: str, value: str | None, rest: list[str], found: dict[str, Any]) -> None:
    """Add one parameter to ``found``; its value, if not in the same word, is taken from ``rest``."""
    model = _model(section, given)
    dashed, _, entry = given.partition(".")
    name = model.new_name(dashed.replace("-", "_"))
    positive = name.removeprefix("no_")
    is_flag = _is_bool(model, name) or (name != positive and _is_bool(model, positive))
    option = f"--{section.replace('_', '-')}.{given}"
    if not is_flag and name not in model.model_fields:
        raise ConfigError(f"there is no option {option}{_near(section, given, model)}")
    values = found.setdefault(section, {})
    if is_flag:
        if value is None and rest and rest[0].lower() in ("true", "false"):
            value = rest.pop(0)
        if value is not None and name != positive:
            raise ConfigError(f"{option} takes no value: it sets {positive} to false")
        _put(values, positive, name == positive if value is None else value, option)
        return
    if value is None:
        if not rest or rest[0].startswith("--") or (rest[0].startswith("-") and not _NUMBER.fullmatch(rest[0])):
            raise ConfigError(f"{option} needs a value")
        value = rest.pop(0)
    kind = get_origin(model.model_fields[name].annotation)
    if (kind is dict) != bool(entry):
        example = f"--{section}.{name}.Peace turbo" if kind is dict else f"--{section}.{name}"
        raise ConfigError(f"there is no option {option}: expected the form {example.replace('_', '-')}")
    if kind is tuple:
        values.setdefault(name, []).append(value)
    elif kind is dict:
        _put(values.setdefault(name, {}), entry, value, option)
    else:
        _put(values, name, value, option)


def _put(values: dict[str, Any], name: str, value: object, option: str) -> None:
    if name in values:
        raise ConfigError(f"{option} is given twice")
    values[name] = value


def _model(section: str, given: str) -> "type[Section]":
    from handsteer.config import Config
    from handsteer.parameters import section_model

    if section not in Config.model_fields:
        dashed = section.replace("_", "-")
        known = [
            f"--{each.replace('_', '-')}.{given}"
            for each in Config.model_fields
            if given.replace("-", "_").partition(".")[0] in section_model(each).model_fields
        ]
        if section in _CALLED and f"--{_CALLED[section]}.{given}" in known:
            raise ConfigError(f"there is no option --{dashed}.{given}: did you mean --{_CALLED[section]}.{given}?")
        raise ConfigError(f"there is no option --{dashed}.{given}{did_you_mean(f'--{dashed}.{given}', known)}")
    return section_model(section)


def _is_bool(model: "type[Section]", name: str) -> bool:
    field = model.model_fields.get(name)
    return field is not None and bool in (field.annotation, *get_args(field.annotation))


def _near(section: str, given: str, model: "type[Section]") -> str:
    near = did_you_mean(given.replace("-", "_"), model.model_fields).replace("_", "-")
    return (
        near.replace("mean ", f"mean --{section.replace('_', '-')}.") or f": handsteer parameters {section} lists all"
    )
