"""What is said where a package is not installed."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from handsteer.errors import LONGEST_QUOTE, PackageMissing, install_command, needing, quoted

OUTSIDE = (
    "x" * 5000, "\x1b[2J\r\n", "\u202e\ud800", 10**5000, [[[[[[[[1]]]]]]]], {"a": ["y" * 5000] * 50},
    b"\x00" * 5000, None, 0.5,
    json.loads("[" * 500 + "]" * 500),
)  # fmt: skip


@pytest.mark.parametrize("value", OUTSIDE, ids=range(len(OUTSIDE)))
def test_a_value_from_outside_is_quoted_short_and_printable(value: object) -> None:
    assert len(quoted(value)) <= 6 * LONGEST_QUOTE
    assert quoted(value).isprintable()


def test_a_short_value_is_quoted_as_it_is() -> None:
    assert quoted("bax") == "'bax'"
    assert quoted([1.5, "a"]) == "[1.5, 'a']"
    assert len(quoted("a" * 61)) == LONGEST_QUOTE + 2


PIP = f"{sys.executable} -m pip install"
VIRTUAL = ("--camera", "virtual", "--camera.width", "320", "--camera.height", "240", "--duration", "5")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "command", "says"),
    [
        (
            "mujoco",
            ("run", "--headless", *VIRTUAL),
            "the simulated robot needs the package mujoco: run " + PIP + " 'mujoco>=",
        ),
        ("nicegui", ("run", *VIRTUAL), "the page (a run with --headless does without) needs the package nicegui"),
        (
            "websockets",
            ("run", "--headless", "--foxglove", "0", *VIRTUAL),
            "--foxglove needs the package websockets: run " + PIP + " 'websockets>=",
        ),
        ("zenoh", ("zenoh-router",), "the Zenoh router needs the package zenoh: run " + PIP + " 'eclipse-zenoh"),
    ],
)
def test_a_verb_says_what_to_install(module: str, command: tuple[str, ...], says: str) -> None:
    program = f"import sys; sys.modules['{module}'] = None; from handsteer.cli import main; main(sys.argv[1:])"
    done = subprocess.run([sys.executable, "-c", program, *command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def test_what_else_is_missing_is_no_matter_of_an_extra() -> None:
    with pytest.raises(ModuleNotFoundError), needing("the page", "page", "nicegui"):
        import not_of_an_extra  # type: ignore[import-not-found]  # noqa: PLC0415
    with pytest.raises(PackageMissing), needing("the page", "page", "not_of_an_extra"):
        import not_of_an_extra.part  # type: ignore[import-not-found]  # noqa: F401, PLC0415


def test_the_command_to_install_an_extra_fits_this_installation(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert re.fullmatch(rf"{sys.executable} -m pip install 'matplotlib[<>=.\d,]*'", install_command("plots"))
    assert "nicegui" in install_command("page")
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    python, own = tmp_path / "python", tmp_path / "uv"
    monkeypatch.setattr("sys.executable", str(python))
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    assert install_command("plots").startswith(f"{python} -m ensurepip && {python} -m pip install 'matplotlib")
    own.touch(0o755)
    assert install_command("plots").startswith(f"{own} pip install --python {python} 'matplotlib")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert install_command("plots").startswith(f"uv pip install --python {python} 'matplotlib")
    assert install_command("unknown") == "pip install 'handsteer[unknown]'"


@pytest.mark.slow
def test_nothing_but_handsteer_writes_to_standard_error() -> None:
    command = [sys.executable, "-m", "handsteer", "run", "--headless", "--fast", *VIRTUAL]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
