"""Commands that start the course's own recognition and control: fetched, or replaced by stand-ins without a network.

Nothing of theirs is stored here. The originals run in the environment of ``tutorial.py``, which has MediaPipe, with our
rospy and LiteRT added. LiteRT replaces TensorFlow, whose interpreter it is, and a few lines replace ``cv_bridge``, so
that the seconds in which TensorFlow is imported do not count.
"""

import shutil
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

import platformdirs

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the course's control that the tests use

from tests.ros1.course import make_package
from tutorial import make_environment, tutorial_python

HERE = Path(__file__).resolve().parent
ADDRESS = "https://github.com/TrinhNC/ros_hand_gesture_recognition.git"
COMMIT = "251bbd0287649b1a45ca2d0145717974888a684f"
CLONE = platformdirs.user_cache_path("handsteer", appauthor=False) / f"course-{COMMIT[:12]}"
_PATIENCE_S = 120

_LAUNCH = """import runpy, sys
from pathlib import Path
sys.argv = sys.argv[1:]
sys.path[0] = str(Path(sys.argv[0]).parent)
sys.path[1:1] = {before}
sys.path += {after}
runpy.run_path(sys.argv[0], run_name="__main__")
"""
_STANDS_IN = {
    "tensorflow.py": """from ai_edge_litert.interpreter import Interpreter


class lite:
    Interpreter = Interpreter
""",
    "cv_bridge.py": """import numpy as np


class CvBridgeError(Exception):
    pass


class CvBridge:
    def imgmsg_to_cv2(self, message):
        return np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, 3)
""",
}
_RECOGNITION = """import numpy as np
import rospy
from _tutorial_pipeline import TutorialPipeline
from cv_bridge import CvBridge
from sensor_msgs.msg import Image
from std_msgs.msg import String

prefix = "hand_sign_recognition/"
rospy.init_node("hand_sign_recognition", anonymous=True)
publisher = rospy.Publisher(rospy.get_param(prefix + "publish_gesture_topic"), String, queue_size=10)
pipeline, bridge = TutorialPipeline(), CvBridge()


def recognise(image):
    publisher.publish("Forward" if pipeline.step(bridge.imgmsg_to_cv2(image), 0.0) else "NONE")
    rospy.get_param(prefix + "show_image")


rospy.Subscriber(rospy.get_param(prefix + "subscribe_image_topic"), Image, recognise)
rospy.spin()
"""


@dataclass(frozen=True)
class OriginalNodes:
    """Commands that start the nodes.

    Attributes:
        what: Description of the nodes.
        recognition: Command of the recognition; None without MediaPipe.
        control: Command of the control.
        parameters: Parameters that the launch file sets for the recognition.
    """

    what: str
    recognition: tuple[str, ...] | None
    control: tuple[str, ...]
    parameters: dict[str, str | bool]


def original_nodes(folder: Path, clone: Path | None) -> OriginalNodes:
    """Return the course's nodes, from ``clone`` or fetched, or stand-ins; ``folder`` is for temporary files."""
    without_mediapipe = make_environment()
    problem = None if clone else fetch()
    sources = (clone or CLONE) / "src"
    if problem is None:
        what, recognition, control = "the course's own", sources, sources / "sign_to_controller.py"
    else:
        package = make_package(folder)
        what, recognition, control = f"stand-ins ({problem})", folder / "stand_in", package / "sign_to_controller.py"
        recognition.mkdir()
        (recognition / "hand_sign_recognition.py").write_text(_RECOGNITION)
    start = _launcher(folder)
    models = sources / "model" / "keypoint_classifier"
    return OriginalNodes(
        what if without_mediapipe is None else f"{what}, without a recognition: {without_mediapipe}",
        None if without_mediapipe else (*start, str(recognition / "hand_sign_recognition.py")),
        (*(start if without_mediapipe is None else (sys.executable,)), str(control)),
        {
            "keypoint_classifier_label": str(models / "keypoint_classifier_label.csv"),
            "keypoint_classifier_model": str(models / "keypoint_classifier.tflite"),
            "subscribe_image_topic": "image_raw",
            "publish_gesture_topic": "gesture/hand_sign",
            "show_image": False,
        },
    )


def fetch() -> str | None:
    """Fetch the course's repository into the user's cache if missing; return the reason for a failure."""
    if CLONE.is_dir():
        return None
    new = CLONE.with_suffix(".new")
    shutil.rmtree(new, ignore_errors=True)
    try:
        for command in (["clone", "--quiet", ADDRESS, str(new)], ["-C", str(new), "checkout", "--quiet", COMMIT]):
            subprocess.run(["git", *command], check=True, capture_output=True, timeout=_PATIENCE_S)
    except (subprocess.SubprocessError, OSError):
        return f"{ADDRESS} cannot be fetched"
    new.rename(CLONE)
    return None


def _launcher(folder: Path) -> tuple[str, ...]:
    """Return the command that runs one of their scripts; the caller appends its name."""
    import rospy  # noqa: PLC0415 - the benchmark says which packages it lacks before

    shims = folder / "shims"
    shims.mkdir()
    for name, text in _STANDS_IN.items():
        (shims / name).write_text(text)
    after = [str(Path(rospy.__file__).parents[1]), sysconfig.get_path("purelib")]
    script = shims / "launch.py"
    script.write_text(_LAUNCH.format(before=[str(shims), str(HERE)], after=after))
    return str(tutorial_python()), str(script)
