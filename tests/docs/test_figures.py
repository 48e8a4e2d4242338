"""Limits, times and counts in sentences are those of the code, which the tests of the code bring about."""

import importlib
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from handsteer.cli.app import add_plugin_verbs, app
from handsteer.parameters import section_model
from tests.docs.pages import DOCS, ROOT, text_of

STATIC = "src/handsteer/plugins/page/static"

FIGURES = [
    (page, sentence, constants)
    for page, rows in tomllib.loads(Path(__file__).with_name("figures.toml").read_text()).items()
    for sentence, constants in rows.items()
]


def number(text: str) -> str:
    """Return the number of a constant as the pages write it."""
    name, _, factor = text.partition("*")
    value = constant(name) * float(factor or 1)
    shown = f"{value:.10g}"
    return f"{int(value):,}" if value >= 1000 and value.is_integer() else shown


def constant(name: str) -> float:
    """Return the constant ``module:NAME``, also of a script of the page, or the default of a parameter."""
    if " --" in name:
        return of_command(*name.rsplit(" ", 1))
    module, _, path = name.partition(":")
    if module.endswith(".js"):
        return of_script(module, path)
    if not path:
        section, _, field = module.partition(".")
        return float(section_model(section).model_fields[field].default)
    for package in ("handsteer.plugins", "handsteer"):
        try:
            value: Any = importlib.import_module(f"{package}.{module}")
        except ModuleNotFoundError as missing:
            if missing.name == "rosgraph":
                pytest.skip("ROS 1 is not installed: make ros1")
            if not f"{package}.{module}".startswith(missing.name or "?"):
                raise
            continue
        for part in path.split("."):
            value = value[part.replace("_", " ")] if isinstance(value, dict) else getattr(value, part)
        return float(value)
    raise AssertionError(name)


def of_command(verb: str, option: str) -> float:
    """Return the default of an option of a command."""
    add_plugin_verbs()
    group, _, name = verb.partition(" ")
    for argument in app[group][name].assemble_argument_collection():
        if option in argument.names:
            return float(argument.field_info.default)
    raise AssertionError(option)


def of_script(file: str, path: str) -> float:
    """Return a constant of a script, or a field of one that is an object."""
    name, _, field = path.partition(".")
    text = (ROOT / STATIC / file).read_text()
    inside = rf"{{[^}}]*\b{field}: " if field else ""
    found = re.search(rf"\b{name} = {inside}([\d.]+)", text)
    assert found, path
    return float(found[1])


@pytest.mark.parametrize(("page", "sentence", "constants"), FIGURES, ids=lambda each: each[:40])
def test_a_figure_is_the_code_s(page: str, sentence: str, constants: str) -> None:
    """A figure in words, as "twice", is given in the table with ``=``: the constant has to have that value."""
    shown = []
    for each in constants.split(" | ") if " --" in constants else constants.split():
        name, _, value = each.partition("=")
        if value:
            assert constant(name) == float(value)
        else:
            shown.append(number(name))
    wanted = sentence.format(*shown)
    path = ROOT / "README.md" if page == "README" else DOCS / f"{page}.md"
    if wanted not in " ".join(text_of(path).split()):
        pytest.fail(f"{path.name} does not say: {wanted}")
