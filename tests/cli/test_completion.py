"""Shell completion, in real shells."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.test_cli import prints

COMPLETE = """
. {script}
complete_line() {{
    COMP_WORDS=($1 "$2"); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMP_LINE="$1 $2"; COMP_POINT=${{#COMP_LINE}}
    COMPREPLY=()
    "$(complete -p handsteer | sed 's/.*-F \\([^ ]*\\).*/\\1/')" handsteer "$2" "${{COMP_WORDS[COMP_CWORD-1]}}"
    printf '%s\\n' "${{COMPREPLY[@]}}"
}}
complete_line "{before}" "{word}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "handsteer"
    text = subprocess.run(
        [sys.executable, "-m", "handsteer", "completion", "bash"], check=True, capture_output=True, text=True
    ).stdout
    path.write_text(text)
    return path


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("before", "word", "expected"),
    [
        ("handsteer", "rec", {"recognize", "recognition", "record"}),
        ("handsteer signs", "", {"list", "evaluate", "collect", "import", "train", "export"}),
        ("handsteer run", "--head", {"--headless"}),
        ("handsteer run", "--control.max-lin", {"--control.max-linear", "--control.max-linear-jerk"}),
        ("handsteer run --control.mode", "", {"signs", "joystick"}),
        ("handsteer run --robot.preset", "turtle", {"turtlebot4", "turtlesim"}),
        ("handsteer signs list", "--js", {"--json"}),
    ],
)
def test_bash_completes(script: Path, before: str, word: str, expected: set[str]) -> None:
    text = COMPLETE.format(script=script, before=before, word=word)
    done = subprocess.run(["bash", "-c", text], check=True, capture_output=True, text=True)
    found = {line.strip() for line in done.stdout.splitlines()}
    assert found >= expected
    assert all(each.startswith(word) for each in found)
    assert done.stderr == ""


@pytest.mark.slow
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_can_read_its_script(capsys: pytest.CaptureFixture[str], shell: str, tmp_path: Path) -> None:
    text = prints(capsys, "completion", shell)
    assert "control.max-linear" in text
    if shutil.which(shell):
        path = tmp_path / "script"
        path.write_text(text)
        subprocess.run([shell, "-n", str(path)], check=True)
