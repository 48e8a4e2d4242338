"""Tables and lists of the pages: what they list is all that the code has, with its defaults."""

import ast
import json
import re
import tomllib
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, get_args
from xml.etree import ElementTree

import numpy as np
import pytest

import handsteer
from handsteer import messages
from handsteer.audit import AuditCode
from handsteer.cli import signals
from handsteer.config import ControlConfig
from handsteer.config.driving import PRESETS
from handsteer.images import _ENCODINGS, _TWO_PLANES
from handsteer.nodes.diagnostics import _hints
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus
from handsteer.plugins.study.plan import Condition, Input, Plan
from handsteer.plugins.study.results import LAP_COLUMNS
from handsteer.plugins.study.session import Outcome
from handsteer.plugins.teach.dataset import Dataset, save_dataset
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.virtual_hand.poses import _POSES
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, load_model
from handsteer.robots.world import Box, Floor, shipped_worlds
from handsteer.robots.world import Stop as StopPose
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT, Action
from tests.docs.pages import DOCS, ROOT, blocks, prose, table, text_of, words
from tests.docs.test_names import options
from tests.plugins.teach.takes import take


def page(name: str) -> Path:
    """Return a page of docs."""
    return DOCS / f"{name}.md"


def section(name: str, begin: str, end: str = "\n\n") -> str:
    """Return the text of a page from ``begin`` to ``end``."""
    _, found, rest = text_of(page(name)).partition(begin)
    assert found, begin
    return begin + rest.partition(end)[0]


def test_arrays_of_a_dataset(tmp_path: Path) -> None:
    rows = {words(row[0])[0]: row[1].split()[-1] for row in table(page("dataset"), "array | shape, type | meaning")}
    save_dataset(Dataset((take("Peace", hands=3),), frozenset({"Peace"})), tmp_path / "signs.npz")
    with np.load(tmp_path / "signs.npz") as arrays:
        kinds = {name: arrays[name].dtype for name in arrays}
    assert set(kinds) == set(rows)
    assert {name: kind for name, kind in rows.items() if "32" in kind} == {
        name: str(kind) for name, kind in kinds.items() if "32" in str(kind)
    }


def test_fields_of_a_plan() -> None:
    for head, model in (("`participants`", Plan), ("`instructions`", Condition)):
        text = section("study", f"| {head}")
        rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in text.splitlines()]
        named = {name: row[2].strip("`| ") if len(row) > 2 else "" for row in rows for name in words(row[0])}
        assert set(named) == set(model.model_fields) - {"name"}
        for name, default in named.items():
            has = model.model_fields[name].default
            shown = (
                f"[{', '.join(has)}]" if isinstance(has, tuple) else f"{has:g}" if isinstance(has, float) else str(has)
            )
            assert default in ("", shown), name


def test_columns_and_outcomes_of_a_study() -> None:
    listed = words(re.sub(r"\(.*?\)", "", section("study", "- `laps.csv`", "\n- ")))
    assert tuple(listed[1:]) == LAP_COLUMNS
    assert [words(row[0])[0] for row in table(page("study"), "`outcome` | meaning")] == [*get_args(Outcome)]
    inputs = words(section("study", "| `input` |", ":"))
    assert {each for each in inputs[1:] if len(each) > 1} == set(get_args(Input))


def test_fields_of_a_world() -> None:
    rows = {(row[0], row[1]): row[2] for row in table(page("worlds"), "field | of | default | meaning")}
    assert ast.literal_eval(rows["`size`", "`floor`"].strip("`")) == [*Floor().size]
    for name in ("yaw", "movable", "mass"):
        shown = rows[f"`{name}`", "obstacles"].strip("`")
        assert json.loads(shown) == Box.model_fields[name].default
    assert rows["`position`, `yaw`, `tolerance`", "`stop`"] == f"`yaw` {StopPose.model_fields['yaw'].default:g}, " + (
        f"`tolerance` {StopPose.model_fields['tolerance'].default:g}"
    )
    listed = words(section("worlds", "`handsteer run --world", "are included"))
    assert sorted(each.removeprefix("handsteer run --world ") for each in listed) == sorted(shipped_worlds())


def test_codes_of_the_audit() -> None:
    codes = [code for row in table(page("recordings"), "`function` | `name` | `file` | when") for code in words(row[0])]
    assert sorted(codes) == sorted(get_args(AuditCode))


def reported(kind: Any, prefix: str = "") -> set[str]:
    """Return the names of the values that a status has, those of its parts included; parameters are left out."""
    names: set[str] = set()
    for field, hint in _hints(kind).items():
        part = next((each for each in (hint, *get_args(hint)) if isinstance(each, type) and is_dataclass(each)), None)
        if part is not None:
            names |= reported(part, f"{prefix}{field}_")
        elif ControlConfig not in get_args(hint):
            names.add(prefix + field)
    return names


EXAMPLES = {"waiting", "delivers", "silent", "frozen", "lost", "disarmed", "no_sign", "none", "joystick", "steering"}
"""In the table as what a value is, not as the name of one."""


def test_values_on_diagnostics() -> None:
    kinds = {kind.node: kind for kind in (CameraStatus, RecognitionStatus, ControlStatus, RobotStatus)}
    rows = {words(row[0])[0]: set(words(row[1])) for row in table(page("architecture"), "node | values")}
    rows["hand_sign_control"] -= {"signs", "max_linear", "actions.Peace"}
    assert {node: names - EXAMPLES for node, names in rows.items()} == {node: reported(kinds[node]) for node in rows}
    assert set(rows) == set(kinds)


def test_threads_and_what_has_none() -> None:
    sources = {path: path.read_text() for path in (ROOT / "src/handsteer").rglob("*.py")}
    started = {name for text in sources.values() for name in re.findall(r'Thread\(.*name="(\w+)"', text)}
    head = "thread | started by | what it does | shared state, and its lock"
    listed = {name for row in table(page("architecture"), head) for name in words(row[0])}
    assert len(started) > 12
    assert started <= listed
    locked = {path.stem for path, text in sources.items() if "threading.Lock" in text}
    assert locked & {path.stem for path in sources if path.parent.name in ("control", "recognition", "robots")} == {
        "description",
        "landmark_models",
    }


def test_topics_that_all_namespaces_share() -> None:
    shared = {topic.name for topic in vars(messages).values() if isinstance(topic, messages.Topic) and topic.is_global}
    assert set(words(section("architecture", "globally: ", ". `Topic"))) == shared


def test_signals_that_are_caught() -> None:
    text = section("safety", "Every catchable signal", "SIGKILL")
    named = set(re.findall(r"SIG[A-Z]+", text)) | {f"SIGUSR{number}" for number in (1, 2)}
    assert named - {"SIGUSR"} == set(signals._ENDING) - {"SIGBREAK"}


def test_encodings_of_raw_images() -> None:
    text = section("safety", "| raw images |", "any other")
    named = {each for each in re.findall(r"\b[a-z]*\d*[a-z]*\w*\b", text) if re.search(r"\d|uyvy|yuyv", each)}
    assert named == set(_ENCODINGS) | set(_TWO_PLANES)


@pytest.mark.parametrize("row", table(page("signs-evaluate"), "| flip | 90 | 180 | 270"), ids=lambda row: row[0])
def test_signs_of_turned_photos(row: list[str]) -> None:
    sign = words(row[0])[0]
    kind = words(row[0])[1] if "kind" in row[0] else ""
    for cell, (flip, angle) in zip(row[1:], ((True, 0), (False, 90), (False, 180), (False, 270)), strict=True):
        named = words(cell)
        thumb = next((f"thumb_{way}" for way in ("up", "down") if f"thumb {way}" in cell), "")
        expected = (sign, kind) if cell == "the same" else (named[0] if named else NONE, thumb)
        truth, found = View(flip=flip, rotate_deg=angle).truth(sign, kind)
        assert truth == expected[0]
        if thumb:
            assert found == thumb


def test_actions_and_built_in_signs() -> None:
    rows = table(page("signs-evaluate"), "action | what the robot does")
    assert sorted(word for row in rows for word in words(row[0])) == sorted(get_args(Action))
    rows = table(ROOT / "README.md", "sign | what you show | what the robot does, each frame")
    assert [words(row[0])[0] for row in rows] == [FORWARD, BACKWARD, TURN_LEFT, TURN_RIGHT, GO, STOP, NONE]


def test_signs_that_the_virtual_hand_knows() -> None:
    named = words(section("teach", "the virtual hand, which knows", ":"))
    assert set(named) == set(_POSES) - {*SIGNS, NONE}


def test_presets_python_and_extras() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    readme = " ".join(text_of(ROOT / "README.md").split())
    assert f"Python {project['requires-python'].replace('>=', '≥ ')}," in readme
    robots = re.findall(r"--robot (\w+) +# also ([\w, ]+) handsteer", readme)[0]
    assert {robots[0], *robots[1].strip().split(", ")} == set(PRESETS) - {"generic"}
    named = set(words(section("shell", "A plain installation", "To add one")))
    assert named - {"signs evaluate"} == set(project["optional-dependencies"])


def test_the_shipped_model_is_as_described() -> None:
    shipped = load_model()
    hands = round(sum(shipped.trained_on["hands"].values()), -3)
    layers = [each.shape[0] for each in shipped.network.weights] + [len(shipped.shapes)]
    text = " ".join(text_of(page("signs")).split())
    assert f"trained on {hands:,} synthetic hands" in text
    assert f"network of {'-'.join(map(str, layers))} gives" in text
    assert f"included file ({DEFAULT_MODEL.stat().st_size // 1000} kB" in text


def test_interfaces_compare_as_readme_says() -> None:
    """The first table of laps is that of the slalom: the joystick as the pad, and four times as fast as signs."""
    head = re.findall(r"^\| (interface \| time, s \|.*) \|$", text_of(page("driving")), re.MULTILINE)[0]
    times = {words(row[0])[0]: float(row[1].split()[0]) for row in table(page("driving"), head)}
    assert round(times["signs"] / times["joystick"]) == 4
    assert times["joystick"] / times["pad"] < 1.05
    assert times["point"] / times["pad"] < 1.05


def test_public_names() -> None:
    (program,) = (block.text for block in blocks("python") if block.page == page("api"))
    assert sorted(re.findall(r"\b[A-Z]\w+", program)) == sorted(handsteer.__all__)


def launch_args(file: Path) -> dict[str, str | None]:
    """Return the args of a launch file of ROS 1 with their defaults."""
    return {
        str(arg.get("name")): arg.get("default")
        for arg in ElementTree.parse(file).getroot().iter("arg")
        if arg.get("doc")
    }


def test_launch_files_of_ros1_have_the_args() -> None:
    texts = [*(block.text for block in blocks("sh")), *words(prose(page("ros1")))]
    found = [each for text in texts for each in re.findall(r"roslaunch (?:--\S+ )?(\w+) (\w+\.launch)([^#\n]*)", text)]
    assert len(found) > 15
    for package, name, rest in found:
        args = launch_args(ROOT / "ros" / package / "launch" / name)
        assert {each for each in re.findall(r"(\w+):=", rest) if not each.startswith("__")} <= set(args), (
            package,
            name,
        )


def test_defaults_of_a_launch_file_of_ros1() -> None:
    args = launch_args(ROOT / "ros/ros_hand_gesture_recognition/launch/hand_sign.launch")
    rows = {words(row[0])[0]: row[1].strip("`") for row in table(page("ros1"), "arg | default |")}
    assert set(rows) == set(args)
    assert {name: args[name] for name, default in rows.items() if default != "where there is a display"} == {
        name: default for name, default in rows.items() if default != "where there is a display"
    }


def test_options_of_calibrating() -> None:
    named = [word for row in table(page("calibrate"), "option |") for word in words(row[0])]
    assert len(named) == 6
    assert {word.split()[0] for word in named} <= options()
