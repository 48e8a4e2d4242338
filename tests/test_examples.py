import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("[0-9]*.py"))
SAYS = {
    "01_recognize_a_sign": ["Turn Left", "right hand"],
    "02_drive_from_code": ["'Forward'", "the robot is at x"],
    "03_add_a_node": ["Forward", "Backward", "m/s"],
    "04_let_it_fail": [
        "no pictures arrive for 2 s: the robot stops",
        "a fifth of the commands is lost for 2 s: the robot drives on",
    ],
    "05_teleop_in_your_program": ["disengaged", "driving: Forward", "the robot is at x"],
}


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_says_what_it_shows(
    path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", [str(path)])
    runpy.run_path(str(path), run_name="__main__")
    printed = capsys.readouterr().out
    assert all(words in printed for words in SAYS[path.stem]), printed
