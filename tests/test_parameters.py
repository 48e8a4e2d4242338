from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer import config
from handsteer.config import Config
from handsteer.errors import ConfigError
from handsteer.parameters import from_parameters

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
        (
            {"min_confidense": 0.9},
            r"ROS parameter /r1/hand_sign_recognition/min_confidense: there is no such",
        ),
        ({"min_confidence": 2}, r"ROS parameter /r1/hand_sign_recognition/min_confidence: 2 should be less than or eq"),
        ({"landmarks": {"model": "big"}}, r"/r1/hand_sign_recognition/landmarks/model: 'big' should be 'full' or 'li"),
        ({"landmarks": {"modl": "full"}}, r"/r1/hand_sign_recognition/landmarks/modl: there is no such parameter"),
        ({"landmarks": "full"}, r"/r1/hand_sign_recognition/landmarks: there is no such parameter"),
    ],
    ids=str,
)
def test_what_is_wrong_has_its_full_name(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        from_parameters(parameters, "signs", NODE)


def test_no_parameter_is_hidden_by_a_section_of_the_same_name() -> None:
    for field in Config.model_fields.values():
        assert not set(field.annotation.model_fields) & set(Config.model_fields)  # type: ignore[union-attr]


@given(st.sampled_from(sorted(Config.model_fields)))
def test_the_defaults_of_each_section_pass(section: str) -> None:
    defaults = getattr(Config(), section).model_dump(exclude_none=True)
    assert config.load(None, None, from_parameters(defaults, section, "/node")) == Config()
