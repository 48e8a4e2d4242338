import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.cli import main
from tests.processes import eventually

VIRTUAL = ["--camera", "virtual", "--camera.width", "320", "--camera.height", "240"]


def run_cli(*arguments: str) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, "-m", "handsteer", *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    return done.returncode, done.stdout, done.stderr


def fails(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run in this process; return the one line that it says before it exits with 2."""
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = [line for line in captured.err.splitlines() if line.startswith("handsteer: ")]
    assert len(lines) == 1, captured.err
    return lines[0].removeprefix("handsteer: ")


def prints(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    assert caught.value.code == code
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["run", "--camera", "gone.mp4"],
            r"there is no camera gone\.mp4: give auto, virtual, browser, a webcam",
        ),
        (["run", "--camera", "97"], r"there is no webcam /dev/video97: "),
        (["run", "--camera", __file__], r"test_cli\.py is not a video that can be decoded: try an mp4"),
        (["run", "--camera", str(Path(__file__).parent)], r"there are no photos in "),
        (["run", "--camera", "rtsp://127.0.0.1:9/x"], r"no picture comes from rtsp://127\.0\.0\.1:9/x"),
        (["run", "--world", "moon"], r"moon.*obstacles"),
        (["run", "--robot", "tank"], r"--robot: there is no 'tank': give sim, auto, ros2, dds, zenoh, ros1, generic, "),
        (["run", "--camera", ""], r"there is no camera '': give auto, virtual"),
        (["run", "--robot", "turtlbot4"], r"there is no 'turtlbot4': did you mean turtlebot4\?"),
        (["run", "--port", "99999"], r"dashboard\.port: 99999 should be less than or equal to 65535"),
        (["run", "--control.linear-step", "7"], r"control\.linear_step: '7' should be less than or equal to 1"),
        (["run", "--camera.fps", "quick"], r"camera\.fps: 'quick' should be a valid number"),
        (["run", "--duration", "0"], r"--duration: 0 should be greater than 0"),
        (["run", "--duration", "x"], r"^--duration: \"x\" should be a number; see handsteer run --help$"),
        (["run", "--port", "x"], r"^--port: \"x\" should be a whole number; see handsteer run --help$"),
        (
            ["run", "--port", "80.5", "--duration", "0"],
            r"^--port: \"80\.5\" should be a whole number; see handsteer run --help$",
        ),
        (
            ["run", "--foxglove", "8.5", "--duration", "0"],
            r"^--foxglove: \"8\.5\" should be a whole number; see handsteer run --help$",
        ),
        (["robots", "two", "--transport", "dds"], r"^COUNT: \"two\" should be a whole number; see handsteer robots"),
        (["robots", "3.5", "--transport", "smoke"], r"^COUNT: \"3\.5\" should be a whole number; see handsteer robots"),
        (["bench", "--seeds", "1.5", "--jobs", "0"], r"^--seeds: \"1\.5\" should be a whole number"),
        (["bench", "--first-seed", "1.5", "--seeds", "0"], r"^--first-seed: \"1\.5\" should be a whole number"),
        (["bench", "--jobs", "1.5", "--seeds", "0"], r"^--jobs: \"1\.5\" should be a whole number"),
        (["signs", "collect", "--takes", "2.5", "--camera", ""], r"^--takes: \"2\.5\" should be a whole number"),
        (["run", "--page.port", "9000"], r"no option --page\.port: did you mean --dashboard\.port\?$"),
        (["run", "--page.colour", "9000"], r"no option --page\.colour"),
        (["run", "--duration", "nan"], r"--duration: nan should be greater than 0"),
        (["run", "--config", "gone.yaml"], r"cannot read the configuration gone\.yaml: No such file"),
        (["run", "--camera", "virtual", "--virtual-hand.script", "Wave:2"], r"Wave"),
        (["run", "--colour", "red"], r"Unknown option: --colour"),
        (["run", "--headles"], r"Unknown option: --headles\. Did you mean --headless\? See handsteer run --help"),
        (["run", "--max-linear", "1"], r"Did you mean --control\.max-linear or --robot\.max-linear\?"),
        (["run", "--control.max-liner", "1"], r"no option --control\.max-liner: did you mean --control\.max-linear\?"),
        (["run", "--control.colour", "1"], r"no option --control\.colour: handsteer parameters control lists all"),
        (["run", "--contrl.max-linear", "1"], r"no option --contrl\.max-linear: did you mean --control\.max-linear\?"),
        (["run", "--control.max-linear"], r"--control\.max-linear needs a value"),
        (["run", "--control.max-linear", "--fast"], r"--control\.max-linear needs a value"),
        (["run", "--control.max-linear=1", "--control.max-linear=2"], r"--control\.max-linear is given twice"),
        (["run", "--control.actions", "turbo"], r"expected the form --control\.actions\.Peace turbo"),
        (["run", "--control.mode", "joystik"], r"'signs' or 'joystick': did you mean joystick\?"),
        (["run", "--robot.preset", "turtlbot4"], r"robot\.preset: 'turtlbot4' .*: did you mean turtlebot4\?"),
        (["run", "--world", "obstacle"], r"obstacle.*did you mean obstacles\?"),
        (["recognize", "gone.jpg"], r"there is no gone\.jpg: give a photo, a folder of photos or a video file"),
        (["recognize", str(__file__), "gone.jpg"], r"there is no gone\.jpg: give a photo"),
        (["recognize", str(__file__), "--jsno"], r"Unknown option: --jsno\. Did you mean --json"),
        (["parameters", "signs", "a.yaml", "b.yaml"], r'unexpected argument "a\.yaml" and 1 more; see handsteer param'),
        (["camera"], r"--transport requires an argument"),
        (["control", "--transport", "pigeon"], r"there is no transport 'pigeon': use dds or ros1"),
        (["control", "--transport", "ros1", "--config", "gone.yaml"], r"cannot read the configuration gone\.yaml"),
        (["dance"], r'Unknown command "dance": the commands are run, recognize, .*robots, bench, '),
        (["recogize"], r'Unknown command "recogize": did you mean recognize\? the commands'),
        (["signs", "colect"], r'Unknown command "colect": did you mean collect\?'),
        (["doctor", "--control.mode", "signs"], r"doctor takes no parameters"),
        (["signs", "train", "--dataset", "d.npz"], r"Unknown option: --dataset; see handsteer signs train --help"),
        (["signs", "train", "--teach.dataset", "d"], r"signs train takes no param.*; see handsteer signs train --help"),
        (["doctor", "--port", "99999"], r"port 99999 should be from 0 to 65535"),
        (["recognize", f"{'x' * 300}.jpg"], r"cannot use 'x+\.\.\.': File name too long"),
        (["signs", "evaluate", "x" * 300], r"cannot use 'x+\.\.\.': File name too long"),
        (["run", "--world", "x" * 300], r"cannot use 'x+\.\.\.': File name too long"),
        (["control", "--transport", "zeno"], r"there is no transport 'zeno': did you mean zenoh\?"),
        (["parameters", "max_liner"], r"no parameter is called max_liner: did you mean max_linear\?"),
    ],
    ids=lambda value: " ".join(value[:3]) if isinstance(value, list) else None,
)
def test_bad_input_gets_one_line_and_code_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    said = fails(capsys, *arguments, *(["--headless"] if arguments[0] == "run" else []))
    assert re.search(message, said), said


def test_a_missing_model_says_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    assert "handsteer models" in fails(capsys, "run", "--headless", "--camera", "virtual")


@pytest.mark.slow
def test_a_port_in_use_names_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        said = fails(capsys, "run", *VIRTUAL, "--port", port, "--dashboard.no-open-browser", "--duration", "1")
    assert port in said
    assert "--port" in said


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\n", prints(capsys, "--version"))
    verbs = ["run", "recognize", "models", "doctor", "camera", "recognition", "control", "robot", "steering"]
    for verb in ([], *([verb] for verb in verbs)):
        assert "handsteer " + (verb[0] if verb else "run") in prints(capsys, *verb, "--help").replace("Usage: ", "")


def test_a_headless_run_prints_one_json_summary(capsys: pytest.CaptureFixture[str]) -> None:
    summary = json.loads(prints(capsys, "run", "--headless", *VIRTUAL, "--duration", "5", "--json"))
    assert summary["frames"] > 5
    assert summary["latency_p99_ms"] > 0
    assert {"fps", "latency_median_ms", "signs", "final_pose", "path_length_m", "contacts"} <= set(summary)


def test_a_run_reads_the_file_that_the_page_saves_to_unless_another_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other.yaml").write_text("robot: {world: warehouse}")
    arguments = ["run", "--fast", "--duration", "0.1", *VIRTUAL]
    Path("handsteer.yaml").write_text("control: {linear_step: 7}")
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    said = capsys.readouterr().err
    assert f"parameters from {tmp_path / 'handsteer.yaml'}" in said
    assert re.search(r"handsteer\.yaml, line 1: control\.linear_step: 7 should be less than or equal to 1", said)
    prints(capsys, *arguments, "--config", "other.yaml")
    Path("handsteer.yaml").write_text("")  # as saved, when all is as by default
    prints(capsys, *arguments)


@pytest.mark.slow
def test_a_fast_run_takes_the_same_way_each_time(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["run", "--fast", *VIRTUAL, "--duration", "2", "--json"]
    assert prints(capsys, *arguments) == prints(capsys, *arguments)


@pytest.mark.slow
def test_a_file_plays_once_in_a_headless_run(capsys: pytest.CaptureFixture[str], slideshow: Path) -> None:
    summary = json.loads(prints(capsys, "run", "--headless", "--camera", str(slideshow), "--json"))
    assert summary["frames"] == 270
    assert 22.0 < summary["duration_s"] < 45.0  # as long as the video, or more where the machine is busy
    assert sum(summary["signs"].values()) > 0  # how many is a matter of the machine's speed: --fast leaves none out


@pytest.mark.slow
def test_recognize_prints_a_line_a_frame(capsys: pytest.CaptureFixture[str], slideshow: Path) -> None:
    with pytest.raises(SystemExit):
        main(["recognize", str(slideshow), "--json"])
    captured = capsys.readouterr()
    assert re.search(r"270 frames in [\d.]+ s, \d+ per second: .*Stop \d+%", captured.err)
    lines = [json.loads(line) for line in captured.out.splitlines()]
    assert [line["frame"] for line in lines] == list(range(270))
    assert lines[-1]["time_s"] == pytest.approx(269 / 12)
    assert {line["sign"] for line in lines} >= {"NONE", "Stop", "Forward", "Go", "Turn Right", "Turn Left"}
    assert len(lines[40]["landmarks"]) == 21


def test_recognize_a_photo(capsys: pytest.CaptureFixture[str], data_dir: Path) -> None:
    photo = sorted((data_dir / "photos" / "stop").glob("emre*"))[0]
    assert "Stop" in prints(capsys, "recognize", str(photo))


def test_recognize_several_photos_and_folders(
    capsys: pytest.CaptureFixture[str], data_dir: Path, tmp_path: Path
) -> None:
    photos = [sorted((data_dir / "photos" / sign).glob("emre*"))[0] for sign in ("go", "stop")]
    (tmp_path / photos[1].name).write_bytes(photos[1].read_bytes())
    lines = prints(capsys, "recognize", str(photos[0]), str(tmp_path)).splitlines()
    assert [re.split(r"\s{2,}", line)[3] for line in lines] == ["Go", "Stop"]


def test_a_photo_that_cannot_be_a_frame_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "thin.png"), np.zeros((1, 40_000, 3), np.uint8))
    with pytest.raises(SystemExit):
        main(["recognize", str(tmp_path)])
    assert re.search(r"thin\.png: .*40000x1", capsys.readouterr().err)


def test_doctor_finds_what_is_missing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    findings = {finding["name"]: finding for finding in json.loads(prints(capsys, "doctor", "--json", code=1))}
    assert findings["models"]["verdict"] == "missing"
    assert "handsteer models" in findings["models"]["detail"]
    assert findings["python"]["verdict"] == "ok"
    assert {"camera", "port", "ros 1", "ros 2", "gl"} <= set(findings)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("in_background", [False, True], ids=["foreground", "background"])
def test_a_signal_ends_within_two_seconds_with_the_robot_stopped(number: signal.Signals, in_background: bool) -> None:
    """A shell lets its background jobs ignore SIGINT."""
    shell = ["env", f"--{'ignore' if in_background else 'default'}-signal=INT"]
    code, out, err, took_s = interrupted_run(number, through=shell)
    assert code == 0, err
    assert "stopping the robot" in err
    assert json.loads(out)["frames"] > 5
    assert took_s < 2.0


@pytest.mark.slow
def test_signals_right_behind_one_another_end_it_as_one_does() -> None:
    code, out, err, _ = interrupted_run(*[signal.SIGINT, signal.SIGTERM] * 5)
    assert code == 0, err
    assert "Traceback" not in err
    assert json.loads(out)["frames"] > 5


def interrupted_run(*numbers: signal.Signals, through: Sequence[str] = ()) -> tuple[int, str, str, float]:
    """Send signals to a run that drives; return its exit code, its output and errors, and how long it took to end."""
    run = [sys.executable, "-m", "handsteer", "run", "--headless", *VIRTUAL, "--json", "--record"]
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "drive.mcap"
        command = [*through, *run, str(recording)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            try:
                eventually(lambda: recording.exists() and recording.stat().st_size > 300_000, what="pictures")
                began_s = time.monotonic()
                for number in numbers:
                    process.send_signal(number)
                out, err = process.communicate(timeout=20)
            finally:
                process.kill()
            return process.returncode, out, err, time.monotonic() - began_s


def piped(words: str, reader: str) -> tuple[int, str, str]:
    """Return the exit code of ``handsteer`` with these words, what its reader prints, and its errors."""
    command = f"{sys.executable} -m handsteer {words} | {reader}; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_a_reader_that_leaves_is_no_error(data_dir: Path) -> None:
    code, out, err = piped(f"recognize {data_dir}/photos/stop", "head -n 1")
    assert code in (0, 141)  # it may have written all before the reader leaves
    assert "Traceback" not in err
    assert os.linesep in out


def test_output_that_has_no_reader_is_no_success() -> None:
    assert piped("parameters", "true") == (141, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device on this system")
@pytest.mark.parametrize("words", ["parameters", "signs list --json", "--help", "completion bash"])
def test_output_that_cannot_be_written_is_one_line(words: str) -> None:
    command = f"{sys.executable} -m handsteer {words} > /dev/full"
    done = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "handsteer: cannot write the output: No space left on device\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device on this system")
@pytest.mark.parametrize("words", ["replay missing.mcap", "signs list --json > /dev/full"])
def test_an_error_that_cannot_be_written_keeps_its_exit_code(words: str) -> None:
    command = f"{sys.executable} -m handsteer {words} 2> /dev/full"
    assert subprocess.run(command, shell=True, check=False).returncode == 2


def test_output_for_a_terminal_of_ascii_only_is_printed() -> None:
    command = [sys.executable, "-m", "handsteer", "parameters", "control"]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "--control.max-linear" in done.stdout


@pytest.mark.parametrize(("arguments", "words"), [(["--help"], "Drive the robot"), (["signs"], "Learn the signs of")])
def test_help_says_what_each_verb_does(capsys: pytest.CaptureFixture[str], arguments: list[str], words: str) -> None:
    assert words in prints(capsys, *arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot", "hal"], "--robot: there is no 'hal': give sim, auto, ros2, dds, zenoh, ros1, generic, "),
        (["--robot", "dds", "--fast"], "--fast runs on simulated time, which a real robot (robot.kind dds) does not"),
        (["--ros-args", "-r", "a:=b"], "'--ros-args': ROS arguments need a robot in a graph of ROS"),
        (["--control.cmd-vel-type=twist", "--robot.cmd-vel-type=twist_stamped"], "control.cmd_vel_type is twist and"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_cannot_be_with_a_robot_is_said(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert fails(capsys, "run", "--headless", *VIRTUAL, *arguments).startswith(message)


def test_a_run_drives_one_robot(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "my.yaml"
    file.write_text("control: {robots: [r1, r2]}")
    assert "a run drives one robot" in fails(capsys, "run", "--headless", *VIRTUAL, "--config", str(file))


def test_how_many_robots_there_can_be(capsys: pytest.CaptureFixture[str]) -> None:
    assert fails(capsys, "robots", "0", "--transport", "dds") == "0 robots: there should be 1 to 30"
    assert "there is no transport 'smoke'" in fails(capsys, "robots", "1", "--transport", "smoke")
