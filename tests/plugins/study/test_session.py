import csv
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handsteer.errors import StudyError
from handsteer.plugins.study.forms import FORMS
from handsteer.plugins.study.plan import config_hash
from handsteer.plugins.study.results import FORM_COLUMNS, LAP_COLUMNS
from handsteer.plugins.study.session import Session
from handsteer.types import CourseState
from tests.plugins.study.plans import PAD, SIGNS, a_plan, a_task

READY = CourseState(2)
RUNNING = CourseState(2, next_gate=1, phase="running", time_s=1.0)
FINISHED = CourseState(2, next_gate=2, missed=frozenset({0}), bumps=1, phase="finished", time_s=4.25)


def rows(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def drive(session: Session) -> None:
    session.begin_lap("me", 10.0)
    session.note(READY, 0.0, 10.1)
    session.note(RUNNING, 0.5, 12.0)
    assert session.note(FINISHED, 2.5, 15.0) == "finished"


def do(session: Session) -> None:
    """Do the current step."""
    step = session.step
    if step.kind == "consent":
        session.agree()
    elif step.kind == "instructions":
        session.go_on()
    elif step.kind == "lap":
        drive(session)
    elif step.form:
        form = FORMS[step.form]
        session.submit({item.name: form.answers[0] for item in form.items})


def to_first_lap(session: Session) -> Session:
    while session.step.kind != "lap":
        do(session)
    return session


def test_a_participant_is_led_through_all_steps(tmp_path: Path) -> None:
    session = Session(a_task(tmp_path, participant="P02"))
    kinds = []
    while session.step.kind != "thanks":
        kinds.append(session.step.form or session.step.kind)
        do(session)
    assert kinds == ["consent", *(["instructions"] + ["lap"] * 3 + ["tlx", "sus"]) * 2]
    assert session.progress == (11, 11)
    laps, forms = rows(tmp_path / "laps.csv"), rows(tmp_path / "forms.csv")
    assert [(row["condition"], row["order"], row["practice"], row["lap"]) for row in laps] == [
        *(("pad", "1", practice, lap) for practice, lap in (("1", "1"), ("0", "1"), ("0", "2"))),
        *(("signs", "2", practice, lap) for practice, lap in (("1", "1"), ("0", "1"), ("0", "2"))),
    ]
    assert [(row["form"], row["score"]) for row in forms] == [
        ("consent", ""), ("tlx", "0.0"), ("sus", "50.0"), ("tlx", "0.0"), ("sus", "50.0")
    ]  # fmt: skip
    assert Session(a_task(tmp_path, participant="P02")).step.kind == "thanks"
    assert Session(a_task(tmp_path, participant="P01")).progress == (0, 11)


def test_a_row_has_what_the_referee_reports(tmp_path: Path) -> None:
    session = to_first_lap(Session(a_task(tmp_path)))
    drive(session)
    row = rows(tmp_path / "laps.csv")[0]
    assert {name: row[name] for name in LAP_COLUMNS[:-4]} == {
        "participant": "P01", "order": "1", "condition": "signs", "input": "hand", "course": "short", "practice": "1",
        "lap": "1", "outcome": "finished", "phase": "finished", "time_s": "4.25", "gates": "2", "passed": "1",
        "missed": "1", "bumps": "1", "score_s": "16.25", "path_m": "2.0",
    }  # fmt: skip
    assert row["config"] == config_hash(session.task.configs["signs"])
    assert (tmp_path / f"config-{row['config']}.json").exists()
    assert row["started_utc"].endswith("Z")


def test_the_lap_before_is_not_taken_for_the_new_one(tmp_path: Path) -> None:
    session = to_first_lap(Session(a_task(tmp_path)))
    session.begin_lap("me", 0.0)
    assert session.note(FINISHED, 9.0, 0.1) is None
    assert session.note(None, None, 0.2) is None
    assert session.note(CourseState(8), 0.0, 0.3) is None, "of another course"
    assert session.lap is not None
    assert session.lap.course is None
    session.note(READY, 0.0, 0.4)
    assert session.note(FINISHED, 2.0, 5.0) == "finished"


@pytest.mark.parametrize(("course", "now_s"), [(READY, 70.0), (CourseState(2, 1, time_s=60.0, phase="running"), 1e9)])
def test_a_lap_ends_by_the_time_limit_on_the_course_or_before_its_start(
    course: CourseState, now_s: float, tmp_path: Path
) -> None:
    session = to_first_lap(Session(a_task(tmp_path)))
    session.begin_lap("me", 10.0)
    session.note(READY, 0.0, 10.1)
    session.note(RUNNING if course.phase == "running" else READY, 0.0, 69.9)
    assert session.lap is not None
    assert session.note(course, 1.0, now_s) == "limit"
    assert rows(tmp_path / "laps.csv")[0]["outcome"] == "limit"
    assert session.step.lap == 1
    assert not session.step.practice


def test_a_lap_can_be_given_up_or_driven_again(tmp_path: Path) -> None:
    session = to_first_lap(Session(a_task(tmp_path)))
    for outcome in ("repeated", "given_up"):
        step = session.step
        session.begin_lap("me", 0.0)
        session.end_lap("repeated" if outcome == "repeated" else "given_up")
        assert (session.step == step) == (outcome == "repeated")
    assert [row["outcome"] for row in rows(tmp_path / "laps.csv")] == ["repeated", "given_up"]
    assert {row["lap"] for row in rows(tmp_path / "laps.csv")} == {"1"}


def test_answers_are_checked_before_they_are_written(tmp_path: Path) -> None:
    session = Session(a_task(tmp_path, a_plan(laps=1, practice_laps=0)))
    while session.step.form != "sus":
        do(session)
    with pytest.raises(StudyError, match="question 1 has no answer yet"):
        session.submit({})
    assert [row["form"] for row in rows(tmp_path / "forms.csv")] == ["consent", "tlx"]
    do(session)
    assert tuple(rows(tmp_path / "forms.csv")[-1]) == FORM_COLUMNS
    assert rows(tmp_path / "forms.csv")[-1]["sus_10"] == "1"


def test_what_cannot_be_written_is_still_to_be_done(tmp_path: Path) -> None:
    session = to_first_lap(Session(a_task(tmp_path)))
    (tmp_path / "laps.csv").mkdir()
    step = session.step
    session.begin_lap("me", 0.0)
    session.note(READY, 0.0, 0.1)
    with pytest.raises(StudyError, match="cannot write"):
        session.note(FINISHED, 0.0, 1.0)
    assert session.lap is None
    assert session.step == step


def test_wrong_participants_and_results_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="no participant 'P09' in the plan: choose one of P01, P02"):
        Session(a_task(tmp_path, participant="P09"))
    drive(to_first_lap(Session(a_task(tmp_path, a_plan(participants=["P02", "P01"]), "P01"))))
    with pytest.raises(StudyError, match="P01 has rows of 'pad' that are not in their order"):
        Session(a_task(tmp_path))
    with pytest.raises(StudyError, match="began with another plan"):
        Session(a_task(tmp_path, a_plan(laps=5)))


PLANS = st.builds(
    a_plan,
    conditions=st.sampled_from([[SIGNS], [SIGNS, PAD], [SIGNS, PAD, {"name": "keys", "input": "keys"}]]),
    courses=st.sampled_from([["a"], ["a", "b"]]),
    practice_laps=st.integers(0, 1),
    laps=st.integers(1, 2),
    forms=st.sampled_from([[], ["tlx"], ["tlx", "sus"]]),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
@given(plan=PLANS, crashes=st.lists(st.integers(0, 5), max_size=6), tears=st.lists(st.integers(0, 80), max_size=6))
def test_however_often_it_crashes_each_step_is_recorded_once(
    plan: object, crashes: list[int], tears: list[int], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("results")
    task = a_task(folder, plan)  # type: ignore[arg-type]
    for steps, tear in zip(crashes, tears, strict=False):
        session = Session(task)
        for _ in range(steps):
            do(session)
        for path in folder.glob("*.csv"):
            with path.open("ab") as file:
                file.write(b'P01,1,"si' * 9 if tear % 2 else b"")  # a row that was being written
    session = Session(task)
    while session.step.kind != "thanks":
        do(session)
    keys = [
        (row["condition"], row.get("course"), row.get("practice"), row.get("lap"), row.get("form"))
        for name in ("laps.csv", "forms.csv")
        for row in rows(folder / name)
    ]
    assert len(keys) == len(set(keys)) == session.progress[1]
