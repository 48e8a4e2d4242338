"""What help loads, and the examples in it."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from handsteer.cli.app import _ros_words_last, add_plugin_verbs, app
from handsteer.cli.options import take_parameters
from handsteer.errors import ConfigError
from tests.cli.test_cli import fails, prints

VERBS = [
    *("run", "recognize", "study", "parameters", "completion", "models", "doctor", "ros", "record", "replay"),
    *("report", "bench", "camera", "recognition", "control", "robot", "steering", "zenoh-router", "robots"),
    *(
        "signs list",
        "signs evaluate",
        "signs collect",
        "signs import",
        "signs train",
        "signs export",
        "signs calibrate",
    ),
]
HEAVY = {"cv2", "mujoco", "nicegui", "numpy", "plotly", "pydantic", "rosbags", "tqdm", "yaml"}
LOADS = """
import json, sys
from handsteer.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


def test_the_list_of_verbs_is_complete() -> None:
    add_plugin_verbs()
    known = [name for name in app if not name.startswith("-")]
    assert {verb.partition(" ")[0] for verb in VERBS} == set(known)
    assert {f"signs {name}" for name in app["signs"] if not name.startswith("-")} <= set(VERBS)


@pytest.mark.parametrize(
    "words", [["--version"], ["--help"], ["signs"], *([*verb.split(), "--help"] for verb in VERBS)]
)
def test_help_loads_little(words: list[str]) -> None:
    """Loading is most of the time that help takes."""
    done = subprocess.run([sys.executable, "-c", LOADS, *words], check=True, capture_output=True, text=True)
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert not loaded & HEAVY


@pytest.mark.parametrize("verb", VERBS)
def test_the_examples_of_a_verb_can_be_read(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    text = prints(capsys, *verb.split(), "--help")
    block = re.search(r"For example:\n((?:  .*\n)+)", text)
    assert block, text
    lines = block[1].splitlines()
    assert len(lines) <= 4
    assert any(f"handsteer {verb}" in line for line in lines)
    for line in lines:
        command = re.search(r"handsteer ([^>)]*?)(  | >|\)|$)", line)
        assert command
        own, _ = take_parameters(_ros_words_last(shlex.split(command[1])))
        app.parse_args(own, exit_on_error=False, print_error=False)


def test_help_of_a_verb_has_no_other_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert "handsteer report drive.mcap" not in prints(capsys, "run", "--help")


@pytest.mark.parametrize("words", [["run"], ["signs", "list"], ["doctor"]], ids=" ".join)
def test_help_after_a_parameter_is_help(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert f"Usage: handsteer {' '.join(words)} " in prints(capsys, *words, "--control.max-linear", "0.5", "--help")


def test_parameters_are_listed_and_found(capsys: pytest.CaptureFixture[str]) -> None:
    control = prints(capsys, "parameters", "control")
    assert (
        "--control.max-linear\n    Maximum linear speed [m/s]\n    above 0, at most 10; default 1.0; can change"
        in control
    )
    assert "--robot." not in control
    both = {row["name"] for row in json.loads(prints(capsys, "parameters", "max-linear", "--json"))}
    assert both >= {"control.max_linear", "robot.max_linear"}
    assert "the sections are camera, " in fails(capsys, "parameters", "colour")


def test_the_signs_are_listed_as_a_start_here_uses_them(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``handsteer.yaml`` of the working directory counts, as in ``handsteer run``."""
    monkeypatch.chdir(tmp_path)
    Path("handsteer.yaml").write_text("control: {actions: {Go: stop}}", encoding="utf-8")
    rows = json.loads(prints(capsys, "signs", "list", "--json"))
    assert next(row["action"] for row in rows if row["sign"] == "Go") == "stop"


def test_parameters_are_options_of_every_form(capsys: pytest.CaptureFixture[str]) -> None:
    rows = prints(capsys, "signs", "list", "--json", "--control.actions.Stop=stop", "--control.point_turn", "0.5")
    assert {"sign": "Stop", "action": "stop"}.items() <= next(
        row for row in json.loads(rows) if row["sign"] == "Stop"
    ).items()
    flags = ["run", "--robot.publish-clock", "--dashboard.no-open-browser"]
    own, found = take_parameters([*flags, "--collision-monitor.scan-x", "-0.5", "--", "--a.b"])
    assert own == ["run", "--", "--a.b"]
    assert found["robot"] == {"publish_clock": True}
    assert found["dashboard"] == {"open_browser": False}
    assert found["collision_monitor"] == {"scan_x": "-0.5"}
    words = ["--robot.publish-clock", "FALSE", "--foxglove.drive", "true", "--dashboard.open-browser=false", "true"]
    own, found = take_parameters(words)
    assert own == ["true"]
    assert found["robot"] == {"publish_clock": "FALSE"}
    assert (found["foxglove"], found["dashboard"]) == ({"drive": "true"}, {"open_browser": "false"})
    for words in (["--foxglove.no-drive=true"], ["--foxglove.no-drive", "false"]):
        with pytest.raises(ConfigError, match=r"--foxglove\.no-drive takes no value: it sets drive to false"):
            take_parameters(words)
    assert take_parameters(["--control.robots", "r1", "--control.robots=r2"])[1] == {
        "control": {"robots": ["r1", "r2"]}
    }
