import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from handsteer import config
from handsteer.config import Config, ControlConfig
from handsteer.config.driving import MOST_ACTIONS
from handsteer.errors import ConfigError
from handsteer.parameters import NodeParameters, Value, from_parameters
from handsteer.types import LONGEST_SIGN

NODE = "/r1/hand_sign_recognition"


def test_the_own_section_is_flat_and_others_are_nested() -> None:
    values = from_parameters({"min_confidence": 0.9, "landmarks": {"model": "lite"}}, "signs", NODE)
    assert values == {"signs": {"min_confidence": 0.9}, "landmarks": {"model": "lite"}}
    settings = config.load(None, None, values)
    assert (settings.signs.min_confidence, settings.landmarks.model) == (0.9, "lite")


def test_a_number_may_name_a_webcam() -> None:
    assert config.load(None, None, from_parameters({"source": 0}, "camera", "/my_camera")).camera.source == "0"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"min_confidence": 2}, r"ROS parameter /r1/hand_sign_recognition/min_confidence: 2 should be less than or eq"),
        ({"landmarks": {"model": "big"}}, r"/r1/hand_sign_recognition/landmarks/model: 'big' should be 'fast', 'f"),
    ],
    ids=str,
)
def test_what_is_wrong_has_its_full_name(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        from_parameters(parameters, "signs", NODE)


@pytest.mark.parametrize(
    ("given", "section", "message"),
    [
        ({"actions": {"Bad": "fly"}}, "control", rf"^ROS parameter {NODE}/actions\.Bad: 'fly' should be 'forward', "),
        (
            {"control": {"actions": {"Bad": "fly"}}},
            "signs",
            rf"^ROS parameter {NODE}/control/actions\.Bad: 'fly' should",
        ),
        (
            {"full_deflection": 0.001},
            "joystick",
            rf"^ROS parameter {NODE}/full_deflection: joystick: .* should be above",
        ),
        ({"actions": {"Stop": "go"}}, "control", rf"^ROS parameter {NODE}/actions: {{'Stop': 'go'}} should leave Stop"),
    ],
    ids=str,
)
def test_what_is_wrong_in_a_table_or_with_others_has_its_full_name_too(
    given: dict[str, Any], section: str, message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        from_parameters(given, section, NODE)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"min_confidense": 0.5}, "/min_confidense: did you mean min_confidence"),
        ({"modell": "lite"}, "/modell: did you mean model"),
        ({"max_hand": 1}, "/max_hand: did you mean landmarks/max_hands"),
        ({"landmarks": {"modl": "full"}}, "/landmarks/modl: did you mean landmarks/model"),
        ({"landmarks": "full"}, "/landmarks: did you mean landmarks/model"),
        ({"robot_description": "<robot/>"}, "/robot_description$"),
    ],
    ids=str,
)
def test_what_is_not_known_is_said_once_and_left_out(
    parameters: dict[str, Any], said: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert from_parameters({**parameters, "min_confidence": 0.9}, "signs", NODE) == {"signs": {"min_confidence": 0.9}}
    (line,) = caplog.messages
    assert re.search(f"^ignoring unknown ROS parameter {NODE}{said}", line)


def test_no_parameter_is_hidden_by_a_section_of_the_same_name() -> None:
    for field in Config.model_fields.values():
        assert field.annotation is not None
        assert not set(field.annotation.model_fields) & set(Config.model_fields)


@given(st.sampled_from(sorted(Config.model_fields)))
def test_the_defaults_of_each_section_pass(section: str) -> None:
    defaults = getattr(Config(), section).model_dump(exclude_none=True)
    assert config.load(None, None, from_parameters(defaults, section, "/node")) == Config()


@pytest.mark.parametrize("section", list(Config.model_fields))
def test_what_a_node_gives_is_taken_at_a_start(section: str) -> None:
    """As by ``ros2 param dump`` and ``--params-file``: what is None is given as an empty text."""
    given: dict[str, Any] = {}
    for name, value in NodeParameters(Config(), section, lambda _: None).values().items():
        table = given
        *above, last = name.split(".")
        for each in above:
            table = table.setdefault(each, {})
        table[last] = value
    assert config.load(None, None, from_parameters(given, section, "/node")) == Config()


def test_no_preset_is_that_of_the_kind_of_robot() -> None:
    kind = {"robot": {"kind": "ros2"}}
    assert config.load(None, kind, {"robot": {"preset": ""}}) == config.load(None, kind)


def test_a_file_can_be_taken_away_again(tmp_path: Path) -> None:
    applied: list[Config] = []
    parameters = NodeParameters(Config(), "signs", applied.append)
    parameters.set({"profile": str(tmp_path / "anna.npz")})
    parameters.set({"profile": ""})
    assert [each.signs.profile for each in applied] == [tmp_path / "anna.npz", None]


def test_what_is_set_is_what_the_node_gets() -> None:
    applied: list[Config] = []
    parameters = NodeParameters(Config(), "signs", applied.append)
    parameters.set({"min_confidence": 0.9, "confirm_time": 0})
    assert (applied[0].signs.min_confidence, applied[0].signs.confirm_time) == (0.9, 0.0)
    assert applied[0].landmarks == Config().landmarks
    assert parameters.values()["min_confidence"] == 0.9


def test_what_is_read_at_the_start_can_only_be_set_to_what_it_is() -> None:
    parameters = NodeParameters(Config(), "signs", lambda _: None)
    parameters.set({"landmarks.model": "fast", "image_transport": "auto"})
    with pytest.raises(ConfigError, match=r"^landmarks.model cannot be set: it is only read when the node starts"):
        parameters.set({"landmarks.model": "lite"})


def test_a_parameter_of_the_own_section_is_set_by_its_declared_name_alone() -> None:
    applied: list[Config] = []
    parameters = NodeParameters(Config(), "control", applied.append)
    changes: dict[str, Value] = {"control.max_linear": 0.5, "control.actions.Peace": "turbo"}
    for name, value in changes.items():
        assert parameters.describe(name) is None
        with pytest.raises(ConfigError, match=rf"^{name}: there is no such parameter; the parameters are .*max_linear"):
            parameters.set({name: value})
    assert applied == []
    # Nested in a file, it still counts at the start.
    assert from_parameters({"control": {"max_linear": 0.5}}, "control", "/node") == {"control": {"max_linear": 0.5}}


@pytest.mark.parametrize("section", list(Config.model_fields))
def test_every_parameter_of_every_node_has_a_fitting_description(section: str) -> None:
    parameters = NodeParameters(Config(), section, lambda _: None)
    kinds = {"bool": bool, "integer": int, "double": float, "string": str, "strings": list}
    for name, value in parameters.values().items():
        description = parameters.describe(name)
        assert description is not None
        assert type(value) is kinds[description.kind], name
        assert description.text
        if description.minimum is not None:
            assert isinstance(value, int | float), name
            assert description.minimum <= value


def test_actions_have_a_number_and_a_length_that_the_control_can_look_up() -> None:
    """Any node of the graph may set them, and the control compares each sign with all of them."""
    parameters = NodeParameters(Config(), "control", lambda _: None)
    parameters.set({f"actions.N{number}": "turbo" for number in range(MOST_ACTIONS)})
    with pytest.raises(ConfigError, match=r"^actions: .* should have at most 100 entries, not 101$"):
        parameters.set({"actions.Peace": "turbo"})
    parameters.set({"actions.N0": None, f"actions.{'x' * LONGEST_SIGN}": "turbo"})
    with pytest.raises(ConfigError, match=r"^actions: .*names of at most 100 characters; 'x+\.\.\.' has 101$"):
        parameters.set({"actions.N1": None, f"actions.{'x' * (LONGEST_SIGN + 1)}": "turbo"})


LIVE = sorted(ControlConfig.live - {"ramp", "actions"})


@given(st.dictionaries(st.sampled_from(LIVE), st.floats() | st.integers() | st.booleans() | st.text(max_size=3)))
@example({"assist": False})
def test_whatever_is_set_the_configuration_stays_valid(changes: dict[str, Any]) -> None:
    applied: list[Config] = []
    parameters = NodeParameters(Config(), "control", applied.append)
    before = parameters.values()
    problem = None
    try:
        parameters.set(changes)
    except ConfigError as error:
        problem = str(error)
    if problem is not None:
        assert any(name in problem for name in changes)
        assert (parameters.values(), applied) == (before, [])
    else:
        after = parameters.values()
        for name, value in changes.items():  # off is false in YAML, and in what ros2 param sets
            assert after[name] in (value, {True: "on", False: "off"}[value] if isinstance(value, bool) else value)
        Config.model_validate({"control": {name: after[name] for name in LIVE}})


def test_old_names_still_count() -> None:
    assert from_parameters({"bridge_time": 0.3, "landmarks": {"second_look": False}}, "signs", "/node") == {
        "signs": {"dropout_hold": 0.3},
        "landmarks": {"refine_new_hands": False},
    }
    applied: list[Config] = []
    NodeParameters(Config(), "signs", applied.append).set({"bridge_time": 0.3})
    assert applied[-1].signs.dropout_hold == 0.3
