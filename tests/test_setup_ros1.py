"""What the ROS 1 set-up says where it cannot work; that it works is what all tests marked ros1 stand on."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "setup-ros1"

APT_GET = """#!/bin/sh
echo "$*" >> "$HERE/said"
[ "$1" = update ] || exit 1
[ "$(wc -l < "$HERE/said")" -gt 2 ] && exit 0
echo "E: Could not get lock /var/lib/apt/lists/lock. It is held by process 7 (apt-get)" >&2
exit 100
"""

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
        "ROS 1 set-up: this needs apt: ROS 1 is packaged for Debian 12 and Ubuntu 22.04, and their derivatives"
    ]


@pytest.mark.skipif(not (shutil.which("apt-get") and shutil.which("dpkg-query")), reason="no apt on this system")
def test_without_an_environment_it_says_what_makes_one(tmp_path: Path) -> None:
    (tmp_path / "scripts").mkdir()
    script = shutil.copy(SCRIPT, tmp_path / "scripts")
    done = run(Path(script), os.environ["PATH"])
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["ROS 1 set-up: there is no .venv yet: run make ros1, which creates it"]


def test_it_waits_while_another_apt_is_at_work(tmp_path: Path) -> None:
    """With an apt-get that is locked twice, and then cannot install; nothing of the machine is touched."""
    programs = {
        "apt-get": APT_GET,
        "apt-cache": "#!/bin/sh\necho there\n",
        "dpkg-query": "#!/bin/sh\nexit 1\n",
        "id": "#!/bin/sh\necho 0\n",
        "sleep": "#!/bin/sh\n",
    }
    for name, text in programs.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    root = tmp_path / "root"
    (root / "scripts").mkdir(parents=True)
    (root / ".venv/bin").mkdir(parents=True)
    (root / ".venv/bin/python").symlink_to("/bin/true")
    shutil.copy(SCRIPT, root / "scripts")
    env = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "HERE": str(tmp_path)}
    done = subprocess.run(
        [root / "scripts/setup-ros1"], env=env, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    )
    said = (tmp_path / "said").read_text().splitlines()
    assert said[:3] == ["update -qq"] * 3
    assert "DPkg::Lock::Timeout" in said[3]
    assert "install" in said[3]
    for package in ("rosservice", "rosmsg", "roswtf", "rosbag"):
        assert f"python3-{package}" in said[3]
    assert done.stderr.count("waiting for another apt process") == 1
    assert done.returncode == 2
