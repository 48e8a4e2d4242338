from collections.abc import Mapping
from typing import Any

import pytest

from handsteer.errors import ConfigError
from handsteer.messages import CMD_VEL, HAND_SIGN, IMAGE_RAW, ODOM
from handsteer.plugins.ros1.course import Translation, translate

RECOGNITION, CONTROL = "hand_sign_recognition", "hand_sign_control"


def told(kind: str, parameters: Mapping[str, Any], others: Mapping[str, Any] | None = None) -> Translation:
    return translate(kind, f"/r1/{kind}", parameters, (others or {}).get)


def test_the_courses_names_become_topics_and_the_rest_is_left() -> None:
    given = {"subscribe_image_topic": "/usb/image", "publish_gesture_topic": "words", "min_confidence": 0.9}
    assert told(RECOGNITION, given) == Translation(
        {"min_confidence": 0.9}, {IMAGE_RAW.name: "/usb/image", HAND_SIGN.name: "words"}
    )
    given = {"publish_gesture_topic": "/words", "control_topic": "/cmd_vel"}
    topics = {HAND_SIGN.name: "/words", CMD_VEL.name: "/cmd_vel", ODOM.name: "/odom"}
    assert told(CONTROL, given) == Translation({}, topics)


@pytest.mark.parametrize(
    ("commands", "odometry"),
    [("r1/cmd_vel", "r1/odom"), ("cmd_vel", "odom"), ("/base/velocity", None), ("/base/my_cmd_vel", "/base/my_odom")],
)
def test_the_odometry_of_a_robot_is_beside_its_commands(commands: str, odometry: str | None) -> None:
    assert told(CONTROL, {"control_topic": commands}).topics.get(ODOM.name) == odometry


def test_a_camera_has_the_courses_name_and_ours() -> None:
    assert told("my_camera", {"camera_name": "/dev/video2"}).parameters == {"source": "/dev/video2"}
    assert told("my_camera", {"camera_name": "/dev/video2", "source": "virtual"}).parameters == {"source": "virtual"}


def test_a_name_of_another_node_is_not_taken() -> None:
    assert told("my_camera", {"control_topic": "/cmd_vel"}).parameters == {"control_topic": "/cmd_vel"}
    assert told("robot", {"show_image": True}).parameters == {"show_image": True}


def test_the_control_follows_the_recognition_as_the_courses_does(caplog: pytest.LogCaptureFixture) -> None:
    others = {"hand_sign_recognition/publish_gesture_topic": "/words"}
    with caplog.at_level("INFO"):
        assert told(CONTROL, {}, others).topics == {HAND_SIGN.name: "/words"}
        assert "signs are read from /words" in caplog.messages[0]
        assert told(CONTROL, {"publish_gesture_topic": "/other"}, others).topics == {HAND_SIGN.name: "/words"}
    assert caplog.records[-1].levelname == "WARNING"
    assert "publish_gesture_topic is /other, but signs are read from /words" in caplog.messages[-1]


def test_the_same_topic_twice_is_no_news(caplog: pytest.LogCaptureFixture) -> None:
    others = {"hand_sign_recognition/publish_gesture_topic": "gesture/hand_sign"}
    with caplog.at_level("INFO"):
        told(CONTROL, {"publish_gesture_topic": "/gesture/hand_sign"}, others)
        told(CONTROL, {}, others)
    assert not caplog.messages


def test_the_shipped_signs_are_no_parameter(caplog: pytest.LogCaptureFixture) -> None:
    given = {"keypoint_classifier_model": "shipped", "keypoint_classifier_label": "of_the_model", "show_image": False}
    with caplog.at_level("INFO"):
        assert told(RECOGNITION, given) == Translation({})
    assert not caplog.messages


def test_a_taught_model_goes_before_one_that_was_left_on_the_master() -> None:
    given = {"keypoint_classifier_model": "/new.npz", "model": "/old.npz"}
    assert told(RECOGNITION, given).parameters == {"model": "/new.npz"}


def test_what_cannot_be_as_in_the_course_is_said_in_a_line_each(caplog: pytest.LogCaptureFixture) -> None:
    given = {
        "keypoint_classifier_model": "/src/model/keypoint_classifier.tflite",
        "keypoint_classifier_label": "/src/model/keypoint_classifier_label.csv",
        "show_image": True,
    }
    with caplog.at_level("INFO"):
        assert told(RECOGNITION, given) == Translation({})
    said = "\n".join(caplog.messages)
    assert len(caplog.messages) == 3
    assert "keypoint_classifier.tflite cannot be used" in said
    assert "keypoint_classifier_label.csv is not read: a sign model has its labels within" in said
    assert "opens no window" in said


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (RECOGNITION, {"subscribe_image_topic": 7}),
        (RECOGNITION, {"publish_gesture_topic": "two words"}),
        (RECOGNITION, {"show_image": "yes"}),
        (RECOGNITION, {"keypoint_classifier_model": 3}),
        (CONTROL, {"control_topic": ""}),
    ],
    ids=str,
)
def test_a_wrong_value_has_its_full_name(kind: str, given: dict[str, Any]) -> None:
    (name,) = given
    with pytest.raises(ConfigError, match=f"^ROS parameter /r1/{kind}/{name}: .* should be "):
        told(kind, given)


@pytest.mark.parametrize("given", [5, [1], "all"])
def test_a_value_in_place_of_all_parameters_is_refused(given: Any) -> None:
    with pytest.raises(ConfigError, match=f"^ROS parameter /r1/{CONTROL}: .* should be the node's parameters by name"):
        told(CONTROL, given)
