import contextlib
import json
import os
import pty
import shutil
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from handsteer.cli import main
from handsteer.plugins.bench import verb
from handsteer.plugins.bench.cells import Cell, CellResult
from handsteer.plugins.bench.courses import COURSES
from handsteer.plugins.bench.laps import INTERFACES, Conditions, Lap
from handsteer.plugins.bench.verb import bench_table


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main(["bench", *words])
    output = capsys.readouterr()
    return int(end.value.code or 0), output.out, output.err


def test_a_table_json_and_plots(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file, plots = tmp_path / "laps.json", tmp_path / "plots"
    options = ("--course", "stop-line", "--interface", "pad", "--seeds", "2", "--jobs", "1")
    code, out, err = run(capsys, *options, "--json", str(file), "--plots", str(plots))
    lines = out.splitlines()
    assert (code, lines[0], lines[3].split()[0]) == (0, "stop-line, 2 laps each", "pad")
    assert "%|" not in err, "there is no bar where nobody looks"
    assert [len(cell["laps"]) for cell in json.loads(file.read_text())] == [2]
    assert {path.name for path in plots.iterdir()} == {"stop-line-times.png", "stop-line-laps.png"}
    assert str(plots / "stop-line-laps.png") in err


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pgrep") is None, reason="pgrep is not installed")
@pytest.mark.parametrize("moment_s", [0.0, 0.1, 0.3, 1.5])
def test_ctrl_c_while_the_processes_start_is_said_by_no_traceback(moment_s: float) -> None:
    command = [sys.executable, "-m", "handsteer", "bench", "--course", "stop-line", "--seeds", "50", "--jobs", "2"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        started = ["pgrep", "-g", str(process.pid), "-f", "spawn_main"]
        while process.poll() is None and subprocess.run(started, capture_output=True, check=False).returncode:
            time.sleep(0.01)
        time.sleep(moment_s)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        _, said = process.communicate()
    assert "Traceback" not in said
    assert process.returncode == 130


def test_a_sweep_has_a_row_for_each_value(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    options = ("--course", "stop-line", "--interface", "pad", "--seeds", "1", "--jobs", "1")
    code, out, _ = run(capsys, *options, "--sweep", "latency=0,250", "--plots", str(tmp_path))
    assert code == 0
    assert [line.split()[1] for line in out.splitlines()[3:5]] == ["-", "+250"]
    assert [path.name for path in tmp_path.iterdir()] == ["stop-line-latency.png"]


def test_the_table_fits_a_terminal_and_its_words_are_explained() -> None:
    laps = [Lap(seed, False, 180.0, 10, 10, 10, 10.00, 1.234, 1.234, 100.0, 1.0) for seed in range(2)]
    conditions = [Conditions(), Conditions(through="pictures"), Conditions(latency_s=0.25), Conditions(reaction_s=0.4)]
    cells = [Cell("warehouse", name, each) for name in INTERFACES for each in conditions]
    lines = bench_table([CellResult(cell, tuple(laps)) for cell in cells]).splitlines()
    assert max(map(len, lines)) <= 100
    explained = {line.split()[0] for line in lines[-12:] if line}
    assert set(lines[2].split()) - {"interface", "conditions"} <= explained


def test_a_terminal_shows_how_much_is_left() -> None:
    words = ["bench", "--course", "stop-line", "--interface", "pad", "--seeds", "2", "--jobs", "1"]
    screen, end = pty.openpty()
    termios.tcsetwinsize(end, (24, 100))
    with subprocess.Popen(
        [sys.executable, "-m", "handsteer", *words], stdout=subprocess.DEVNULL, stderr=end, stdin=subprocess.DEVNULL
    ) as process:
        os.close(end)
        shown = b""
        with contextlib.suppress(OSError):  # the terminal's end
            while part := os.read(screen, 4096):
                shown += part
        assert process.wait() == 0
    os.close(screen)
    assert b"2 of 2 laps, 00:00 left" in shown


def test_the_default_is_short_and_all_is_more(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[set[str], int]] = []

    def note(cells: list[Cell], seeds: range, *_: object) -> list[CellResult]:
        asked.append(({cell.course for cell in cells}, len(seeds)))
        return []

    monkeypatch.setattr(verb, "_drive", note)
    monkeypatch.setattr(verb, "bench_table", str)
    for options in ({}, {"all": True}, {"all": True, "seeds": 3, "course": ["maze"]}):
        verb.bench(**options)
    assert asked == [({"slalom"}, 5), (set(COURSES), 20), ({"maze"}, 3)]


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


def test_another_kind_of_file_is_not_overwritten(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    recording = tmp_path / "drive.mcap"
    recording.write_bytes(b"\x89MCAP0\r\n")
    code, out, err = run(capsys, "--json", str(recording))
    assert (code, out) == (2, "")
    assert f"--json: {recording} exists, and is not such a file: give another name, or move it away" in err
    assert recording.read_bytes() == b"\x89MCAP0\r\n"
