"""Translates the parameters of the course's packages to handsteer's names.

The course's launch files set them as private parameters. Its recognition reads them under a fixed name,
``hand_sign_recognition/…``, and so does its control, which subscribes to the topic that the recognition was given.
"""

import logging
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from handsteer.errors import ConfigError, quoted
from handsteer.messages import CMD_VEL, HAND_SIGN, IMAGE_ANNOTATED, IMAGE_RAW, ODOM, Topic

_TOPICS: dict[str, dict[str, Topic[Any]]] = {
    "hand_sign_recognition": {"subscribe_image_topic": IMAGE_RAW, "publish_gesture_topic": HAND_SIGN},
    "hand_sign_control": {"publish_gesture_topic": HAND_SIGN, "control_topic": CMD_VEL},
}
_GESTURE_TOPIC = "publish_gesture_topic"
_OF_THE_RECOGNITION = f"hand_sign_recognition/{_GESTURE_TOPIC}"
TOPIC_NAME = re.compile(r"[~/]?[A-Za-z]\w*(/\w+)*", re.ASCII)
_SHIPPED, _OF_THE_MODEL = "shipped", "of_the_model"
_NETWORKS = (".tflite", ".hdf5", ".h5", ".keras")

log = logging.getLogger(__name__)


@dataclass
class Translation:
    """The translated parameters of a node.

    Attributes:
        parameters: By handsteer's names.
        topics: New names of topics, by their full default names.
    """

    parameters: dict[str, Any]
    topics: dict[str, str] = field(default_factory=dict)


def translate(kind: str, node: str, parameters: Mapping[str, Any], read: Callable[[str], Any]) -> Translation:
    """Return the translation of ``parameters``; each one that has no equivalent is logged.

    Args:
        kind: Default name of the node, such as ``hand_sign_control``.
        node: Its full name, for messages.
        parameters: Its private parameters.
        read: Returns a parameter of the node's namespace by its relative name, or None if there is none.

    Raises:
        ConfigError: A name of a topic or a file is invalid, or the parameters are not a table.
    """
    if not isinstance(parameters, Mapping):
        raise ConfigError(f"ROS parameter {node}: {quoted(parameters)} should be the node's parameters by name")
    found = Translation(dict(parameters))
    for name, topic in _TOPICS.get(kind, {}).items():
        if name in found.parameters:
            found.topics[topic.name] = _topic_name(f"{node}/{name}", found.parameters.pop(name))
    if kind == "my_camera" and "camera_name" in found.parameters:
        camera = found.parameters.pop("camera_name")
        found.parameters.setdefault("source", camera)
    elif kind == "hand_sign_control":
        commands = found.topics.get(CMD_VEL.name, "")
        if commands and found.parameters.get("robots"):
            log.warning("control_topic is not used: several robots are commanded on %s below their names", CMD_VEL.name)
        if commands.endswith("cmd_vel"):  # the odometry is next to the commands: /cmd_vel, /odom
            found.topics[ODOM.name] = commands.removesuffix("cmd_vel") + "odom"
        _follow_the_recognition(found, node, read(_OF_THE_RECOGNITION))
    elif kind == "hand_sign_recognition":
        _take_window(found.parameters, node)
        _take_model(found.parameters, node)
    return found


def _follow_the_recognition(found: Translation, node: str, gesture_topic: Any) -> None:
    if gesture_topic is None:
        return
    theirs, mine = _topic_name(_OF_THE_RECOGNITION, gesture_topic), found.topics.get(HAND_SIGN.name)
    found.topics[HAND_SIGN.name] = theirs
    if mine is not None and mine.lstrip("/") != theirs.lstrip("/"):
        log.warning(
            "%s/%s is %s, but signs are read from %s, where %s has them published",
            node, _GESTURE_TOPIC, mine, theirs, _OF_THE_RECOGNITION,
        )  # fmt: skip
    elif theirs.lstrip("/") != HAND_SIGN.name.lstrip("/"):
        log.info("signs are read from %s, where %s has them published", theirs, _OF_THE_RECOGNITION)


def _topic_name(parameter: str, value: Any) -> str:
    if not isinstance(value, str) or not TOPIC_NAME.fullmatch(value):
        raise ConfigError(f"ROS parameter {parameter}: {value!r} should be the name of a topic, as /camera/image_raw")
    return value


def _take_window(parameters: dict[str, Any], node: str) -> None:
    shown = parameters.pop("show_image", False)
    if not isinstance(shown, bool):
        raise ConfigError(f"ROS parameter {node}/show_image: {shown!r} should be true or false")
    if shown:
        log.info(
            "show_image: this node opens no window; the picture is on %s, for RViz, rqt_image_view or the page",
            IMAGE_ANNOTATED.name,
        )


def _take_model(parameters: dict[str, Any], node: str) -> None:
    labels = parameters.pop("keypoint_classifier_label", _OF_THE_MODEL)
    model = parameters.pop("keypoint_classifier_model", _SHIPPED)
    for name, value in (("keypoint_classifier_label", labels), ("keypoint_classifier_model", model)):
        if not isinstance(value, str):
            raise ConfigError(f"ROS parameter {node}/{name}: {value!r} should be the path of a file")
    if labels not in (_OF_THE_MODEL, ""):
        log.warning("keypoint_classifier_label %s is not read: a sign model has its labels within", labels)
    if model.endswith(_NETWORKS):
        log.warning(
            "keypoint_classifier_model %s cannot be used, for it takes every hand for one of its signs: the shipped "
            "signs are used; `handsteer signs import` and `train` make a model of the course's keypoint.csv",
            model,
        )
    elif model not in (_SHIPPED, ""):
        parameters["model"] = model
