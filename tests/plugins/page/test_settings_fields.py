from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import Config, load
from handsteer.errors import ConfigError
from handsteer.plugins.page.settings_fields import COMMON, FIELDS, FORM, LONGEST_TEXT, MASK, SECTION_TITLES, Field
from handsteer.types import ACTIONS


def test_there_is_a_field_for_every_parameter() -> None:
    parameters = set()
    for section, model in Config.model_fields.items():
        assert model.annotation is not None, section
        parameters |= {f"{section}.{name}" for name in model.annotation.model_fields}
    assert set(FIELDS) == parameters


@pytest.mark.parametrize("field", FIELDS.values(), ids=FIELDS)
def test_every_default_is_shown_as_a_text_that_means_it(field: Field) -> None:
    default = field.value_in(Config())
    assert field.parse(field.show(default)) == default
    assert field.text
    assert not field.text.endswith("]")


def test_fields_say_unit_range_choices_and_when_they_take_effect() -> None:
    speed = FIELDS["control.max_linear"]
    assert (speed.unit, speed.allowed, speed.kind, speed.live) == ("m/s", "above 0, at most 10", "number", True)
    assert FIELDS["camera.width"].allowed == "64 to 4096"
    assert FIELDS["control.ramp"].choices == ("per_message", "per_second")
    assert (FIELDS["robot.preset"].kind, FIELDS["robot.preset"].optional) == ("choice", True)
    assert "turtlebot4" in FIELDS["robot.preset"].choices
    assert not FIELDS["camera.source"].live
    assert {field.kind for field in FIELDS.values()} == {"switch", "choice", "number", "text", "list", "table"}


def message(of: Any, *given: Any) -> str:
    with pytest.raises(ConfigError) as caught:
        of(*given)
    return str(caught.value)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("control.linear_step", "7"),
        ("control.linear_step", "fast"),
        ("control.linear_step", ""),
        ("camera.fps", ".nan"),
        ("camera.width", "63"),
        ("camera.width", "64.5"),
        ("landmarks.max_hands", "3"),
        ("landmarks.refine_new_hands", "perhaps"),
        ("control.ramp", "quickly"),
        ("robot.preset", "roomba"),
        ("dashboard.host", "''"),
    ],
)
def test_what_is_wrong_is_said_in_the_words_for_a_file(tmp_path: Path, path: str, text: str) -> None:
    file = tmp_path / "wrong.yaml"
    section, name = path.split(".")
    file.write_text(f"{section}: {{{name}: {text or repr('')}}}\n")
    of_file = message(load, file).removeprefix(f"{file}, line 1: ")
    assert message(FIELDS[path].parse, text.strip("'")) == of_file


@pytest.mark.parametrize("text", ["1_0", "0x10", "1:30", "0,5", "0.5 # fast", "-0b1", "1e", "1.2.3", "9" * 70])
def test_what_only_yaml_takes_for_a_number_is_refused(text: str) -> None:
    said = message(FIELDS["control.max_linear"].parse, text)
    assert said.startswith("control.max_linear: ")
    assert said.endswith("should be a number such as 0.5")


@pytest.mark.parametrize(("text", "value"), [("0640", 640), (" 640 ", 640), ("6.4e2", 640), ("+640", 640)])
def test_a_number_is_decimal(text: str, value: int) -> None:
    assert FIELDS["camera.width"].parse(text) == value
    assert FIELDS["control.max_linear"].parse(".5") == 0.5


def outcome(field: Field, text: str) -> Any:
    """Return the value, which is shown as a text that means it, or the words that refuse it."""
    try:
        value = field.parse(text)
    except ConfigError as error:
        return str(error)
    assert field.parse(field.show(value), value) == value
    return value


NUMBERS = [field for field in FIELDS.values() if field.kind == "number"]


@given(st.sampled_from(NUMBERS), st.integers(-(10**9), 10**9) | st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_taken_or_refused_as_in_a_file(field: Field, number: float) -> None:
    text = yaml.safe_dump(number).partition("\n")[0]
    try:
        expected: object = field.value_in(load(None, None, {field.section: {field.name: number}}))
    except ConfigError as error:
        expected = str(error)
    assert outcome(field, text) == expected


NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc", "Zl", "Zp")), min_size=1, max_size=9)


@given(st.dictionaries(NAMES, st.sampled_from(ACTIONS), max_size=4))
def test_a_table_with_whatever_names_is_shown_as_a_text_that_means_it(actions: dict[str, str]) -> None:
    field = FIELDS["control.actions"]
    try:
        value = load(None, None, {"control": {"actions": actions}}).control.actions
    except ConfigError:
        return
    assert field.parse(field.show(value)) == value


def test_lists_and_tables_are_written_with_commas_and_may_have_brackets_as_in_a_file() -> None:
    for text in ("r1, r2", "[r1, r2]", " [r1,r2] "):
        assert FIELDS["control.robots"].parse(text) == ("r1", "r2")
    for text in ("Peace: turbo, no: stop", "{Peace: turbo, no: stop}"):
        assert FIELDS["control.actions"].parse(text) == {"Peace": "turbo", "no": "stop"}
    assert message(FIELDS["control.actions"].parse, "Peace: fly").startswith("control.actions.Peace: 'fly' should be")


@pytest.mark.parametrize("text", ["a: {b: c}", "&x a: *x", "a: stop} {", "a: stop}\n---\n{b: stop", "{" * 1500, "a: ["])
def test_what_is_no_table_is_refused(text: str) -> None:
    assert "should be written as in: Peace: turbo" in message(FIELDS["control.actions"].parse, text)


@given(st.sampled_from(sorted(FIELDS)), st.text(max_size=40) | st.text("[]{}:,&*!#'\"-?0aé\n ", max_size=20))
def test_any_text_is_a_value_or_refused_in_one_line(path: str, text: str) -> None:
    said = outcome(FIELDS[path], text)
    assert not isinstance(said, str) or "\n" not in said or said == text


def test_a_search_finds_names_and_meanings() -> None:
    def found(words: str) -> list[str]:
        return [path for path, field in FIELDS.items() if field.matches(words)]

    assert len(found("")) == len(FIELDS)
    assert found("MAX linear") == [
        "control.max_linear",
        "control.max_linear_acceleration",
        "control.max_linear_jerk",
        "robot.max_linear",
        "robot.max_linear_acceleration",
    ]
    assert "signs.confirm_time" in found("recognised before it counts")
    assert found("nothing is called so") == []


def test_a_text_that_is_too_long_is_refused() -> None:
    assert f"at most {LONGEST_TEXT} characters" in message(FIELDS["camera.source"].parse, "a" * (LONGEST_TEXT + 1))


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("rtsp://me:pa55@10.0.0.5/stream", f"rtsp://me:{MASK}@10.0.0.5/stream"),
        ("rtsp://me:p@ss:w@10.0.0.5/stream", f"rtsp://me:{MASK}@10.0.0.5/stream"),
        ("http://cam/video?user=me&pwd=x1&size=2", f"http://cam/video?user=me&pwd={MASK}&size=2"),
        ("http://:secret@cam", f"http://:{MASK}@cam"),
        ("rtsp://10.0.0.5:554/stream", "rtsp://10.0.0.5:554/stream"),
        ("C:/me:you@here.mp4", "C:/me:you@here.mp4"),
    ],
)
def test_passwords_are_never_shown_and_stay_when_the_rest_changes(address: str, shown: str) -> None:
    field = FIELDS["camera.source"]
    assert field.show(address) == shown
    assert field.parse(shown, address) == address
    if shown != address:
        assert field.parse(f"{shown}/2", address) == f"{address}/2"


@pytest.mark.parametrize(
    "text", [f"rtsp://me:{MASK}@evil.example/", f"http://me:{MASK}@10.0.0.5/", f"rtsp://{MASK}:{MASK}@10.0.0.5/", MASK]
)
def test_a_password_goes_to_no_other_host(text: str) -> None:
    said = message(FIELDS["camera.source"].parse, text, "rtsp://me:pa55@10.0.0.5/")
    assert "this is another address" in said
    assert "pa55" not in said


def test_paths_of_keys_are_for_the_driver() -> None:
    field = FIELDS["dashboard.private_key"]
    assert field.show(Path("key.pem")) == "key.pem"
    assert field.show(Path("key.pem"), to_driver=False) == MASK
    assert field.show(None, to_driver=False) == ""


def test_common_parameters_are_fields_and_every_section_has_a_title() -> None:
    assert set(COMMON) <= set(FIELDS)
    assert set(SECTION_TITLES) == set(FORM)
    assert FIELDS["control.max_linear"].title == "Top speed"
    assert FIELDS["robot.cmd_vel_topic"].title == "Command velocity topic"
    assert FIELDS["signs.confirm_time"].matches("recognising counts")
