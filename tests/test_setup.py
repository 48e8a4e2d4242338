"""What scripts/setup, and so ``make run``, says where it cannot work."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
IS_ROOT = os.geteuid() == 0
NOBODY = 65534


@pytest.fixture
def tree() -> Iterator[Path]:
    """Return a copy of what setup reads, in a folder that every user can enter."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "handsteer"
        (root / "scripts").mkdir(parents=True)
        shutil.copy(REPOSITORY / "scripts/setup", root / "scripts/setup")
        for name in ("requirements.txt", "pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(REPOSITORY / name, root / name)
        Path(folder).chmod(0o755)
        yield root


def says(*command: str, user: int | None = None) -> str:
    """Return the last line of a set-up that fails."""
    environment = {name: value for name, value in os.environ.items() if name != "VIRTUAL_ENV"}
    # A uv that is installed already is used, and would not have to be installed.
    folders = environment.get("PATH", os.defpath).split(os.pathsep)
    environment["PATH"] = os.pathsep.join(each for each in folders if not (Path(each) / "uv").exists())
    done = subprocess.run(command, user=user, env=environment, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 2
    assert done.stdout == ""
    lines = [line for line in done.stderr.splitlines() if "creating .venv" not in line and "installing" not in line]
    assert len(lines) == 1, done.stderr
    return lines[0]


def test_a_folder_that_cannot_be_written_is_named(tree: Path) -> None:
    tree.chmod(0o555)
    said = says(str(tree / "scripts/setup"), "requirements.txt", user=NOBODY if IS_ROOT else None)
    assert said.startswith(f"handsteer set-up: cannot write in {tree}, where .venv belongs: ")


@pytest.mark.slow
@pytest.mark.netns
@pytest.mark.skipif(not IS_ROOT, reason="a network namespace needs root")
def test_without_network_the_cause_is_named(tree: Path) -> None:
    said = says("unshare", "-n", str(tree / "scripts/setup"), "requirements.txt")
    assert said.startswith("handsteer set-up: cannot install uv: no connection to the package index (")
    assert "Errno" not in said


@pytest.fixture
def foreign(tree: Path) -> Path:
    """Return a tree whose ``.venv`` leads to the Python of another user, and which make takes for complete."""
    programs = tree / ".venv/bin"
    programs.mkdir(parents=True)
    (programs / "python").symlink_to("/home/ann/.local/share/uv/python/bin/python3")
    (programs / ".run").touch()
    shutil.copy(REPOSITORY / "Makefile", tree / "Makefile")
    os.utime(programs / ".run", (2**32, 2**32))
    return tree


def would_set_up(tree: Path) -> bool:
    done = subprocess.run(["make", "-n", "run"], cwd=tree, capture_output=True, text=True, check=True, timeout=60)
    return "scripts/setup requirements.txt" in done.stdout


def test_an_environment_of_another_user_is_made_again_and_one_line_says_why(foreign: Path) -> None:
    empty = foreign / "no-programs"
    empty.mkdir()
    for name in ("sed", "readlink", "dirname", "sh"):
        (empty / name).symlink_to(str(shutil.which(name)))
    done = subprocess.run(
        [str(foreign / "scripts/setup"), "requirements.txt"],
        env={"PATH": str(empty), "PYTHON": "/nowhere/python3"},
        capture_output=True,
        text=True,
        check=False,
    )
    first, last = done.stderr.splitlines()
    assert first == (
        "handsteer set-up: .venv cannot be used: its Python, /home/ann/.local/share/uv/python/bin/python3, "
        "does not run; making it again"
    )
    assert "Python 3.11 or newer is missing" in last
    assert done.returncode == 2
    assert would_set_up(foreign)


def test_an_environment_that_was_made_elsewhere_is_made_again(foreign: Path) -> None:
    programs = foreign / ".venv/bin"
    (programs / "python").unlink()
    (programs / "python").symlink_to(sys.executable)
    assert not would_set_up(foreign), "nothing says that it was made elsewhere"
    script = programs / "handsteer"
    for head in (
        "#!/home/ann/handsteer/.venv/bin/python3\n",
        "#!/bin/sh\n'''exec' \"/home/ann/.venv/bin/python\" \"$0\"\n",
    ):
        script.write_text(head)
        (programs / ".run").touch()
        os.utime(programs / ".run", (2**32, 2**32))
        assert would_set_up(foreign), head
    for head in (f"#!{programs}/python3.11\n", f'#!/bin/sh\n\'\'\'exec\' "{programs}/python" "$0" "$@"\n'):
        script.write_text(head)
        (programs / ".run").touch()
        os.utime(programs / ".run", (2**32, 2**32))
        assert not would_set_up(foreign), head
