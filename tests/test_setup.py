"""What scripts/setup, and so ``make run``, says where it cannot work."""

import os
import shutil
import subprocess
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
