from pathlib import Path
from typing import Any

import pytest

from handsteer import config
from handsteer.config import Config, cmd_vel_type, load
from handsteer.config.driving import PRESETS
from handsteer.errors import ConfigError


def sections() -> list[tuple[str, Any]]:
    return [(name, field.annotation) for name, field in Config.model_fields.items()]


def test_every_parameter_has_a_line_of_why() -> None:
    for name, section in sections():
        for parameter, field in section.model_fields.items():
            assert field.description, f"{name}.{parameter} has no description"


def test_a_file_goes_before_the_defaults_and_options_before_the_file(tmp_path: Path) -> None:
    file = tmp_path / "handsteer.yaml"
    file.write_text("control: {linear_step: 0.02, max_linear: 0.5}\ncamera:\n  at_end: hold\n")
    settings = config.load(file, {"camera": {"at_end": "end", "fps": 10}}, {"control": {"linear_step": 0.03}})
    assert settings.control.linear_step == 0.03
    assert settings.control.max_linear == 0.5
    assert settings.control.angular_step == 0.1
    assert settings.camera.at_end == "hold"
    assert settings.camera.fps == 10


def test_actions_of_file_and_options_are_joined_and_built_in_signs_may_be_written_as_one_likes(tmp_path: Path) -> None:
    file = tmp_path / "handsteer.yaml"
    file.write_text("control: {actions: {Hi: stop, Peace: go, turn-left: turbo, STOP: stop}}\n")
    settings = config.load(file, None, {"control": {"actions": {"Peace": "turbo"}}})
    assert settings.control.actions == {"Hi": "stop", "Peace": "turbo", "Turn Left": "turbo", "Stop": "stop"}


def test_an_empty_file_is_the_defaults(tmp_path: Path) -> None:
    file = tmp_path / "empty.yaml"
    file.write_text("# nothing\n")
    assert config.load(file) == Config()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("control: {linear_step: 7}", r"control.linear_step: 7 should be less than or equal to 1"),
        ("control: {linear_stop: 1}", r"control.linear_stop: there is no such parameter"),
        ("robto: {}", r"robto: there is no such parameter"),
        ("camera: {fps: .nan}", r"camera.fps: nan should be a finite number"),
        ("camera: {fps: fast}", r"camera.fps: 'fast' should be a valid number"),
        ("control: {max_linear: yes}", r"control.max_linear: True should be a number, not true or false"),
        ("joystick: {dead_zone: off}", r"joystick.dead_zone: False should be a number, not true or false"),
        ("control: {ramp: quickly}", r"control.ramp: 'quickly' should be 'per_message' or 'per_second'"),
        ("control: 3", r"control: 3 should be"),
        ("control: {actions: {Hi: fly}}", r"control.actions.Hi: 'fly' should be 'forward', .* or 'next_robot'"),
        ("control: {actions: {Stop: go}}", r"control.actions: {'Stop': 'go'} should leave Stop at 'stop'"),
        ("control: {actions: {none: turbo}}", r"control.actions: {'none': 'turbo'} should leave NONE at 'stop'"),
        ("control: {actions: {Go: stop, GO: go}}", r"control.actions: .*should name each sign once; 'GO' does not"),
        ("control: {actions: {Caf\u00e9: stop, Cafe\u0301: go}}", r"control.actions: .*should name each sign once"),
        ("control: {actions: {\uff33\uff54\uff4f\uff50: go}}", r"control.actions: .*should leave Stop at 'stop'"),
        ("control: {actions: {' ': go}}", r"control.actions: .*should name each sign once"),
        ("- 1", r"expected sections such as 'control:' at the top, found list"),
        ("control: {", r"line 1: not valid YAML"),
        ("control: 3", r"line 1: control: 3 should be parameters, each with its value$"),
        ("control: {robots: r1}", r"control\.robots: 'r1' should be a list, such as \[a, b\]$"),
        ('signs: {model: "a\\0b"}', r"signs.model: 'a\\x00b' must have no null character"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message) as caught:
        config.load(file)
    assert "bad.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("sign", ["Stop", "NONE", "stop"])
def test_no_configuration_takes_stop_away(sign: str) -> None:
    """The guard: ``ALWAYS_STOP``."""
    with pytest.raises(ConfigError, match="can always be stopped"):
        load(None, None, {"control": {"actions": {sign: "forward"}}})


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(ConfigError, match=r"cannot read the configuration gone\.yaml: No such file"):
        config.load(Path("gone.yaml"))


def test_a_known_robot_sets_its_limits_and_options_go_before_it() -> None:
    config = load(None, {"robot": {"kind": "dds", "preset": "turtlebot4"}, "control": {"max_linear": 0.1}})
    assert (config.robot.max_linear, config.control.max_linear, config.control.max_angular) == (0.306, 0.1, 1.9)
    assert cmd_vel_type(config) == "auto"


def test_both_ends_of_cmd_vel_speak_what_one_was_told() -> None:
    for section in ("control", "robot"):
        assert cmd_vel_type(load(None, {section: {"cmd_vel_type": "twist_stamped"}})) == "twist_stamped"
    given = {"control": {"cmd_vel_type": "twist"}, "robot": {"cmd_vel_type": "auto"}}
    assert cmd_vel_type(load(None, given)) == "twist"
    assert cmd_vel_type(load()) == "auto"
    both = {"control": {"cmd_vel_type": "twist"}, "robot": {"cmd_vel_type": "twist_stamped"}}
    with pytest.raises(ConfigError, match=r"control\.cmd_vel_type is twist and robot.cmd_vel_type twist_stamped"):
        cmd_vel_type(load(None, both))


@pytest.mark.parametrize("name", PRESETS)
def test_every_known_robot_is_allowed(name: str) -> None:
    config = load(None, {"robot": {"kind": "dds", "preset": name}})
    assert config.control.max_linear <= config.robot.max_linear


@pytest.mark.parametrize("robots", [["r1", "r1"], ["1r"], ["/r1"], ["r 1"], [""]])
def test_robots_have_names_that_differ(robots: list[str]) -> None:
    with pytest.raises(ConfigError, match=r"control.robots: .* should name each robot once"):
        load(None, {"control": {"robots": robots}})


def test_no_robot_is_called_as_the_following_one_is_selected() -> None:
    with pytest.raises(ConfigError, match=r"control.robots: .* should not name a robot 'next': on /select_robot"):
        load(None, {"control": {"robots": ["r1", "next"]}})


def test_old_names_still_count_with_one_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("handsteer.config.section._OLD_NAMES_SEEN", set())
    path = tmp_path / "old.yaml"
    path.write_text("signs: {bridge_time: 0.3, keep_confidence: 0.6}\nlandmarks: {second_look: false}")
    settings = load(path)
    assert (settings.signs.dropout_hold, settings.signs.release_confidence) == (0.3, 0.6)
    assert not settings.landmarks.refine_new_hands
    assert load(path, None, {"signs": {"dropout_hold": 0.4}}).signs.dropout_hold == 0.4
    assert load(None, {"signs": {"dropout_hold": 0.4}}, {"signs": {"bridge_time": 0.5}}).signs.dropout_hold == 0.5
    said = [record.getMessage() for record in caplog.records if "bridge_time" in record.getMessage()]
    assert said == ["parameter bridge_time is deprecated: use dropout_hold"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "control:\n  rule: course\n  max_liner: 1\n",
            r"my\.yaml, line 3: control\.max_liner: .*did you mean max_linear\?",
        ),
        (
            "# mine\ncontrl: {mode: signs}\n",
            r"my\.yaml, line 2: contrl: there is no such parameter: did you mean control\?",
        ),
        ("control:\n  mode: joystik\n", r"my\.yaml, line 2: control\.mode: 'joystik' .*: did you mean joystick\?"),
        ("control:\n  actions:\n    Hi: turbos\n", r"my\.yaml, line 3: control\.actions\.Hi: .*: did you mean turbo\?"),
        ("camera: 5\n", r"my\.yaml, line 1: camera: 5 should be"),
        ("control:\n  robots:\n    - r1\n    - 7\n", r"my\.yaml, line 4: control\.robots\.1: 7 should be"),
        ("control:\n  robots: [r1,\n    [r2]]\n", r"my\.yaml, line 3: control\.robots\.1: \['r2'\] should be"),
    ],
)
def test_what_is_wrong_in_a_file_is_found_by_its_line(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "my.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=says):
        load(path)


def test_the_file_is_not_blamed_for_an_option(tmp_path: Path) -> None:
    path = tmp_path / "my.yaml"
    path.write_text("control:\n  max_linear: 1\n")
    with pytest.raises(ConfigError, match=r"^control\.max_linear: 99 should be"):
        load(path, None, {"control": {"max_linear": 99}})
    path.write_text("control:\n  robots: [r1, r2]\n")
    with pytest.raises(ConfigError, match=r"^control\.robots\.1: 7 should be"):
        load(path, None, {"control": {"robots": ["r1", 7]}})
