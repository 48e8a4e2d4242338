"""What somebody has who installs the wheel, with no checkout beside it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
UV = Path(sys.executable).with_name("uv")

pytestmark = [
    pytest.mark.exhaustive,
    pytest.mark.slow,
    pytest.mark.skipif(not UV.exists(), reason="there is no uv: scripts/setup installs it"),
]


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a fresh environment in which the wheel and what it needs to run are installed."""
    folder = tmp_path_factory.mktemp("wheel")
    run(UV, "build", "--quiet", "--wheel", "--no-build-isolation", "--out-dir", folder, REPOSITORY)
    run(UV, "venv", "--quiet", "--python", sys.executable, folder / "env")
    python = folder / "env/bin/python"
    run(UV, "pip", "install", "--quiet", "--python", python, "--requirement", REPOSITORY / "requirements.txt")
    run(UV, "pip", "install", "--quiet", "--python", python, "--no-deps", *folder.glob("handsteer-*.whl"))
    return folder / "env"


def run(*command: object, cwd: Path | None = None) -> str:
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(list(map(str, command)), env=env, capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_drives_and_finds_its_models(environment: Path, tmp_path: Path) -> None:
    words = ("--headless", "--fast", "--camera", "virtual", "--duration", "4", "--json")
    script = ("--virtual-hand.script", "Forward:3 Stop:600", "--camera.width", "320", "--camera.height", "240")
    summary = run(environment / "bin/handsteer", "run", *words, *script, cwd=tmp_path)
    assert '"Forward"' in summary
    where = run(environment / "bin/python", "-c", "import handsteer; print(handsteer.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(environment)


def test_it_has_the_packages_of_ros(environment: Path, tmp_path: Path) -> None:
    ros = Path(run(environment / "bin/handsteer", "ros", cwd=tmp_path).strip())
    assert ros.is_relative_to(environment)
    for part in ("setup.sh", "my_cam/launch/my_cam.launch", "handsteer_ros2/package.xml"):
        assert (ros / part).is_file()
    for program in ("handsteer_node", "my_cam/scripts/image_publisher.py"):
        assert os.access(ros / program, os.X_OK)
    assert "camera" in run(ros / "handsteer_node", "camera", "--help", cwd=tmp_path)
