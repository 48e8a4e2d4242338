import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handsteer.errors import StudyError
from handsteer.plugins.study.order import group_size
from handsteer.plugins.study.plan import config_hash, load_configs, load_courses, plan_hash, read_plan
from tests.plugins.study.plans import PAD, SIGNS, a_plan, write

EXAMPLE = Path(__file__).parents[3] / "examples" / "study.yaml"
GOOD: dict[str, Any] = {"participants": 2, "conditions": [SIGNS, PAD], "courses": ["slalom"]}


def test_the_example_is_a_plan() -> None:
    plan = read_plan(EXAMPLE)
    assert plan.participants[:2] == ("P01", "P02")
    assert load_courses(plan, EXAMPLE)["slalom"].gates
    configs = load_configs(plan, EXAMPLE, {})
    assert [configs[name].control.rule for name in ("signs", "point", "pad")] == ["course", "point", "course"]
    assert configs["joystick"].control.mode == "joystick"
    assert len(plan.participants) % group_size(plan) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"participants": "Ada"}, r"participants: should be a number of people, or a list of ids such as \[P01, P02\]"),
        ({"participants": 0}, "participants: 0 should be 1 to 1000 people"),
        ({"participants": True}, "participants: should be a number"),
        ({"participants": ["P1", "P1"]}, "participants: should have each value once; 'P1' is there twice"),
        ({"participants": ["Ada Lovelace"]}, r"participants.0: 'Ada Lovelace' should be an id such as P01"),
        ({"conditions": []}, r"conditions: should have 1 to 12 values, not 0"),
        ({"conditions": [SIGNS, {**SIGNS}]}, "conditions: should have each value once; 'signs' is there twice"),
        (
            {"conditions": [{"name": "a", "input": "feet"}]},
            "conditions.0.input: 'feet' should be 'hand', 'pad', 'keys'",
        ),
        ({"forms": "tlx"}, r"forms: 'tlx' should be a list, such as \[a, b\]"),
        ({"conditions": [{"name": "=1+1"}]}, r"conditions.0.name: '=1\+1' should begin with a letter"),
        ({"conditions": [{}]}, "conditions.0.name: is missing"),
        ({"conditions": [{**SIGNS, "laps": 3}]}, "conditions.0.laps: there is no such field"),
        ({"courses": ["a\x00.yaml"]}, "courses.0: .* should be the name of a world"),
        ({"laps": 0}, "laps: 0 should be greater than or equal to 1"),
        ({"lap_limit": float("nan")}, "lap_limit: nan should be"),
        ({"forms": ["tlx", "nps"]}, "forms.1: 'nps' should be 'tlx' or 'sus'"),
        ({"lapse": 3}, "lapse: there is no such field"),
    ],
)
def test_a_wrong_field_is_named(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = write(tmp_path / "plan.yaml", {**GOOD, **change})
    with pytest.raises(StudyError, match=f"^{re.escape(str(path))}: {message}"):
        read_plan(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [("- a", "expected fields"), ("", "expected fields"), ("a: &x 1", "anchors"), ("{", "not valid")],
)
def test_what_is_no_plan_is_refused(content: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(content)
    with pytest.raises(StudyError, match=message):
        read_plan(path)
    with pytest.raises(StudyError, match="cannot read the plan"):
        read_plan(tmp_path / "gone.yaml")


def test_courses_are_shipped_worlds_or_files_next_to_the_plan(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    gates = [{"name": str(x), "left": [x, 1], "right": [x, -1]} for x in (1, 2)]
    write(tmp_path / "own.yaml", {"gates": gates})
    assert [*load_courses(a_plan(courses=["own.yaml", "slalom"]), path)] == ["own.yaml", "slalom"]
    for course, message in (
        ("empty", "empty has 0 gates; a lap needs a start and a finish"),
        ("moon", "there is no world 'moon'"),
        ("gone.yaml", r"cannot read the world .*gone\.yaml"),
    ):
        with pytest.raises(StudyError, match=f"plan.yaml: courses: {message}"):
            load_courses(a_plan(courses=[course]), path)


def test_a_condition_overrides_the_plan_and_that_what_was_configured_elsewhere() -> None:
    plan = a_plan(
        config={"control": {"linear_step": 0.02, "max_linear": 0.5}},
        conditions=[SIGNS, {**PAD, "config": {"control": {"max_linear": 0.7}}}],
    )
    base = {"control": {"max_linear": 0.1, "max_angular": 1.5}, "camera": {"source": "virtual"}}
    configs = load_configs(plan, Path("plan.yaml"), base)
    assert [configs[name].control.max_linear for name in ("signs", "pad")] == [0.5, 0.7]
    assert {each.control.linear_step for each in configs.values()} == {0.02}
    assert {each.control.max_angular for each in configs.values()} == {1.5}
    assert configs["pad"].camera.source == "virtual"
    assert config_hash(configs["signs"]) != config_hash(configs["pad"])


def test_no_hand_moves_the_robot_where_another_input_is_studied() -> None:
    plan = a_plan(config={"control": {"mode": "joystick", "actions": {"Peace": "turbo", "turn_left": "forward"}}})
    configs = load_configs(plan, Path("plan.yaml"), {})
    assert configs["signs"].control.actions == {"Peace": "turbo", "Turn Left": "forward"}
    assert configs["signs"].control.mode == "joystick"
    assert configs["pad"].control.mode == "signs"
    assert set(configs["pad"].control.actions.values()) == {"stop"}
    assert configs["pad"].control.actions.keys() == {"Forward", "Backward", "Turn Left", "Turn Right", "Go"}


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"control": {"rampage": 1}}, r"plan\.yaml: config of 'pad': control\.rampage: there is no such parameter"),
        ({"control": {"max_linear": -1}}, r"config of 'pad': control\.max_linear: -1 should be greater than 0"),
        ({"control": 7}, "config of 'pad': control: 7 should be parameters, each with its value"),
        ({"camera": {"fps": 10}}, r"camera\.fps differs between 'signs' and 'pad', but is read at the start only"),
    ],
)
def test_a_wrong_parameter_is_named(config: dict[str, Any], message: str) -> None:
    with pytest.raises(StudyError, match=message):
        load_configs(a_plan(conditions=[SIGNS, {**PAD, "config": config}]), Path("plan.yaml"), {})


def test_a_real_robot_is_refused() -> None:
    with pytest.raises(StudyError, match=r"robot\.kind is dds; a study needs sim"):
        load_configs(a_plan(config={"robot": {"kind": "dds"}}), Path("plan.yaml"), {})


def test_texts_and_participants_may_change_during_a_study_but_what_is_driven_may_not() -> None:
    plan = a_plan()
    worlds = load_courses(a_plan(courses=["slalom"]), EXAMPLE)
    same = plan.model_copy(update={"title": "Another", "participants": ("P01", "P02", "P03")})
    assert plan_hash(plan, worlds) == plan_hash(same, worlds)
    assert plan_hash(plan, worlds) != plan_hash(plan.model_copy(update={"laps": 9}), worlds)
    assert plan_hash(plan, worlds) != plan_hash(plan, {})


SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
)
FIELDS = st.sampled_from(["participants", "conditions", "courses", "laps", "forms", "config", "title", "practice_laps"])
SECTIONS = st.sampled_from(["control", "camera", "robot", "signs", "dashboard", "x"])
NAMES = st.sampled_from(["actions", "max_linear", "kind", "preset", "source", "model", "robots", "world"])
CONFIGS = st.dictionaries(SECTIONS, VALUES | st.dictionaries(NAMES, VALUES, max_size=3), max_size=2)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(change=st.dictionaries(FIELDS, VALUES, max_size=3), config=CONFIGS)
def test_a_hostile_plan_is_refused_with_a_message(
    change: dict[str, Any], config: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "plan.yaml"
    conditions = [{"name": "a", "config": config}, {"name": "b", "input": "pad"}]
    path.write_text(yaml.safe_dump({**GOOD, "conditions": conditions, **change}), encoding="utf-8")
    message = "plan.yaml"
    try:
        plan = read_plan(path)
        load_courses(plan, path)
        load_configs(plan, path, {})
    except StudyError as error:
        message = str(error)
    assert "plan.yaml" in message


@given(data=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_a_plan_or_a_message(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(data)
    with pytest.raises(StudyError, match=r"plan\.yaml"):
        read_plan(path)
