"""Node arguments of ``ros2 run`` and ``ros2 launch``: ``--ros-args -r a:=b -p name:=value``.

Source of the rules: design.ros2.org/articles/ros_command_line_arguments.html; in parameter files, ``/*`` matches one
part of a name and ``/**`` any number of them.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handsteer import plain_yaml
from handsteer.errors import TransportError
from handsteer.plugins.ros2.names import Remap

_RULE = re.compile(r"(?:(?P<node>[A-Za-z_]\w*):(?!//))?(?P<name>[^:]+|rostopic://[^:]+|rosservice://[^:]+)")
_PARAMETER = re.compile(r"(?:(?P<node>/?[A-Za-z_][\w/]*):)?(?P<name>[A-Za-z_][\w.]*)")
_ROSOUT = {"--enable-rosout-logs": True, "--disable-rosout-logs": False}
_WITHOUT_VALUE = frozenset(
    f"--{switch}-{what}" for switch in ("enable", "disable") for what in ("stdout-logs", "external-lib-logs")
)
_VALUES = {
    "-r": "a rule as image_raw:=camera/image, __node:=name or __ns:=/r1",
    "-p": "a parameter as linear_step:=0.02",
    "--params-file": "a YAML file",
    "--log-level": "a level as info",
    "-e": "an enclave",
    "--log-config-file": "a file",
}
_LONGEST_SHOWN = 100
_LONG = {"--remap": "-r", "--param": "-p", "--enclave": "-e"}
_LEVELS = ("debug", "info", "warn", "error", "fatal")


@dataclass(frozen=True)
class ParameterRule:
    """Parameters for the nodes whose name matches.

    Attributes:
        pattern: Full name of a node, in which ``/*`` and ``/**`` are wildcards.
        values: Parameters by name; those of sections have dots, such as ``virtual_hand.script``.
    """

    pattern: str
    values: Mapping[str, Any]

    def fits(self, node: str) -> bool:
        """Return whether the full name ``node`` matches."""
        parts = re.split(r"(/\*\*|/\*)", self.pattern)
        wildcards = {"/**": r"(/\w+)*", "/*": r"/\w+"}
        return re.fullmatch("".join(wildcards.get(part) or re.escape(part) for part in parts), node) is not None


@dataclass
class Arguments:
    """Parsed arguments.

    Attributes:
        remaps: Rules for names, in order.
        rules: Parameters, in order; later ones win.
        log_level: Log level: debug, info, warn, error or fatal; None if not given.
        rosout: Whether to publish the log on ``/rosout``.
    """

    remaps: list[Remap] = field(default_factory=list)
    rules: list[ParameterRule] = field(default_factory=list)
    log_level: str | None = None
    rosout: bool = True

    def parameters(self, node: str) -> dict[str, Any]:
        """Return the parameters of the node of this full name, nested at dots."""
        flat: dict[str, Any] = {}
        for rule in self.rules:
            if rule.fits(node):
                flat.update(rule.values)
        return nested(flat)


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters by name, such as ``virtual_hand.script``, as nested tables.

    Raises:
        TransportError: A name is both a value and a table.
    """
    found: dict[str, Any] = {}
    for name, value in flat.items():
        *sections, last = name.split(".")
        place = found
        for section in sections:
            inner = place.setdefault(section, {})
            if not isinstance(inner, dict):
                raise TransportError(f"parameter {name}: {section} is a value already, it cannot have parts too")
            place = inner
        place[last] = value
    return found


def parse_arguments(words: Sequence[str]) -> Arguments:
    """Parse ``words``; each ``--ros-args`` begins a list of arguments, ``--`` or the end closes it.

    Raises:
        TransportError: A word is not one of ROS 2's, or a parameter file cannot be read.
    """
    found = Arguments()
    for flag, value in _pairs(words):
        if flag == "-r":
            found.remaps.extend(_remap(value))
        elif flag == "-p":
            found.rules.append(_parameter(value))
        elif flag == "--params-file":
            found.rules.extend(_parameter_file(Path(value).expanduser()))
        elif flag == "--log-level":
            found.log_level = _log_level(value) or found.log_level
        elif flag in _ROSOUT:
            found.rosout = _ROSOUT[flag]
    return found


def _pairs(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    inside = False
    rest = iter(words)
    for word in rest:
        flag = _LONG.get(word, word)
        if not inside and word != "--ros-args":
            raise TransportError(
                f"{word[:_LONGEST_SHOWN]!r} is not a valid argument of ROS 2: it should be as --ros-args "
                "-r image_raw:=camera/image -p fps:=15"
            )
        if word in {"--ros-args", "--"}:
            inside = word == "--ros-args"
        elif flag in _VALUES:
            value = next(rest, None)
            if value is None or value in {"--ros-args", "--"}:
                raise TransportError(f"{word} lacks its value: {_VALUES[flag]}")
            yield flag, value
        elif word in _ROSOUT:
            yield word, ""
        elif word not in _WITHOUT_VALUE:
            known = ", ".join(_VALUES)
            raise TransportError(
                f"{word[:_LONGEST_SHOWN]!r} is not a valid argument of ROS 2: after --ros-args there may be {known}"
            )


def _remap(text: str) -> Iterator[Remap]:
    source, assigned, target = text.partition(":=")
    rule = _RULE.fullmatch(source)
    if not (assigned and target and rule):
        raise TransportError(f"-r {_shown(text)}: it should be {_VALUES['-r']}")
    name = rule["name"]
    if name.startswith("rosservice://"):
        return  # the nodes have no services
    name = {"__name": "__node"}.get(name, name.removeprefix("rostopic://"))
    if name.startswith("__") and name not in {"__node", "__ns"}:
        raise TransportError(f"-r {_shown(text)}: there is no {_shown(name)}; there are __node and __ns")
    if "*" in source or "\\" in target:
        raise TransportError(f"-r {_shown(text)}: ROS 2 has no wildcards in remapping rules")
    yield Remap(name, target.removeprefix("rostopic://"), rule["node"])


def _parameter(text: str) -> ParameterRule:
    source, assigned, value = text.partition(":=")
    rule = _PARAMETER.fullmatch(source)
    if not (assigned and rule):
        raise TransportError(f"-p {_shown(text)}: it should be {_VALUES['-p']}")
    parsed = plain_yaml.parse(value, f"-p {_shown(text)}", TransportError)
    node = rule["node"]
    pattern = "/**" if node is None else node if node.startswith("/") else f"/**/{node}"
    return ParameterRule(pattern, dict(_flat("", {rule["name"]: parsed})))


def _parameter_file(path: Path) -> list[ParameterRule]:
    source = f"--params-file {path}"
    content = plain_yaml.read(path, source, TransportError, source)
    rules = list(_file_rules(path, "", content))
    if not rules:
        raise TransportError(f"--params-file {path}: it has no ros__parameters; it should be as {_FILE_EXAMPLE}")
    return rules


_FILE_EXAMPLE = "{hand_sign_control: {ros__parameters: {linear_step: 0.02}}}"


def _file_rules(path: Path, prefix: str, content: Any) -> Iterator[ParameterRule]:
    if not isinstance(content, dict):
        raise TransportError(f"--params-file {path}: {prefix or 'it'} should be as {_FILE_EXAMPLE}")
    for name, inner in content.items():
        if name == "ros__parameters" and prefix and isinstance(inner, dict):
            yield ParameterRule(prefix, dict(_flat("", inner)))
        else:
            yield from _file_rules(path, f"{prefix}/{str(name).strip('/')}", inner)


def _flat(prefix: str, values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, dict) and value:
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value


def _log_level(text: str) -> str | None:
    logger, assigned, level = text.rpartition(":=")
    if level.lower() not in _LEVELS:
        raise TransportError(f"--log-level {_shown(text)}: it should be one of {', '.join(_LEVELS)}")
    return None if assigned and logger else level.lower()


def _shown(text: str) -> str:
    return text if text.isprintable() and len(text) <= _LONGEST_SHOWN else repr(text[:_LONGEST_SHOWN])
