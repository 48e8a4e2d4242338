import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import pytest

from handsteer.cli import main
from handsteer.messages import HAND_SIGN
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.replay.compare import Comparison, compare
from handsteer.plugins.record.replay.rerun import recorded_config, rerun
from tests.cli.test_cli import piped
from tests.processes import Process, eventually
from tests.reasons import check

KILLS = int(os.environ.get("HANDSTEER_KILLS", "3"))
MOST_LOST_S = 1.0


def run(*words: str) -> int:
    """Return the exit code of ``handsteer`` with these words."""
    with pytest.raises(SystemExit) as end:
        main(list(words))
    return int(end.value.code or 0)


def headless(path: Path, *words: str) -> Process:
    """Start a run that records to ``path``."""
    command = [sys.executable, "-m", "handsteer", "run", "--headless", "--camera", "virtual", "--record", str(path)]
    return Process([*command, *words], dict(os.environ), path.with_suffix(".log"))


def wait_for(path: Path) -> None:
    """Wait until a recording has its first pictures."""
    eventually(lambda: path.exists() and path.stat().st_size > 300_000, what="a recording")


@pytest.mark.slow
def test_after_kill_9_all_but_the_last_second_is_read(tmp_path: Path) -> None:
    chance, lost_s = random.Random(1), []
    for number in range(KILLS):
        path = tmp_path / f"{number}.mcap"
        process = headless(path)
        wait_for(path)
        time.sleep(chance.uniform(0.0, 2.0))
        killed_s = time.time()
        process.kill()
        file, comparison = McapFile(path), Comparison()
        last_s = max(recorded.time_s for recorded in file.messages())
        lost_s.append(killed_s - last_s)
        assert list(compare(rerun(file, recorded_config(file)), comparison, file.began_s)) == []
        assert comparison.signs > 0
        check(path)
    assert min(lost_s) < MOST_LOST_S, lost_s  # a busy machine may hold up one of them


@pytest.mark.slow
def test_a_recording_ends_with_ctrl_c_and_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    process = headless(path)
    wait_for(path)
    process.signal(signal.SIGINT)
    assert process.code() == 0, process.text
    file = McapFile(path)
    assert sum(recorded.topic == HAND_SIGN.name for recorded in file.messages()) > 2
    assert file.problem is None
    check(path)


@pytest.mark.slow
def test_a_replay_says_that_all_is_the_same(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("replay", str(recording)) == 0
    assert "241 frames, 241 signs, " in (printed := capsys.readouterr().out)
    assert printed.endswith("; all the same, bit for bit\n")


@pytest.mark.slow
def test_a_replay_whose_reader_leaves_does_not_say_that_all_is_the_same(recording: Path) -> None:
    code, _, err = piped(f"replay {recording} --from signs --control.max-linear 0.1 2>&1", "true")
    assert (code, err) == (141, "")


def test_nothing_is_recorded_over(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = recording.read_bytes()
    assert run("run", "--fast", "--duration", "1", "--record", str(recording)) == 2
    assert f"{recording} exists already" in capsys.readouterr().err
    assert recording.read_bytes() == before


@pytest.mark.slow
def test_a_replay_of_a_damaged_recording_is_no_success(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = bytearray(recording.read_bytes())
    content[len(content) // 2] ^= 0xFF
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(content)
    assert run("replay", str(damaged)) == 2
    assert f"{damaged} is damaged, so only a part of it could be compared" in capsys.readouterr().err
    damaged.write_bytes(recording.read_bytes()[:5000])
    assert run("replay", str(damaged)) == 2
    assert "was cut off or damaged after" in capsys.readouterr().err


@pytest.mark.slow
def test_a_replay_lists_what_differs_with_its_pictures(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("replay", str(recording), "--signs.confirm-time", "0.5", "--diff", str(tmp_path / "differences"))
    assert run(*words, "--json") == 1
    told = json.loads(capsys.readouterr().out)
    pictures = {moment["picture"] for moment in told["moments"] if "picture" in moment}
    assert pictures == {str(path) for path in (tmp_path / "differences").iterdir()}
    assert len(pictures) > 10
    assert told["differing"] == len(told["moments"])
    assert run(*words) == 2
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("replay", "missing.mcap"), "there is no recording missing.mcap"),
        (("replay", "README.md"), "README.md is not an MCAP file"),
        (
            ("run", "--fast", "--duration", "1", "--record", "README.md"),
            "README.md would be an MCAP file: give a name that ends with .mcap",
        ),
        (
            ("run", "--fast", "--duration", "1", "--record", "none/drive.mcap"),
            "cannot record to none/drive.mcap: No such",
        ),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(
    words: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*words) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("handsteer: ")]
    assert lines[-1].startswith(f"handsteer: {says}")
