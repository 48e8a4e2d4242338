import re
from dataclasses import replace
from pathlib import Path

import pytest

from handsteer.plugins.study.plan import load_courses, read_plan
from handsteer.plugins.study.results import locked, prepare
from handsteer.plugins.study.session import Session
from tests.cli.test_cli import fails, prints
from tests.plugins.study.plans import PAD, SIGNS, a_task, write
from tests.plugins.study.test_session import do

PLAN = {"participants": 3, "conditions": [SIGNS, PAD], "courses": ["slalom"], "laps": 1}


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write(tmp_path / "mine.yaml", PLAN)


def test_without_a_participant_the_plan_is_checked_and_orders_and_progress_are_printed(
    plan: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = prints(capsys, "study", str(plan)).splitlines()
    assert lines[:2] == ["P01    0 of 9  signs, pad; courses slalom", "P02    0 of 9  pad, signs; courses slalom"]
    assert lines[3] == "note: the conditions' order is balanced for each 2 participants; these are 3"
    assert [path.name for path in plan.parent.iterdir()] == ["mine.yaml"], "nothing is written"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--participant", "P09"], r"there is no participant 'P09' in the plan: choose one of P01, P02, P03"),
        (["--participant", "P01", "--results", "mine.yaml"], r"the results cannot be kept in mine\.yaml: "),
        (["--port", "99999"], r"dashboard\.port: 99999 should be"),
        (["--config", "gone.yaml"], r"cannot read the configuration gone\.yaml"),
    ],
)
def test_a_wrong_option_ends_with_a_message(
    arguments: list[str], message: str, plan: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert re.search(message, fails(capsys, "study", str(plan), *arguments))


def test_two_studies_do_not_write_to_one_folder(plan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = plan.parent / "out"
    prepare(results)
    with locked(results):
        said = fails(capsys, "study", str(plan), "--participant", "P01", "--results", "out")
    assert said.endswith("another study writes its results to out: end it first")


def test_a_wrong_plan_ends_with_file_field_and_what_would_be_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "mine.yaml", {**PLAN, "conditions": [{"name": "a", "input": "feet"}]})
    said = fails(capsys, "study", str(path))
    assert said.startswith(f"{path}: conditions.0.input: 'feet' should be 'hand', 'pad', 'keys', 'sliders'")
    assert fails(capsys, "study", str(tmp_path / "gone.yaml")).startswith("cannot read the plan ")


def test_who_has_done_everything_is_not_led_again(plan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    the_plan = read_plan(plan)
    folder = plan.parent / "mine-results"
    folder.mkdir()
    session = Session(replace(a_task(folder, the_plan), courses=load_courses(the_plan, plan)))
    session.agree()
    session.go_on()
    assert "P01    1 of 9" in prints(capsys, "study", str(plan))
    while session.step.kind != "thanks":
        if session.step.kind == "lap":
            session.begin_lap("me", 0.0)
            session.end_lap("given_up")
        else:
            do(session)
    said = fails(capsys, "study", str(plan), "--participant", "P01")
    assert said == f"P01 has done all of {plan}: the results are in mine-results"
