"""What the pages name exists: commands with their options, parameters with values and defaults, programs, files."""

import re
import shlex
from functools import cache
from typing import Any

import pytest
from cyclopts import App, MissingArgumentError

from handsteer.cli.app import _ros_words_last, add_plugin_verbs, app
from handsteer.cli.options import take_parameters
from handsteer.config import Config, load
from handsteer.parameters import section_model
from tests.docs.pages import DOCS, ROOT, Part, blocks, code, commands, prose

PLACE = re.compile(r"…|NAME|<verb>")
"""Where the reader of a command puts a word."""

OF_A_PLUG_IN = "--printer.period"
OF_ROS = {"--", "--ros-args", "--params-file", "--log-level", "--disable-rosout-logs", "--wait-for-subscribers"}
OF_ROS |= {"--rate-control-topic", "--rate-control-max-delay"}
OF_CONTAINERS = {"--network", "--device"}

FOLDERS = ("", "src", "src/handsteer", "src/handsteer/recognition", "src/handsteer/plugins/teach/synthetic", "ros")
"""Where a page means a file to be."""

MADE_BY_READERS = re.compile(r"(?:anna/\d+|negatives/.*)\.jpg|\.venv/ros2")


def taken(command: str) -> tuple[list[str], dict[str, Any]]:
    """Return the words of a command that are not parameters, and the parameters by section."""
    words = shlex.split(PLACE.sub("1", command), comments=True)
    if OF_A_PLUG_IN in words:
        del words[words.index(OF_A_PLUG_IN) : words.index(OF_A_PLUG_IN) + 2]
        words = [word.replace("blink", "go") for word in words]
    return take_parameters(_ros_words_last(words))


@cache
def options() -> set[str]:
    """Return the options of all verbs, without those that are parameters."""
    add_plugin_verbs()

    def of(group: App) -> set[str]:
        verbs = [group[name] for name in group if not name.startswith("-")]
        if verbs:
            return set().union(*map(of, verbs))
        return {name for argument in group.assemble_argument_collection() for name in argument.names}

    return of(app)


def by_text(parts: list[Part]) -> dict[str, str]:
    """Return the pages of each text."""
    return {part.text: str(part) for part in reversed(parts)}


@pytest.mark.parametrize("command", sorted(by_text(commands())))
def test_a_command_can_be_read_with_its_values(command: str) -> None:
    add_plugin_verbs()
    own, parameters = taken(re.split(" > | >$", command)[0].removeprefix("handsteer "))
    if own[0] in ("1", "--help") or "--help" in own:
        return
    load(None, {name: values for name, values in parameters.items() if "1" not in values.values()})
    try:
        app.parse_args(own, exit_on_error=False, print_error=False)
    except MissingArgumentError:
        assert len(own) <= 3, "only where a sentence names a verb may its words be missing"


def test_an_option_exists() -> None:
    wrong = []
    for text, where in by_text(code()).items():
        if not text.startswith("--") or PLACE.search(text.partition(" ")[0]):
            continue
        alone = re.fullmatch(r"--([\w-]+)\.([\w-]+)", text)
        if alone and alone[2].replace("-", "_") in section_model(alone[1].replace("-", "_")).model_fields:
            continue
        own, parameters = taken(text)
        load(None, parameters)
        wrong += [
            f"{where}: {word}"
            for word in own
            if word.startswith("--") and word not in options() | OF_ROS | OF_CONTAINERS
        ]
    assert wrong == []


def parameter(text: str) -> tuple[str, str] | None:
    """Return section and field that ``text`` names, if its first part is a section."""
    section, _, field = text.partition(".")
    is_parameter = section in Config.model_fields and re.fullmatch(r"(?!npz$)[a-z_]+", field)
    return (section, field) if is_parameter else None


def test_a_parameter_exists_and_takes_the_value() -> None:
    wrong, found = [], 0
    for text, where in by_text(code()).items():
        named = parameter(text.partition(": ")[0])
        if named is None:
            continue
        found += 1
        if named[1] not in section_model(named[0]).model_fields:
            wrong.append(f"{where}: {text}")
        elif ": " in text:
            load(None, {named[0]: {named[1]: text.partition(": ")[2]}})
    assert wrong == []
    assert found > 60


DEFAULTS = (
    r"(?P<value>\d[\d.]*)(?: s| degrees| m)?(?: ago| of [\w' ]+)? \(`(?P<name>[a-z_.]+)`\)",
    r"`(?P<name>[a-z_.]+)`(?: \(|, )(?P<value>\d[\d.]*)(?: s\b| m\b|\)|,)",
    r"`(?P<name>[a-z_.]+)`, by default `(?P<value>[^`]+)`",
)


def test_a_default_is_the_configuration_s() -> None:
    """Where a number stands with the name of a parameter, as in "0.35 s (`signs.max_frame_age`)"."""
    wrong, found = [], 0
    for page in DOCS.glob("*.md"):
        for match in (each for form in DEFAULTS for each in re.finditer(form, " ".join(prose(page).split()))):
            section, _, field = match["name"].rpartition(".")
            sections = [section] if section else [*Config.model_fields]
            models = [section_model(each) for each in sections if each in Config.model_fields]
            defaults = {str(model.model_fields[field].default) for model in models if field in model.model_fields}
            if not defaults:
                continue
            found += 1
            values = {match["value"].rstrip("."), f"{match['value'].rstrip('.')}.0"}
            if not values & defaults:
                wrong.append(f"{page.name}: {match[0]}: {defaults}")
    assert wrong == []
    assert found >= 24


def test_a_target_of_make_exists() -> None:
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    texts = [part.text for part in (*code(), *blocks("sh"))]
    named = {target for text in texts for target in re.findall(r"^make ((?!\w+=)[\w-]+)", text, re.MULTILINE)}
    assert len(named) > 15
    assert named <= targets


def test_a_program_exists_with_its_options() -> None:
    wrong, found = [], 0
    for text, where in by_text(code()).items():
        program = re.match(r"(?:\w+=1 )?(?:python|pytest) (?:-m )?([\w/.]+)(.*)", text)
        if program is None:
            continue
        found += 1
        name = program[1] if "/" in program[1] else program[1].replace(".", "/") + ".py"
        file = next((each for each in (ROOT / name, ROOT / "src" / name) if each.is_file()), None)
        if file is None:
            wrong.append(f"{where}: {text}")
            continue
        needed = re.findall(r" (--[\w-]+)", program[2])
        source = file.read_text()
        wrong += [f"{where}: {text}: {option}" for option in needed if option not in source]
    assert wrong == []
    assert found > 20


def test_a_file_of_the_repository_exists() -> None:
    wrong, found = [], 0
    for text, where in by_text(code()).items():
        if not re.fullmatch(r"[\w.-]+(?:/[\w.-]+)+/?", text) or MADE_BY_READERS.fullmatch(text):
            continue
        begins = text.split("/")[0]
        known = {child.name for folder in FOLDERS for child in (ROOT / folder).iterdir()} - {"control"}
        if begins not in known:
            continue
        found += 1
        path = re.sub(r"\.[A-Z]\w+$", "", text)  # of a class in it
        places = [ROOT / folder / f"{path}{suffix}" for folder in FOLDERS for suffix in ("", ".py")]
        if not any(place.exists() for place in places):
            wrong.append(f"{where}: {text}")
    assert wrong == []
    assert found > 50


def test_a_lock_exists_in_the_class_that_has_it() -> None:
    sources = [path.read_text() for path in (ROOT / "src").rglob("*.py")]
    wrong = []
    for text, where in by_text(code(DOCS / "architecture.md")).items():
        named = re.fullmatch(r"(_?[A-Z]\w+)\.(\w+)", text)
        if named and not any(
            re.search(rf"^class {named[1]}\b", each, re.MULTILINE) and re.search(rf"\b{named[2]}\b", each)
            for each in sources
        ):
            wrong.append(f"{where}: {text}")
    assert wrong == []
