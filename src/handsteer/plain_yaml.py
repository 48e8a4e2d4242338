"""Reads YAML from untrusted sources: plain values only, within limits far above those of handsteer's files.

A few hundred bytes of YAML can expand to gigabytes (aliases of aliases, merge keys), nest as deep as the stack, or
contain a number that takes minutes to read. So the events of a text are checked before anything is constructed from it.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import yaml

from handsteer.errors import HandsteerError, quoted
from handsteer.regular_files import open_regular

LARGEST_BYTES: Final = 1_000_000
"""Size of a text; the largest that is shipped has 4 kB."""

MOST_VALUES: Final = 20_000
"""Keys, values, lists and tables together; an object of a world has some 20."""

DEEPEST: Final = 32
"""Depth of nested lists and tables."""

LONGEST_NUMBER: Final = 64
"""Characters; Python takes minutes for numbers of millions."""

_NOT_UTF8 = "not valid YAML: its text is not in UTF-8"
_TAG = "tag:yaml.org,2002:"
_COLLECTIONS = frozenset({f"{_TAG}seq", f"{_TAG}map"})
_NUMBERS = frozenset({f"{_TAG}int", f"{_TAG}float"})
_SCALARS = _NUMBERS | {f"{_TAG}str", f"{_TAG}bool", f"{_TAG}null"}


# Without libyaml, which all wheels have, the other loader reads the same, more slowly.
class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Constructs texts, numbers, booleans and null; a date is a text, as in JSON and in ROS 2's parameter files.

    Keys are texts as they are written, as all of ours are names: ``Yes``, not true.
    """

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                key.tag = f"{_TAG}str"
        found: dict[Any, Any] = super().construct_mapping(node, deep)
        return found


_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in rules if tag in _SCALARS]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


class _ProblemError(Exception):
    def __init__(self, reason: str, mark: Any = None) -> None:
        super().__init__(reason)
        self.line = getattr(mark, "line", None)


def parse(text: str | bytes, source: str, error: type[HandsteerError]) -> Any:
    """Return the value of ``text``: None, booleans, numbers, texts, and lists and dicts of these.

    Args:
        text: YAML of at most :data:`LARGEST_BYTES`, without anchors, aliases, merge keys (``<<``), and tags except
            those of plain values.
        source: Name in error messages, such as that of a file.
        error: Type of the error raised.

    Raises:
        HandsteerError: The text is invalid; of the given type. One line names the source, the line and the reason.
    """
    try:
        if len(text) > LARGEST_BYTES:
            raise _ProblemError(f"is larger than {LARGEST_BYTES // 1000} kB, which no such file should be")
        _look_through(text)
        return yaml.load(text, _Loader)
    except _ProblemError as problem:
        reason, line = str(problem), problem.line
    except yaml.YAMLError as problem:
        line = getattr(getattr(problem, "problem_mark", None), "line", None)
        reason = "not valid YAML"
        if _begins_with_tab(text, line):
            reason += ": indent with spaces, not with a tab"
    except ValueError as problem:
        reason, line = _NOT_UTF8 if isinstance(problem, UnicodeError) else "not valid YAML", None
    raise error(f"{source}{_at(line, text)}: {reason}") from None


def read(path: Path, source: str, error: type[HandsteerError], unreadable: str) -> Any:
    """Return the value in the file ``path``, as :func:`parse` does.

    Args:
        path: The file; reading stops at the size limit.
        source: Name in error messages.
        error: Type of the error raised.
        unreadable: Message if it cannot be read; the system's reason is appended.

    Raises:
        HandsteerError: As :func:`parse`, or the file cannot be read.
    """
    try:
        with open_regular(path) as file:
            content = file.read(LARGEST_BYTES + 1)
    except OSError as problem:
        raise error(f"{unreadable}: {problem.strerror}") from None
    try:
        text: str | bytes = content.decode("utf-8-sig") if len(content) <= LARGEST_BYTES else content
    except UnicodeDecodeError:
        raise error(f"{source}: {_NOT_UTF8}") from None
    return parse(text, source, error)


def line_of(path: Path, place: Sequence[str | int]) -> int | None:
    """Return the line, from 1, of the key or item at ``place`` in the file, such as ``("control", "mode")``.

    None if it is not there, or the file can no longer be read.
    """
    try:
        with open_regular(path) as file:
            text = file.read(LARGEST_BYTES).decode("utf-8-sig")
        _look_through(text)
        node = yaml.compose(text, _Loader)
    except (OSError, ValueError, yaml.YAMLError, _ProblemError):
        return None
    found: Any = None
    for part in place:
        pairs = enumerate(node.value) if isinstance(node, yaml.SequenceNode) else getattr(node, "value", ())
        below = [(key, of) for key, of in pairs if part == (key if isinstance(key, int) else key.value)]
        if isinstance(node, yaml.ScalarNode) or not below:
            return None
        key, node = below[0]
        found = node if isinstance(key, int) else key
    return found.start_mark.line + 1 if found is not None else None


def _at(line: int | None, text: str | bytes) -> str:
    if line is None:
        return ""
    last = (text if isinstance(text, bytes) else text.encode(errors="replace")).rstrip().count(b"\n")
    return f", line {min(line, last) + 1}"  # libyaml reports the end on the line after the last


def _begins_with_tab(text: str | bytes, line: int | None) -> bool:
    lines = (text if isinstance(text, bytes) else text.encode(errors="replace")).split(b"\n")
    return line is not None and line < len(lines) and b"\t" in lines[line][: -len(lines[line].lstrip()) or None]


def _look_through(text: str | bytes) -> None:
    around: list[_Table | None] = []  # None for a list
    for count, event in enumerate(_events(text)):
        if count > MOST_VALUES:
            raise _ProblemError(f"more than {MOST_VALUES} values", event.start_mark)
        if isinstance(event, yaml.CollectionEndEvent):
            around.pop()
            continue
        if around and (table := around[-1]):
            table.note(event)
        if isinstance(event, yaml.ScalarEvent):
            _check_scalar(event)
            continue
        if len(around) == DEEPEST:
            raise _ProblemError(f"lists and tables are nested more than {DEEPEST} deep", event.start_mark)
        if event.tag not in (None, "!", *_COLLECTIONS):
            raise _unknown_tag(event)
        around.append(_Table() if isinstance(event, yaml.MappingStartEvent) else None)


class _Table:
    """The keys of a table: of two that are the same, the parser would keep the last, and lose the other."""

    def __init__(self) -> None:
        self._keys: set[str] = set()
        self._is_value = False

    def note(self, event: Any) -> None:
        """Note the beginning of the next key or value."""
        is_value, self._is_value = self._is_value, not self._is_value
        if is_value or not isinstance(event, yaml.ScalarEvent):
            return
        if event.value in self._keys:
            raise _ProblemError(f"{quoted(event.value)} is given twice", event.start_mark)
        self._keys.add(event.value)


def _events(text: str | bytes) -> Iterator[Any]:
    """Yield the beginnings and ends of values in ``text``, and its scalars."""
    for event in yaml.parse(text, _Loader):
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            raise _ProblemError("anchors (&) and aliases (*) are not read here: write the value out", event.start_mark)
        if isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent | yaml.CollectionEndEvent):
            yield event


def _check_scalar(event: Any) -> None:
    is_plain = event.tag is None and not event.style
    if is_plain and event.value == "<<":
        raise _ProblemError("merge keys (<<) are not read here: write the values out", event.start_mark)
    found = _RESOLVER.resolve(yaml.ScalarNode, event.value, (True, False))  # type: ignore[no-untyped-call]
    tag = found if is_plain else event.tag
    if tag in (None, "!"):
        return
    if tag not in _SCALARS:
        raise _unknown_tag(event)
    if tag in _NUMBERS and len(event.value) > LONGEST_NUMBER:
        raise _ProblemError(f"a number of {len(event.value)} characters: {LONGEST_NUMBER} are enough", event.start_mark)
    if tag not in (f"{_TAG}str", found) and not (tag == f"{_TAG}float" and found == f"{_TAG}int"):
        name = tag.removeprefix(_TAG)
        raise _ProblemError(f"{quoted(event.value)} cannot be read as !!{name}", event.start_mark)


def _unknown_tag(event: Any) -> _ProblemError:
    return _ProblemError(f"the tag {quoted(event.tag)} is not read here: leave it out", event.start_mark)


class _Resolver(yaml.resolver.BaseResolver):
    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers


_RESOLVER = _Resolver()
