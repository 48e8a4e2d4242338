"""Untrusted YAML: what a few hundred bytes could do to the reader, they don't."""

from pathlib import Path
from typing import Any

import pytest

from handsteer import plain_yaml
from handsteer.errors import ConfigError, WorldError
from tests.fuzz import corpus

REFUSED = (
    (corpus.ALIASES, r"^w\.yaml, line 1: anchors \(&\) and aliases \(\*\) are not read here: write the value out$"),
    (corpus.MERGES, r"line 1: anchors"),
    ("a: 1\nb: *a", r"line 2: anchors"),
    ("a: 1\n<<: {b: 1}", r"line 2: merge keys \(<<\) are not read here"),
    ("[" * 100_000, "line 1: lists and tables are nested more than 32 deep"),
    ("- " * 100_000, "nested more than 32 deep"),
    ("[" + "1," * 30_000 + "]", "more than 20000 values"),
    ("a: " + "9" * 5000, "line 1: a number of 5000 characters: 64 are enough"),
    ("a: 1" + ":1" * 2000, "a number of 4001 characters"),
    ("a: !!float x", "line 1: 'x' cannot be read as !!float"),
    ("a: !!int ''", "'' cannot be read as !!int"),
    ("a: !!timestamp x", r"line 1: the tag 'tag:yaml\.org,2002:timestamp' is not read here: leave it out"),
    ("a: !!python/object/apply:os.system [x]", "the tag 'tag:yaml.org,2002:python/object/"),
    ("!!set {a}", "the tag 'tag:yaml.org,2002:set'"),
    ("a: !<" + "x" * 5000 + "> 1", "is not read here"),
    ("control:\n  mode: signs\ncontrol:\n  ramp: per_second\n", r"^w\.yaml, line 3: 'control' is given twice$"),
    ("a: [1, {b: 1, c: [2, {b: 3}], b: 2}]", r"line 1: 'b' is given twice$"),
    ("'a': 1\n\"a\": 2", r"line 2: 'a' is given twice$"),
    ("a: {", r"^w\.yaml, line 1: not valid YAML$"),
    ("? [1]\n: 2", "line 1: not valid YAML"),
    ("a:\n\tb: 1", "line 2: not valid YAML: indent with spaces, not with a tab$"),
    ("a:\n  b: 1\n \t c: [", "line 3: not valid YAML: indent with spaces, not with a tab$"),
    ("a: 0b_", "not valid YAML"),
    ("\0", "not valid YAML"),
    ("a: \ud800", "not valid YAML"),
    (b"\xff\xfe\xff", "not valid YAML"),
    ("#" * 2_000_000, "is larger than 1000 kB, which no such file should be"),
)


@pytest.mark.parametrize(("text", "words"), REFUSED)
def test_refuses_in_one_short_line(text: str | bytes, words: str) -> None:
    with pytest.raises(WorldError, match=words) as caught:
        plain_yaml.parse(text, "w.yaml", WorldError)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 160


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("a: [1, 0.5, true, text, null, 1e400, .inf]", {"a": [1, 0.5, True, "text", None, "1e400", float("inf")]}),
        ("a: {b: a}\nb: [{a: 1}, {a: a}]\nc: a", {"a": {"b": "a"}, "b": [{"a": 1}, {"a": "a"}], "c": "a"}),
        ("a: 2001-99-99", {"a": "2001-99-99"}),
        ("a: !!float 3", {"a": 3.0}),
        ("a: !!str 3", {"a": "3"}),
        ("a: '<<'", {"a": "<<"}),
        ("a: '" + "9" * 5000 + "'", {"a": "9" * 5000}),
    ],
)
def test_reads_plain_values(text: str, value: Any) -> None:
    assert plain_yaml.parse(text, "w.yaml", WorldError) == value


def test_reads_files_no_further_than_they_may_go(tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_bytes("\ufeffname: \u00e9".encode())
    assert plain_yaml.read(path, str(path), ConfigError, "cannot") == {"name": "\u00e9"}
    with pytest.raises(ConfigError, match=r"^cannot: No such file"):
        plain_yaml.read(tmp_path / "none.yaml", "", ConfigError, "cannot")
    with path.open("wb") as file:
        file.truncate(10_000_000_000)
    with pytest.raises(ConfigError, match="is larger than 1000 kB"):
        plain_yaml.read(path, str(path), ConfigError, "cannot")
    with pytest.raises(ConfigError, match="not a regular file"):
        plain_yaml.read(Path("/dev/zero"), "/dev/zero", ConfigError, "cannot")


def test_a_key_is_read_as_it_is_written() -> None:
    text = "Yes: yes\n12: 12\nnull: null\n'off': {on: off, 1.0: [1.0]}\n"
    assert plain_yaml.parse(text, "w.yaml", ConfigError) == {
        "Yes": True,
        "12": 12,
        "null": None,
        "off": {"on": False, "1.0": [1.0]},
    }


def test_a_file_in_another_encoding_is_named_as_such(tmp_path: Path) -> None:
    (tmp_path / "latin.yaml").write_bytes("# für mich\na: 1".encode("latin-1"))
    with pytest.raises(ConfigError, match="not valid YAML: its text is not in UTF-8"):
        plain_yaml.read(tmp_path / "latin.yaml", "latin.yaml", ConfigError, "cannot be read")
