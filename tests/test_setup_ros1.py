"""What the ROS 1 set-up says where it cannot work; that it works is what all tests marked ros1 stand on."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "setup-ros1"

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a shell script")


def run(script: Path, path: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [script], env={"PATH": path}, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False
    )


def test_without_apt_it_refuses(tmp_path: Path) -> None:
    for tool in ("dirname", "sh"):
        found = shutil.which(tool)
        assert found
        (tmp_path / tool).symlink_to(found)
    done = run(SCRIPT, str(tmp_path))
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "ROS 1 set-up: this needs apt: ROS 1 is packaged for Debian 12 and Ubuntu 22.04, and their relatives"
    ]


@pytest.mark.skipif(not (shutil.which("apt-get") and shutil.which("dpkg-query")), reason="no apt on this system")
def test_without_an_environment_it_says_what_makes_one(tmp_path: Path) -> None:
    (tmp_path / "scripts").mkdir()
    script = shutil.copy(SCRIPT, tmp_path / "scripts")
    done = run(Path(script), os.environ["PATH"])
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["ROS 1 set-up: there is no .venv yet: run make ros1, which makes it"]
