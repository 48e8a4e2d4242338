import pytest

from handsteer.control.explain import Reason
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status

OK, WARN, ERROR = 0, 1, 2


@pytest.mark.parametrize(
    ("status", "level", "message"),
    [
        (CameraStatus("webcam 0"), OK, "webcam 0: waiting for the first frame"),
        (CameraStatus("webcam 0", "delivers"), OK, "webcam 0: delivers frames"),
        (CameraStatus("webcam 0", "silent", 3.4), OK, "webcam 0: no frame for 3 s"),
        (CameraStatus("webcam 0", "frozen", 3.4), ERROR, "webcam 0: frozen, the same picture for 3.4 s"),
        (CameraStatus("webcam 0", "lost", problem="webcam 0 was unplugged"), ERROR, "webcam 0 was unplugged"),
        (RecognitionStatus(seen="NONE"), OK, "no hand is in view"),
        (RecognitionStatus(seen="NONE", no_hand_s=0.42), OK, "no hand seen for 0.4 s"),
        (RecognitionStatus(seen="NONE", no_hand_s=12.3), OK, "no hand seen for 12 s"),
        (RecognitionStatus(seen="NONE", handedness="Left"), OK, "the hand shows none of the signs"),
        (RecognitionStatus(seen="Go", handedness="Left"), OK, "hold Go a moment longer"),
        (RecognitionStatus("Go", seen="Go", handedness="Left"), OK, "Go is shown"),
        (RecognitionStatus(refused="the picture is black"), WARN, "the picture is black"),
        (RecognitionStatus(no_frame_s=2.0), WARN, "no frame for 2.0 s"),
        (RecognitionStatus(no_frame_s=2.0, refused="it was old"), WARN, "no frame for 2.0 s; before: it was old"),
        (RecognitionStatus(), WARN, "no frame yet"),
        (ControlStatus(Reason("sign", "Go")), OK, "driving: Go"),
        (ControlStatus(Reason("stopped"), blind=True), WARN, "standing: stopped, until it is reset"),
        (ControlStatus(Reason("steered"), warning="two nodes publish"), WARN, "driving: steered directly"),
        (ControlStatus(), OK, "gives no reason"),
        (RobotStatus(), OK, "moves freely"),
        (RobotStatus(touches=("crate", "ball")), WARN, "touches crate, ball"),
        (RobotStatus(no_command_s=1.2), WARN, "standing: no command for 1.2 s, and the last one was to drive"),
        (RobotStatus(warning="two nodes publish"), WARN, "is commanded by more than one node"),
        (RobotStatus(trouble="is silent", touches=("crate",)), ERROR, "is silent"),
    ],
)
def test_each_state_has_a_sentence_and_a_level(status: Status, level: int, message: str) -> None:
    assert (status.level, status.message) == (level, message)


@pytest.mark.parametrize(
    ("camera", "name"),
    [
        ("virtual hand", "virtual hand"),
        ("/dev/video0", "video0"),
        ("/a/folder/clip.mp4", "clip.mp4"),
        ("rtsp://user:secret@host/stream", "stream"),
        ("", ""),
    ],
)
def test_shortens_the_camera_to_a_name_without_secrets(camera: str, name: str) -> None:
    assert CameraStatus(camera).short_name == name
