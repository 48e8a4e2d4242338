import json
from pathlib import Path

import pytest

from handsteer.cli import main


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main(["bench", *words])
    output = capsys.readouterr()
    return int(end.value.code or 0), output.out, output.err


def test_a_table_json_and_plots(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file, plots = tmp_path / "laps.json", tmp_path / "plots"
    options = ("--course", "stop-line", "--interface", "pad", "--seeds", "2", "--jobs", "1")
    code, out, err = run(capsys, *options, "--json", str(file), "--plots", str(plots))
    assert (code, out.splitlines()[1].split()[:2]) == (0, ["stop-line", "pad"])
    assert [len(cell["laps"]) for cell in json.loads(file.read_text())] == [2]
    assert {path.name for path in plots.iterdir()} == {"stop-line-times.png", "stop-line-laps.png"}
    assert str(plots / "stop-line-laps.png") in err


def test_a_sweep_has_a_row_for_each_value(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    options = ("--course", "stop-line", "--interface", "pad", "--seeds", "1", "--jobs", "1")
    code, out, _ = run(capsys, *options, "--sweep", "latency=0,250", "--plots", str(tmp_path))
    assert code == 0
    assert [line.split()[2] for line in out.splitlines()[1:]] == ["-", "+250"]
    assert [path.name for path in tmp_path.iterdir()] == ["stop-line-latency.png"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--course", "nowhere"), "no world 'nowhere'"),
        (("--course", "empty"), "'empty' is not a course"),
        (("--interface", "thoughts"), "no interface 'thoughts'"),
        (("--seeds", "0"), "--seeds: 0 should be"),
        (("--jobs", "0"), "--jobs: 0 should be"),
        (("--latency", "-1"), "latency in ms: -1 should be from 0 to 5000"),
        (("--sweep", "speed=1"), "factors: latency, fps, errors, reaction"),
        (("--json", "/nowhere/laps.json"), "there is no folder /nowhere"),
    ],
)
def test_wrong_options_end_with_code_2(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert message in err
