from dataclasses import fields
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import to_stamp
from handsteer.config import ControlConfig
from handsteer.control import Source
from handsteer.control.explain import Reason, ReasonCode
from handsteer.messages import DiagnosticStatus, KeyValue
from handsteer.nodes.diagnostics import read_status, split_reporter, write_status
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status
from handsteer.plugins.teach.effects import effect_of
from handsteer.types import ACTIONS, SIGNS, CourseState, Pose2D, action_of

TEXTS = st.text(max_size=30)
NUMBERS = st.floats(-1e9, 1e9)
COUNTS = st.integers(0, 10**9)
RULES = st.builds(
    ControlConfig,
    ramp=st.sampled_from(["per_message", "per_second"]),
    max_linear=st.floats(0.1, 10),
    actions=st.dictionaries(st.sampled_from(["Peace", "Hi, you", "Go"]), st.sampled_from(ACTIONS)),
)
STATUSES = st.one_of(
    st.builds(
        CameraStatus,
        state=st.sampled_from(["silent", "lost"]),
        since_s=NUMBERS,
        frames=COUNTS,
        camera=TEXTS,
        problem=TEXTS,
    ),
    st.builds(
        RecognitionStatus,
        sign=TEXTS,
        signs=st.lists(TEXTS, max_size=5).map(tuple),
        seen=st.none() | TEXTS,
        confidence=NUMBERS,
        handedness=st.sampled_from(["Left", "Right", ""]),
        recording=st.none() | st.booleans(),
        progress=NUMBERS,
        no_hand_s=st.none() | NUMBERS,
        no_frame_s=st.none() | NUMBERS,
        refused=TEXTS,
        processing_ms=st.none() | NUMBERS,
        processing_p99_ms=st.none() | NUMBERS,
        frame_age_ms=st.none() | NUMBERS,
        clock_ahead_ms=st.none() | NUMBERS,
        sides_swapped=st.booleans(),
    ),
    st.builds(
        ControlStatus,
        reason=st.none() | st.builds(Reason, st.sampled_from(get_args(ReasonCode)), TEXTS, TEXTS, TEXTS),
        source=st.sampled_from(get_args(Source)),
        stopped=st.booleans(),
        armed=st.booleans(),
        blind=st.booleans(),
        linear_mps=NUMBERS,
        angular_radps=NUMBERS,
        robot=st.none() | TEXTS,
        obstacle_m=st.none() | NUMBERS,
        warning=st.none() | TEXTS,
        latency_median_ms=st.none() | NUMBERS,
        latency_p99_ms=st.none() | NUMBERS,
        rule=st.none() | RULES,
    ),
    st.builds(
        RobotStatus,
        collisions=st.none() | COUNTS,
        path_length_m=st.none() | NUMBERS,
        truth=st.none() | st.builds(Pose2D, NUMBERS, NUMBERS, NUMBERS),
        course=st.none()
        | st.builds(
            CourseState,
            gates=st.integers(1, 20),
            next_gate=st.integers(0, 20),
            missed=st.frozensets(st.integers(0, 19)),
            bumps=COUNTS,
            time_s=NUMBERS,
            phase=st.sampled_from(["ready", "running", "finished"]),
        ),
        warning=st.none() | TEXTS,
        trouble=TEXTS,
        touches=st.lists(TEXTS, max_size=5).map(tuple),
        no_command_s=st.none() | NUMBERS,
    ),
)
KINDS: list[type[Any]] = [CameraStatus, RecognitionStatus, ControlStatus, RobotStatus]
NODES = [kind.node for kind in KINDS]
NOT_VALUES = [
    "",
    "nan",
    "-inf",
    "1e999",
    "9" * 5000,
    "True",
    "None",
    "x" * 100_000,
    '"',
    '{"Stop": "go"}',
    "\0",
    "ü,",
    "1_0",
]


def sent(status: Status) -> DiagnosticStatus:
    return write_status(status, status.node, to_stamp(0.0)).status[0]


def values_of(status: Status) -> dict[str, str]:
    return {pair.key: pair.value for pair in sent(status).values}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("my_camera", ("", "my_camera")),
        ("my_camera: my_camera", ("", "my_camera")),
        ("left_camera: my_camera", ("", "my_camera")),
        ("r1/my_camera: my_camera", ("r1", "my_camera")),
        ("site/r1/steering: dashboard", ("site/r1", "dashboard")),
    ],
)
def test_namespace_and_node(name: str, expected: tuple[str, str]) -> None:
    assert split_reporter(name) == expected


@given(STATUSES)
def test_a_status_survives_the_way_to_diagnostics_and_back(status: Status) -> None:
    message = sent(status)
    assert read_status(message) == status
    assert (message.level, message.message) == (status.level, status.message)


def test_a_status_has_plain_values_with_names_that_stay() -> None:
    course = CourseState(8, 3, frozenset({2, 0}), 1, 12.5, "running")
    robot = RobotStatus(2, 1.25, Pose2D(5.0, 2.0, 0.5), course, "slalom", touches=("crate", "a, b"))
    assert values_of(robot) == {
        "collisions": "2",
        "path_length_m": "1.25",
        "truth_x": "5.0",
        "truth_y": "2.0",
        "truth_yaw": "0.5",
        "course_gates": "8",
        "course_next_gate": "3",
        "course_missed": "0,2",
        "course_bumps": "1",
        "course_time_s": "12.5",
        "course_phase": "running",
        "world": "slalom",
        "trouble": "",
        "touches": 'crate,"a, b"',
    }
    control = values_of(ControlStatus(Reason("disarmed", "no sign came"), rule=ControlConfig(actions={"Hi": "stop"})))
    assert (control["reason_code"], control["reason_detail"]) == ("disarmed", "no sign came")
    assert (control["max_linear"], control["ramp"], control["actions.Hi"]) == ("1.0", "per_message", "stop")
    assert ControlConfig.live - {"actions"} <= control.keys()


@given(RULES)
def test_the_page_knows_what_signs_do(rule: ControlConfig) -> None:
    heard = read_status(sent(ControlStatus(rule=rule)))
    assert isinstance(heard, ControlStatus)
    assert heard.rule is not None
    for sign in (*SIGNS, "Peace", "Hi, you"):
        assert action_of(sign, heard.rule.actions) == action_of(sign, rule.actions)
    assert all(effect_of(action, heard.rule) == effect_of(action, rule) for action in ACTIONS)


@given(
    st.sampled_from(NODES),
    st.integers(),
    st.dictionaries(
        st.sampled_from(sorted({key for kind in KINDS for key in [each.name for each in fields(kind)]})) | TEXTS,
        st.sampled_from(NOT_VALUES) | st.text(),
    ),
)
def test_anything_may_come_from_outside(node: str, level: int, values: dict[str, str]) -> None:
    pairs = [KeyValue(key, value) for key, value in values.items()]
    status = read_status(DiagnosticStatus(level, node, "", "", pairs))
    assert status is not None
    assert status.node == node
    assert len(status.message) < 10_000


@given(STATUSES, st.data())
def test_a_value_that_is_none_leaves_its_field_at_the_default(status: Status, data: st.DataObject) -> None:
    message = sent(status)
    for pair in data.draw(st.lists(st.sampled_from(message.values))):
        pair.value = data.draw(st.sampled_from(NOT_VALUES))
    read = read_status(message)
    assert type(read) is type(status)
    assert read is not None
    assert isinstance(read.message, str)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"frames": "many"}, "frames"),
        ({"frames": "1e999"}, "frames"),
        ({"since_s": "nan"}, "since_s"),
        ({"state": "asleep"}, "state"),
    ],
)
def test_the_other_fields_of_a_status_count(changed: dict[str, str], field: str) -> None:
    message = sent(CameraStatus("webcam 0", "silent", 3.0, "", 7))
    for pair in message.values:
        pair.value = changed.get(pair.key, pair.value)
    status = read_status(message)
    assert isinstance(status, CameraStatus)
    assert status.camera == "webcam 0"
    assert getattr(status, field) == getattr(CameraStatus(), field)


@pytest.mark.parametrize(
    "wrong",
    [{"course_gates": "many"}, {"course_missed": "a"}, {"course_time_s": "nan"}, {"course_phase": "over"}],
)
def test_a_course_that_is_wrong_in_part_is_none(wrong: dict[str, str]) -> None:
    message = sent(RobotStatus(3, course=CourseState(3)))
    for pair in message.values:
        pair.value = wrong.get(pair.key, pair.value)
    assert read_status(message) == RobotStatus(3)


@pytest.mark.parametrize("wrong", [{"max_linear": "-1"}, {"ramp": '"per_second"'}, {"actions.Stop": "go"}])
def test_parameters_that_the_control_cannot_have_are_none(wrong: dict[str, str]) -> None:
    message = sent(ControlStatus(rule=ControlConfig(actions={"Hi": "stop"})))
    message.values += [KeyValue(key, value) for key, value in wrong.items()]
    assert read_status(message) == ControlStatus()


def test_a_list_without_an_end_is_cut() -> None:
    status = read_status(DiagnosticStatus(0, "robot", "", "", [KeyValue("touches", "a," * 10**6)]))
    assert isinstance(status, RobotStatus)
    assert 0 < len(status.touches) <= 1000


def test_other_programs_may_report_too() -> None:
    assert read_status(DiagnosticStatus(0, "hokuyo_node: laser", "", "", [])) is None
    assert read_status(DiagnosticStatus(0, "", "", "", [])) is None
