import contextlib
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import TransportError
from handsteer.plugins.ros2.arguments import ParameterRule, parse_arguments
from handsteer.plugins.ros2.names import Remap

TOKENS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
VALUES = st.booleans() | st.integers(-1000, 1000) | st.floats(-1e3, 1e3) | st.text("abc :#'\"-", max_size=8)


def test_remapping_and_parameters() -> None:
    words = "--ros-args -r a:=b --remap __node:=x -r __name:=y -r __ns:=/r1 -r cam:c:=/d -r rostopic://e:=rostopic:///f"
    more = "-p fps:=15 --param virtual_hand.script:=Forward:60 -- --ros-args --log-level debug"
    said = parse_arguments(f"{words} {more}".split())
    assert said.remaps == [
        Remap("a", "b"),
        Remap("__node", "x"),
        Remap("__node", "y"),
        Remap("__ns", "/r1"),
        Remap("c", "/d", "cam"),
        Remap("e", "/f"),
    ]
    assert said.parameters("/cam") == {"fps": 15, "virtual_hand": {"script": "Forward:60"}}
    assert said.log_level == "debug"


def test_what_launch_files_add_is_taken() -> None:
    words = "--ros-args --disable-stdout-logs --log-level rcl:=debug -e /x --log-config-file f -r rosservice://a:=b"
    said = parse_arguments(words.split())
    assert (said.remaps, said.rules, said.log_level) == ([], [], None)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("fast", "'fast' is not a valid argument of ROS 2: it should be as --ros-args"),
        ("--ros-args fast", "'fast' is not a valid argument of ROS 2: after --ros-args there may be -r, -p"),
        ("--ros-args -- fast", "'fast' is not a valid argument of ROS 2"),
        ("--ros-args -r", "-r lacks its value"),
        ("--ros-args -p --", "-p lacks its value"),
        ("--ros-args -r a=b", "-r a=b: it should be a rule"),
        ("--ros-args -r a:=", "-r a:=: it should be a rule"),
        ("--ros-args -r __log:=x", "-r __log:=x: there is no __log"),
        ("--ros-args -r /*/a:=b", "-r /*/a:=b: ROS 2 has no wildcards"),
        ("--ros-args -p a", "-p a: it should be a parameter"),
        ("--ros-args -p a:=[1", "-p a:=[1, line 1: not valid YAML"),
        ("--ros-args --log-level loud", "--log-level loud: it should be one of debug"),
        ("--ros-args --params-file /gone.yaml", "--params-file /gone.yaml: No such file"),
    ],
)
def test_wrong_words(words: str, message: str) -> None:
    with pytest.raises(TransportError, match=f"^{re.escape(message)}"):
        parse_arguments(words.split())


@given(st.lists(st.text("-:=/_ar1.p", max_size=10)))
def test_any_words_are_understood_or_refused(words: list[str]) -> None:
    with contextlib.suppress(TransportError):  # any other error fails the test
        parse_arguments(["--ros-args", *words]).parameters("/cam")


@given(st.dictionaries(TOKENS, VALUES, max_size=4))
def test_values_are_read_as_yaml_and_the_last_one_wins(values: dict[str, object]) -> None:
    words = ["--ros-args"]
    for name, value in values.items():
        words += ["-p", f"{name}:=first", "-p", f"{name}:={yaml.safe_dump(value, width=1000).partition(chr(10))[0]}"]
    assert parse_arguments(words).parameters("/cam") == values


@pytest.mark.parametrize(
    ("pattern", "fitting", "others"),
    [
        ("/cam", ["/cam"], ["/r1/cam", "/came", "/cam/a"]),
        ("/**", ["/cam", "/r1/cam", "/a/b/c"], []),
        ("/*", ["/cam"], ["/r1/cam"]),
        ("/r1/*", ["/r1/cam"], ["/cam", "/r1/a/cam"]),
        ("/**/cam", ["/cam", "/r1/cam", "/a/b/cam"], ["/webcam", "/cam/a"]),
        ("/*/cam", ["/r1/cam"], ["/cam", "/a/b/cam"]),
    ],
)
def test_which_nodes_a_pattern_fits(pattern: str, fitting: list[str], others: list[str]) -> None:
    rule = ParameterRule(pattern, {})
    assert [node for node in (*fitting, *others) if rule.fits(node)] == fitting


def test_parameter_files(tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(
        """
        /**: {ros__parameters: {use_sim_time: true, fps: 10}}
        cam: {ros__parameters: {fps: 20, virtual_hand: {script: "Go:1", skin: dark}}}
        r1: {cam: {ros__parameters: {fps: 30}}}
        """
    )
    said = parse_arguments(["--ros-args", "--params-file", str(file), "-p", "cam:width:=320"])
    assert said.parameters("/cam") == {
        "use_sim_time": True,
        "fps": 20,
        "virtual_hand": {"script": "Go:1", "skin": "dark"},
        "width": 320,
    }
    assert said.parameters("/r1/cam") == {"use_sim_time": True, "fps": 30, "width": 320}
    assert said.parameters("/other") == {"use_sim_time": True, "fps": 10}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("fps: 10", ": /fps should be as {"),
        ("[1, 2]", ": it should be as {"),
        ("", ": it should be as {"),
        ("{a: {}}", ": it has no ros__parameters"),
        ("{a: [", ", line 1: not valid YAML"),
    ],
)
def test_wrong_parameter_files(tmp_path: Path, content: str, message: str) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(content)
    with pytest.raises(TransportError, match=re.escape(f"--params-file {file}{message}")):
        parse_arguments(["--ros-args", "--params-file", str(file)])


def test_a_value_cannot_have_parts() -> None:
    said = parse_arguments(["--ros-args", "-p", "hand:=1", "-p", "hand.skin:=dark"])
    with pytest.raises(TransportError, match=r"parameter hand\.skin: hand is a value already"):
        said.parameters("/cam")
