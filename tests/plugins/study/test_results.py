import csv
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handsteer.config import Config
from handsteer.errors import StudyError
from handsteer.plugins.study.order import Step
from handsteer.plugins.study.results import FORM_COLUMNS, LAP_COLUMNS, Results, prepare
from tests.processes import eventually

ANY_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def lap(number: int, **changes: object) -> dict[str, object]:
    row = {"participant": "P01", "order": 1, "condition": "pad", "course": 'a, "b"', "practice": 0, "lap": number}
    return {**row, "outcome": "finished", "plan": "abc", "started_utc": "2026-11-22T18:00:00Z", **changes}


def step(number: int) -> Step:
    return Step("lap", 1, "pad", 'a, "b"', False, number)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_rows_are_appended_under_one_header_and_are_read_again(tmp_path: Path) -> None:
    results = Results(tmp_path)
    results.add_lap(lap(1))
    Results(tmp_path).add_lap(lap(2))
    results.add_form({"participant": "P01", "form": "consent", "plan": "abc"})
    results.add_form({"participant": "P01", "order": 1, "condition": "pad", "form": "tlx", "plan": "abc"})
    assert (tmp_path / "laps.csv").read_bytes().count(b"participant") == 1
    assert [row["course"] for row in rows(tmp_path / "laps.csv")] == ['a, "b"'] * 2
    assert tuple(rows(tmp_path / "laps.csv")[0]) == LAP_COLUMNS
    assert tuple(rows(tmp_path / "forms.csv")[0]) == FORM_COLUMNS
    done = Results(tmp_path).done("P01", "abc")
    assert done == {step(1), step(2), Step("consent"), Step("form", 1, "pad", form="tlx")}
    assert Results(tmp_path).done("P02", "abc") == set()


def test_a_lap_that_did_not_count_is_to_be_driven_again(tmp_path: Path) -> None:
    results = Results(tmp_path)
    results.add_lap(lap(1, outcome="repeated"))
    assert Results(tmp_path).done("P01", "abc") == set()


def test_rows_of_another_plan_are_refused(tmp_path: Path) -> None:
    Results(tmp_path).add_lap(lap(1))
    with pytest.raises(StudyError, match=r"laps\.csv, line 2: P01 began with another plan"):
        Results(tmp_path).done("P01", "abd")


def test_the_configuration_is_kept_once(tmp_path: Path) -> None:
    results = Results(tmp_path)
    name = results.keep_config(Config())
    assert results.keep_config(Config()) == name
    assert Config.model_validate_json((tmp_path / f"config-{name}.json").read_text()) == Config()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a,b\n1,2\n", r"laps\.csv: has other columns than this version writes"),
        (b"a,b\n1,2", r"laps\.csv: has other columns than this version writes"),
        (",".join(LAP_COLUMNS).encode() + b"\r\n1,2\r\n", r"laps\.csv, line 2: has 2 values instead of"),
        (b"\xff\xfe\n", r"laps\.csv: is not a CSV file in UTF-8"),
        (",".join(LAP_COLUMNS).encode() + b'\r\n"a\r\n', r"laps\.csv: is not a CSV file"),
    ],
)
def test_a_file_of_others_is_refused_and_left_alone(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "laps.csv").write_bytes(content)
    with pytest.raises(StudyError, match=message):
        Results(tmp_path)
    assert (tmp_path / "laps.csv").read_bytes() == content


def test_a_row_that_makes_no_sense_is_named(tmp_path: Path) -> None:
    Results(tmp_path).add_lap(lap(1, practice="maybe"))
    with pytest.raises(StudyError, match=r"laps\.csv, line 2: is not a row that handsteer has written"):
        Results(tmp_path).done("P01", "abc")


def test_a_folder_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match=r"cannot be kept in .*file: "):
        prepare(tmp_path / "file")
    with pytest.raises(StudyError, match=r"cannot write .*laps\.csv"):
        Results(tmp_path / "gone").add_lap(lap(1))
    (tmp_path / "laps.csv").mkdir()
    with pytest.raises(StudyError, match=r"cannot use .*laps\.csv"):
        Results(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files")
def test_a_row_for_which_the_disk_has_no_room_leaves_no_trace(tmp_path: Path) -> None:
    import resource  # noqa: PLC0415 - not on Windows

    results = Results(tmp_path)
    results.add_lap(lap(1))
    before = (tmp_path / "laps.csv").read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 10, limits[1]))
    try:
        with pytest.raises(StudyError, match=r"cannot write .*laps\.csv: No space left"):
            results.add_lap(lap(2))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (tmp_path / "laps.csv").read_bytes() == before
    results.add_lap(lap(2))
    assert Results(tmp_path).done("P01", "abc") == {step(1), step(2)}


@ANY_FOLDER
@given(count=st.integers(0, 3), cut=st.integers(1, 400))
def test_wherever_a_file_was_cut_off_its_whole_rows_remain(
    count: int, cut: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "laps.csv"
    path.unlink(missing_ok=True)
    results = Results(tmp_path)
    for number in range(count + 1):
        results.add_lap(lap(number))
    data = path.read_bytes()[:-cut]
    path.write_bytes(data)
    caplog.clear()
    ends = data.endswith((b"Z", b"Z\r"))  # of the last row, only the end of its line is missing
    whole = max(0, data.count(b"\n") - 1 + ends)
    mended = Results(tmp_path)
    assert mended.done("P01", "abc") == {step(number) for number in range(whole)}
    assert bool(caplog.records) == (not data.endswith(b"\n") and data != b"" and not ends)
    mended.add_lap(lap(7))
    assert [int(row["lap"]) for row in rows(path)] == [*range(whole), 7]


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["plain", "with a byte order mark"])
def test_a_file_that_an_editor_has_saved_without_its_last_end_of_line_goes_on(mark: bytes, tmp_path: Path) -> None:
    path = tmp_path / "laps.csv"
    for number in (1, 2):
        Results(tmp_path).add_lap(lap(number))
    path.write_bytes(mark + path.read_bytes().replace(b"\r\n", b"\n").rstrip())
    Results(tmp_path).add_lap(lap(3))
    assert Results(tmp_path).done("P01", "abc") == {step(1), step(2), step(3)}


@ANY_FOLDER
@given(data=st.binary(max_size=200) | st.text(max_size=200).map(str.encode), has_header=st.booleans())
def test_any_file_is_read_or_refused_with_a_message(data: bytes, has_header: bool, tmp_path: Path) -> None:
    header = ",".join(LAP_COLUMNS).encode() + b"\r\n"
    (tmp_path / "laps.csv").write_bytes((header if has_header else b"") + data)
    message = "laps.csv"
    try:
        Results(tmp_path).done("P01", "abc")
    except StudyError as error:
        message = str(error)
    assert "laps.csv" in message


@ANY_FOLDER
@given(text=st.text(max_size=20).filter(lambda text: "\x00" not in text))
def test_any_text_in_a_row_is_read_as_it_was_written(text: str, tmp_path: Path) -> None:
    (tmp_path / "laps.csv").unlink(missing_ok=True)
    name = " ".join(text.encode("utf-8", "replace").decode().split())
    Results(tmp_path).add_lap(lap(1, course=name))
    assert {each.course for each in Results(tmp_path).done("P01", "abc")} == {name}


WRITER = """
import sys
from pathlib import Path
from handsteer.plugins.study.results import Results
from tests.plugins.study.test_results import lap
results = Results(Path(sys.argv[1]))
for number in range(int(sys.argv[2]), 10**9):
    results.add_lap(lap(number))
    print(number, flush=True)
"""


@pytest.mark.slow
def test_what_a_killed_process_had_written_is_there_and_continues(tmp_path: Path) -> None:
    first = 0
    for _ in range(3):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), str(first)], stdout=subprocess.PIPE, text=True
        ) as writer:
            assert writer.stdout is not None
            said = [int(writer.stdout.readline()) for _ in range(20)]
            writer.send_signal(signal.SIGKILL)
            said += [int(line) for line in writer.stdout if line.endswith("\n")]
        eventually(lambda: writer.poll() is not None)
        done = {each.lap for each in Results(tmp_path).done("P01", "abc")}
        assert done >= set(said), "what was reported as written is on the disk"
        assert done == set(range(max(done) + 1)), "no row is missing"
        first = max(done) + 1
    numbers = [int(row["lap"]) for row in rows(tmp_path / "laps.csv")]
    assert numbers == [*range(len(numbers))], "no row is there twice"
