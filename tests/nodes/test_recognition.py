import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer.cameras.files import SensorNoise
from handsteer.clock import to_stamp
from handsteer.config import Config, SignsConfig
from handsteer.errors import ConfigError
from handsteer.images import bgr_image, image_message, jpeg_message
from handsteer.messages import (
    CAMERA_CHANGED,
    DIAGNOSTICS,
    GESTURE_JOY,
    HAND_SIGN,
    IMAGE_ANNOTATED,
    IMAGE_COMPRESSED,
    IMAGE_DRAWN,
    IMAGE_LANDMARKS,
    IMAGE_RAW,
    Header,
    Image,
    String,
    Time,
    engages_in,
    pointing_in,
    stick_in,
)
from handsteer.nodes.diagnostics import read_status
from handsteer.nodes.recognition import HandSignRecognitionNode
from handsteer.nodes.status import RecognitionStatus
from handsteer.parameters import NodeParameters
from handsteer.recognition.custom_signs import save_custom_model
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognition, Recognizer
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.timeouts import FAULT_GAP_S
from handsteer.transports.base import Received
from handsteer.types import FORWARD, RELEASED
from tests.nodes.stepping import Bench
from tests.recognition.hands import RecordedLandmarker, show_fingers, show_sign
from tests.recognition.models import model
from tests.recognition.test_engage_gesture import GESTURE

HEADER = Header(stamp=Time(0, 0), frame_id="camera")
GREY = np.full((480, 640, 3), 100, np.uint8)
NOISE = SensorNoise()
TEXTURE = np.random.default_rng(0).integers(0, 250, (48, 64, 3), dtype=np.uint8).repeat(10, axis=0).repeat(10, axis=1)
"""In JPEG, noise on plain grey is lost."""
BROKEN = Image(HEADER, 480, 640, "bgr8", 0, 1920, np.zeros(5, np.uint8))


class RecognitionBench(Bench):
    def __init__(
        self, config: SignsConfig | None = None, hand: Hand | None = None, hands: Sequence[Hand] | None = None
    ) -> None:
        super().__init__()
        config = config or SignsConfig()
        landmarker = RecordedLandmarker([[each] for each in hands or [hand or show_sign(FORWARD)] * 100])
        recognizer = Recognizer(Config(signs=config), landmarker=landmarker, classifier=ShippedClassifier(load_model()))
        self.node = HandSignRecognitionNode(
            self.transport,
            self.clock,
            recognizer,
            config,
            camera_changed=CAMERA_CHANGED,
        )
        self.nodes = [self.node]
        self.images = self.transport.advertise("camera", IMAGE_RAW)
        self.signs = self.record(HAND_SIGN)

    def picture(self, scene: np.ndarray = GREY) -> np.ndarray:
        return NOISE.on(scene, self.clock.now())

    def play(self, numbers: Sequence[int], *, every_s: float | None = None) -> list[str]:
        """Play these images of a recording at ten a second; return the signs that follow before it is over.

        ``every_s`` is how often one arrives; None for all at once, before the node has looked at the first.
        """
        before = len(self.signs)
        for number in numbers:
            header = Header(stamp=to_stamp(1.0 + number / 10), frame_id="camera")
            image = image_message(NOISE.on(TEXTURE, number / 10), header)
            self.images.publish(image, self.clock.now() - 86_400.0 + number / 10)
            if every_s is not None:
                self.run(every_s)
        self.run(0.0)
        return [sign.data for sign in self.signs[before:]]

    def show(self, image: Image | None = None, frames: int = 1, age_s: float = 0.0) -> None:
        for _ in range(frames):
            self.images.publish(image or image_message(self.picture(), HEADER), self.clock.now() - age_s)
            self.run(1 / 30)

    @property
    def names(self) -> list[str]:
        return [sign.data for sign in self.signs]


@pytest.fixture
def bench() -> RecognitionBench:
    return RecognitionBench()


def test_one_sign_a_frame(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    assert bench.names == ["NONE"] * 3 + ["Forward"] * 3
    assert bench.node.counts == {"NONE": 3, "Forward": 3}


def test_while_no_frames_come_none_goes_out(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.signs.clear()
    bench.run(1.0)
    assert len(bench.names) == 2, "so seldom that control knows them from an empty picture"
    assert set(bench.names) == {"NONE"}
    bench.signs.clear()
    bench.show()
    assert bench.names == ["NONE"], "a sign has to be confirmed anew after a loss"


def test_the_hand_as_a_joystick_is_published_for_who_subscribes() -> None:
    bench = RecognitionBench(hands=[show_sign("Stop")] * 20 + [show_sign("Go")] * 40)
    bench.show(frames=30)
    joys = bench.record(GESTURE_JOY)
    bench.show(frames=10)
    assert [joy.buttons[:2].tolist() for joy in joys] == [[0, 0]] * 10, "nobody saw the hand open"
    assert joys[0].header == HEADER


def test_a_fist_that_closes_is_held_until_no_frames_come() -> None:
    bench = RecognitionBench(hands=[show_sign("Stop")] * 20 + [show_sign("Go")] * 40)
    joys = bench.record(GESTURE_JOY)
    bench.show(frames=30)
    assert [int(joy.buttons[0]) for joy in joys] == [0] * 23 + [1] * 7
    assert joys[-1].axes.tolist() == [0.0] * 4
    bench.run(1.0)
    assert joys[-1].buttons.tolist() == [0, 0, 0]


def test_the_gesture_that_engages_is_published_with_the_joystick() -> None:
    bench = RecognitionBench(hands=GESTURE)
    joys, statuses = bench.record(GESTURE_JOY), bench.record(DIAGNOSTICS)
    bench.show(frames=len(GESTURE) - 6)
    assert not any(engages_in(joy) for joy in joys)
    status = read_status(statuses[-1].status[0])
    assert isinstance(status, RecognitionStatus)
    assert status.engage_progress == pytest.approx(0.67)
    bench.show(frames=6)
    assert engages_in(joys[-1])
    bench.run(1.0)
    assert not engages_in(joys[-1])


def test_a_stale_frame_is_no_frame(bench: RecognitionBench) -> None:
    bench.show(frames=10, age_s=0.6)
    assert bench.names == []
    bench.show(frames=10, age_s=0.6)
    assert set(bench.names) == {"NONE"}


def test_a_sign_that_was_being_told_when_the_process_was_stopped_is_not_said(
    bench: RecognitionBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.show(frames=6)
    bench.signs.clear()
    step = Recognizer.step

    def frozen(self: Recognizer, *arguments: Any) -> Recognition:
        bench.clock.advance(2.5)
        return step(self, *arguments)

    with monkeypatch.context() as patch:
        patch.setattr(Recognizer, "step", frozen)
        bench.show()
    bench.show(frames=6)
    assert set(bench.names[:3]) == {"NONE"}
    bench.show(frames=6)
    assert bench.names[-1] == "Forward"


def test_a_frame_without_a_time_that_waited_while_the_process_was_stopped_is_none(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.signs.clear()
    bench.images.publish(image_message(bench.picture(), HEADER))
    bench.clock.advance(2.5)
    bench.run(0.02)
    assert set(bench.names) <= {"NONE"}


def test_a_camera_with_compressed_images_only_is_taken_by_itself(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    bench = RecognitionBench()
    del bench.images  # a publisher that nobody holds is gone
    compressed = bench.transport.advertise("camera", IMAGE_COMPRESSED)
    bench.run(0.6)
    for _ in range(6):
        compressed.publish(jpeg_message(bench.picture(TEXTURE), HEADER), bench.clock.now())
        bench.run(1 / 30)
    assert bench.names[-1] == "Forward"
    assert "no node publishes /image_raw: images are taken from /image_raw/compressed, of camera" in caplog.text


def test_a_broken_frame_is_no_frame(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.show(BROKEN)
    assert (len(bench.names), bench.node.callback_errors) == (6, 1)
    bench.show()
    assert bench.names[-1] == "Forward"
    bench.signs.clear()
    bench.show(BROKEN, frames=30)
    assert set(bench.names) == {"NONE"}
    assert len(bench.names) <= 2


def test_a_sign_is_bridged_from_when_it_was_seen_and_not_from_when_the_picture_froze(bench: RecognitionBench) -> None:
    bench.show(frames=99)
    frozen = image_message(bench.picture(), HEADER)
    bench.show(frozen)
    bench.show(frozen, frames=9)
    bench.signs.clear()
    bench.show()  # no hand any more
    assert bench.names == ["NONE"]


def test_the_same_picture_again_is_no_frame_whoever_publishes_it(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=6)
    bench.signs.clear()
    bench.show(image_message(bench.picture(), HEADER), frames=60)
    assert bench.names[0] == "Forward", "it was new once"
    assert set(bench.names[1:]) == {"NONE"}
    assert len(bench.names) <= 5
    assert statuses[-1].status[0].message.startswith("the camera is frozen: the same picture for ")
    bench.show(frames=6)
    assert bench.names[-1] == "Forward"


def test_a_picture_is_not_new_when_it_comes_again_with_another_stamp() -> None:
    bench = RecognitionBench(hands=[show_sign(FORWARD)] * 200)
    bench.show(frames=6)
    for age_s in (-5.0, 1.0):
        again = image_message(bench.picture(), HEADER)
        bench.show(again, age_s=age_s)
        bench.run(0.5)
        bench.show(frames=60)  # until its clock is trusted again
        assert bench.names[-1] == "Forward"
        seen = len(bench.names)
        bench.show(again)
        assert len(bench.names) == seen


def test_a_second_camera_that_is_frozen_adds_nothing_to_one_that_is_not(bench: RecognitionBench) -> None:
    frozen = image_message(NOISE.on(GREY, 99.0), HEADER)
    bench.show(frozen)
    bench.signs.clear()
    for _ in range(10):
        bench.show()
        bench.show(frozen)
    assert len(bench.names) == 10


def test_a_hand_in_the_part_of_a_picture_that_stands_still_is_not_seen(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=6)
    left, top, right, bottom = show_sign(FORWARD).box_px
    still = bench.picture()[top:bottom, left:right]
    bench.signs.clear()
    for _ in range(60):
        torn = bench.picture()
        torn[top:bottom, left:right] = still
        bench.show(image_message(torn, HEADER))
    assert bench.names.count("Forward") <= 1, "it may be new once"
    assert bench.names[-1] == "NONE"
    assert statuses[-1].status[0].message.startswith("the picture is torn")


@pytest.mark.parametrize("length", [1, 9, 60])
@pytest.mark.parametrize("clock", [False, True])
def test_a_camera_that_repeats_what_it_has_seen_stops_within_half_a_second(length: int, clock: bool) -> None:
    bench = RecognitionBench(hands=[show_sign(FORWARD)] * 400)
    seen = [NOISE.on(TEXTURE, index / 30) for index in range(max(length, 6))]
    for picture in seen:
        bench.show(image_message(picture, HEADER))
    assert bench.names[-1] == "Forward"
    bench.signs.clear()
    for index in range(round(0.45 * 30)):
        repeated = seen[-length:][index % length].copy()
        if clock:
            repeated[0:8, 0:40] = index
        bench.show(image_message(repeated, HEADER))
    assert bench.names[-1] == "NONE"


RECORDED = SignsConfig(recorded="always")
ONCE = ["NONE"] + ["Forward"] * 19


@pytest.mark.parametrize("every_s", [None, 0.0, 0.1, 0.7])
def test_a_recording_gives_the_same_signs_each_time_however_fast_it_comes(every_s: float | None) -> None:
    bench = RecognitionBench(RECORDED)
    for _ in range(3):
        assert bench.play(range(20), every_s=every_s) == ONCE


def test_of_a_camera_the_newest_image_counts_and_of_a_recording_each() -> None:
    bench = RecognitionBench()
    for number in range(20):
        bench.images.publish(image_message(NOISE.on(TEXTURE, number / 10), HEADER), bench.clock.now())
    bench.run(0.0)
    assert len(bench.names) == 1


def test_a_gap_in_a_recording_is_a_loss_of_the_hand() -> None:
    bench = RecognitionBench(RECORDED)
    assert bench.play([*range(5), *range(20, 25)]) == 2 * (["NONE"] + ["Forward"] * 4)


def test_an_image_that_a_recording_repeats_becomes_none_by_its_stamps() -> None:
    bench = RecognitionBench(RECORDED)
    same = image_message(NOISE.on(TEXTURE, 0.0), HEADER)
    bench.play(range(5))
    for number in range(5, 12):
        header = Header(stamp=to_stamp(1.0 + number / 10), frame_id="camera")
        bench.images.publish(dataclasses.replace(same, header=header), -86_400.0 + number / 10)
    bench.run(0.0)
    assert bench.names == ["NONE"] + ["Forward"] * 4 + ["NONE"] * 4


def test_a_stall_of_this_process_changes_nothing_of_a_recording() -> None:
    bench = RecognitionBench(RECORDED)
    first = bench.play(range(5))
    bench.clock.advance(0.9)
    assert first + bench.play(range(5, 20)) == ONCE


def test_what_was_played_is_logged_when_it_ends_or_begins_again(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    bench = RecognitionBench(RECORDED)
    for _ in range(2):
        bench.play(range(20))
    bench.run(5.1)
    said = [message for message in caplog.messages if "images of a recording" in message]
    assert said == 2 * ["20 images of a recording: NONE 1, Forward 19"]


def test_a_recording_that_stops_becomes_none_after_a_second() -> None:
    bench = RecognitionBench(RECORDED)
    bench.play(range(5))
    bench.run(0.9)
    assert bench.names[-1] == "Forward"
    bench.run(0.15)
    assert bench.names[-1] == "NONE"


def test_the_joystick_of_a_recording_is_of_now() -> None:
    bench = RecognitionBench(RECORDED)
    joys = bench.record(GESTURE_JOY)
    bench.run(10.0)
    bench.play(range(2))
    assert [joy.header.stamp for joy in joys[-2:]] == [bench.clock.stamp(bench.clock.now())] * 2


def test_a_recording_waits_only_up_to_a_size_which_is_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("handsteer.nodes.recognition._MOST_PLAYED_BYTES", 5 * TEXTURE.size)
    bench = RecognitionBench(RECORDED)
    assert bench.play(range(20)) == ["NONE"] + ["Forward"] * 4
    assert [message for message in caplog.messages if "5 messages wait" in message] == [
        "/image_raw: 5 messages wait, and new ones are dropped: the recording is played faster than this machine "
        "recognises: play it at a lower rate (-r 0.5)"
    ]


def test_a_black_picture_is_no_frame(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    for _ in range(30):
        bench.show(image_message(NOISE.on(np.zeros_like(GREY), bench.clock.now()), HEADER))
    assert set(bench.names) == {"NONE"}
    assert statuses[-1].status[0].message == "the picture is black: is the lens covered?"


def test_the_name_of_the_sign_is_only_in_the_annotated_picture_and_the_person_not_in_the_drawn_one(
    bench: RecognitionBench,
) -> None:
    topics = (IMAGE_ANNOTATED, IMAGE_LANDMARKS, IMAGE_DRAWN, IMAGE_RAW)
    recorded = [bench.record(topic) for topic in topics]
    bench.show(frames=5)
    annotated, landmarks, drawn, raw = (bgr_image(messages[-1]) for messages in recorded)
    # The label is in the upper left, where no hand is.
    corner = (slice(0, len(raw) // 8), slice(0, raw.shape[1] // 3))
    mirrored = raw[:, ::-1][corner]
    assert not np.array_equal(annotated[corner], mirrored)
    assert np.array_equal(landmarks[corner], mirrored)
    assert not drawn[corner].any()
    assert drawn.any(), "the hand is drawn"
    assert (drawn == 0).mean() > 0.8


def test_the_annotated_picture_is_made_on_demand_and_mirrored(bench: RecognitionBench) -> None:
    bench.show()
    pictures, frames = bench.record(IMAGE_ANNOTATED), bench.record(IMAGE_RAW)
    bench.show(frames=5)
    assert len(pictures) == 5
    assert np.ptp(pictures[0].data) > 100
    assert all(np.ptp(frame.data) <= 2 for frame in frames), "the frame itself is left as it is"


def test_diagnostics_tell_what_is_seen(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=10)
    seen = statuses[-1].status[0]
    assert seen.message == "Forward is shown"
    assert {value.key: value.value for value in seen.values}["sign"] == "Forward"
    status = read_status(seen)
    assert isinstance(status, RecognitionStatus)
    assert len(status.confidences) == len(status.signs)
    assert max(zip(status.confidences, status.signs, strict=True)) == (status.confidence, "Forward")
    assert status.min_confidence == SignsConfig().min_confidence
    bench.run(2.0)
    assert statuses[-1].status[0].message.startswith("no frame for")


def test_tells_for_how_long_no_hand_was_seen(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=100)
    bench.show(frames=12)  # the recording has no more hands
    assert statuses[-1].status[0].message == "no hand seen for 0.4 s"
    bench.show(frames=150)
    assert statuses[-1].status[0].message == "no hand seen for 5 s"


def test_of_another_camera_a_sign_is_confirmed_anew(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.signs.clear()
    changed = bench.transport.advertise("my_camera", CAMERA_CHANGED)
    changed.publish(String(data="webcam 0"), bench.clock.now())
    bench.show(frames=2, age_s=0.2)
    assert bench.names == [], "what the camera before has seen does not count"
    bench.show(frames=6)
    assert bench.names == ["NONE"] * 3 + ["Forward"] * 3


def test_with_swapped_sides_the_annotated_picture_is_not_mirrored_and_the_hand_is_the_real_one() -> None:
    bench = RecognitionBench(SignsConfig(swap_sides=True))
    annotated, statuses = bench.record(IMAGE_ANNOTATED), bench.record(DIAGNOSTICS)
    half = NOISE.on(GREY, 0.0)
    half[400:, :320] += 100  # below the hand
    bench.show(image_message(half, HEADER))
    picture = bgr_image(annotated[0])
    assert picture[440:, :300].mean() > picture[440:, 340:].mean() + 90
    bench.run(0.1)
    status = read_status(statuses[-1].status[0])
    assert isinstance(status, RecognitionStatus)
    assert (status.handedness, status.sides_swapped) == ("Left", True)


def test_late_frames_of_a_browser_on_another_machine_are_blamed_on_its_network_or_device() -> None:
    bench = RecognitionBench()
    bench.node.is_camera_far = True
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=20, age_s=0.5)
    assert set(bench.names) == {"NONE"}
    assert statuses[-1].status[0].message == (
        "Pictures of that device's camera arrive 0.5 s late: the network or that device may be slow"
    )


def test_frames_that_come_late_are_told_from_none() -> None:
    bench = RecognitionBench()
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=20, age_s=2.0)
    assert set(bench.names) == {"NONE"}
    assert statuses[-1].status[0].message == "This computer is too slow or busy: pictures arrive 2.0 s late"


def test_a_recording_is_followed_when_that_is_asked_for() -> None:
    bench = RecognitionBench(RECORDED)
    bench.play(range(10), every_s=0.1)
    assert bench.names[-1] == "Forward"
    bench.run(1.0)
    assert bench.names[-1] == "NONE"  # it has ended


def test_what_may_be_a_recording_is_not_followed_by_itself_and_says_how() -> None:
    bench = RecognitionBench()
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=60, age_s=3 * 86_400.0)
    assert set(bench.names) == {"NONE"}
    assert (
        "stamped 3 days ago, and come at their own rate: if they are recorded, set the param"
        in statuses[-1].status[0].message
    )
    bench.run(1.0)
    assert "no frame for 1." in statuses[-1].status[0].message
    assert "before: frames are stamped 3 days ago" in statuses[-1].status[0].message
    bench.run(10.0)
    assert statuses[-1].status[0].message.startswith("no frame for 1")
    assert "before" not in statuses[-1].status[0].message, "it says nothing of now"


def test_frames_of_a_clock_that_is_far_ahead_are_no_frames() -> None:
    bench = RecognitionBench()
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=20, age_s=-2.0)
    assert set(bench.names) == {"NONE"}
    assert statuses[-1].status[0].message == (
        "frames are stamped 2.0 s ahead of our clock: are the clocks of the machines synchronised?"
    )
    bench.run(1.0)
    assert statuses[-1].status[0].message.startswith("no frame for 1.")


def test_a_stale_frame_is_told_though_its_clock_is_ahead() -> None:
    bench = RecognitionBench()
    bench.show(frames=6, age_s=-0.2)
    assert bench.names[-1] == "Forward"
    bench.signs.clear()
    bench.show(frames=20, age_s=0.2)
    assert set(bench.names) == {"NONE"}


def test_compressed_images_instead() -> None:
    bench = RecognitionBench(SignsConfig(image_transport="compressed"))
    compressed = bench.transport.advertise("camera", IMAGE_COMPRESSED)
    annotated = bench.record(IMAGE_ANNOTATED)
    for _ in range(6):
        compressed.publish(jpeg_message(bench.picture(TEXTURE), HEADER), bench.clock.now())
        bench.run(1 / 30)
    assert bench.names == ["NONE"] * 3 + ["Forward"] * 3
    assert annotated[-1].header == HEADER
    assert not bench.images.has_subscribers


def test_none_comes_within_the_timeout_and_a_moment(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.run(0.3)
    assert bench.names[-1] == "Forward"
    bench.run(0.08)
    assert bench.names[-1] == "NONE"


PAUSE = 24
"""More frames than there are without a sign after a change of what is read, and until one is confirmed."""


def test_other_confidences_and_times_count_after_a_pause(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.node.reconfigure(Config.model_validate({"signs": {"min_confidence": 1.0, "release_confidence": 1.0}}))
    bench.show(frames=PAUSE)
    assert bench.names[-2:] == ["NONE"] * 2
    bench.node.reconfigure(Config.model_validate({"signs": {"confirm_time": 0.0}}))
    bench.show(frames=PAUSE)
    assert bench.names[-1] == "Forward"


def test_a_change_of_what_is_read_is_a_pause_that_the_control_takes_for_a_fault(bench: RecognitionBench) -> None:
    bench.show(frames=6)
    bench.node.reconfigure(Config.model_validate({"signs": {"image_transport": "raw"}}))
    bench.show(frames=1)
    assert len(bench.signs) == 7, "nothing was changed that can change now"
    bench.node.reconfigure(Config.model_validate({"signs": {"min_confidence": 0.5}}))
    times_s: dict[str, list[float]] = {"NONE": [], "Forward": []}
    for frame in range(1, 1 + PAUSE):
        bench.signs.clear()
        bench.show()
        for name in bench.names:
            times_s[name].append(frame / 30)
    assert times_s["NONE"][0] > FAULT_GAP_S
    assert times_s["Forward"][0] > Config().control.sign_timeout


def test_a_shorter_age_of_frames_counts_at_once(bench: RecognitionBench) -> None:
    bench.show(frames=6, age_s=0.2)
    assert bench.names[-1] == "Forward"
    bench.node.reconfigure(Config.model_validate({"signs": {"max_frame_age": 0.1}}))
    bench.show(frames=PAUSE, age_s=0.2)
    assert bench.names[-1] == "NONE"


def with_model(path: Path) -> Config:
    return Config.model_validate({"signs": {"model": path}})


def test_another_model_counts_after_a_pause(tmp_path: Path) -> None:
    path = tmp_path / "mine.npz"
    save_custom_model(model(hi=0.99), path)
    bench = RecognitionBench(hand=show_fingers("index", "little"))
    bench.show(frames=5)
    assert set(bench.names) == {"NONE"}
    bench.node.check(with_model(path))
    bench.node.reconfigure(with_model(path))
    bench.show(frames=PAUSE)
    assert (bench.names[5], bench.names[-1]) == ("NONE", "Hi")
    path.unlink()
    bench.node.check(with_model(path))
    bench.node.reconfigure(with_model(path))
    bench.show()
    assert bench.names[-1] == "Hi", "a file that has gone since it was read is still in use"

    save_custom_model(model(hi=0.01, ho=0.98), path)
    bench.node.reconfigure(with_model(path))
    bench.signs.clear()
    bench.show(frames=PAUSE)
    assert (bench.names[0], bench.names[-1]) == ("NONE", "Ho"), "a file that was written anew is read again"
    bench.node.reconfigure(Config())
    bench.show(frames=PAUSE)
    assert set(bench.names[-5:]) == {"NONE"}
    assert bench.node.callback_errors == 0


def test_a_model_that_cannot_be_used_is_refused_before_anything_changes(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    path.write_bytes(b"no model")
    bench = RecognitionBench()
    applied: list[Config] = []
    parameters = NodeParameters(Config(), "signs", applied.append, bench.node.check)
    with pytest.raises(ConfigError, match=r"^model: .*bad.npz: not a model of taught signs"):
        parameters.set({"model": str(path), "min_confidence": 0.9})
    with pytest.raises(ConfigError, match=r"^model: cannot read the model of taught signs .*gone.npz"):
        parameters.set({"model": str(tmp_path / "gone.npz")})
    assert (applied, parameters.values()["model"]) == ([], "")
    save_custom_model(model(), path)
    parameters.set({"model": str(path)})
    parameters.set({"model": str(path)})  # again, as it may have been written anew
    parameters.set({"model": ""})
    assert [config.signs.model for config in applied] == [path, path, None]


def test_a_publisher_of_one_picture_gets_a_hint_once(caplog: pytest.LogCaptureFixture) -> None:
    bench = RecognitionBench()
    frozen = image_message(bench.picture(), HEADER)
    bench.show(frozen, frames=300)
    hints = [record.getMessage() for record in caplog.records if "Only new pictures count" in record.getMessage()]
    assert len(hints) == 1
    assert hints[0].startswith("/image_raw: the same picture for 3 s.")


@pytest.mark.parametrize("encoding", ["yuv420", "16UC1", "\x1b[2J" * 100])
def test_an_unsupported_encoding_is_one_line_with_what_to_do(encoding: str, caplog: pytest.LogCaptureFixture) -> None:
    bench = RecognitionBench()
    sent = image_message(bench.picture(), HEADER)
    bench.show(dataclasses.replace(sent, encoding=encoding), frames=20)
    (record,) = caplog.records
    assert record.exc_info is None
    assert "use one of bgr8" in record.getMessage()
    assert record.getMessage().isprintable()
    assert "use one of bgr8" in bench.node._report().refused


def test_a_recording_that_is_played_beside_a_silent_camera_is_not_that_of_a_clock_that_was_set() -> None:
    """The guard: ``is_late`` in ``_on_frame``, which transports set for old frames from among several publishers."""
    bench = RecognitionBench()
    bench.show(frames=6)
    assert bench.names[-1] == "Forward"
    bench.run(1.0)
    bench.signs.clear()
    for _ in range(150):
        image = image_message(bench.picture(), HEADER)
        played = Received(image, bench.clock.now() - 9 * 365 * 86_400.0, is_late=True)
        bench.transport._fanouts[IMAGE_RAW.name].send(played)
        bench.run(1 / 30)
    assert set(bench.names) == {"NONE"}
    assert "played next to another publisher" in bench.node._report().refused


def test_a_picture_that_was_passed_over_is_not_new_when_it_comes_again(bench: RecognitionBench) -> None:
    """The guard: ``pass_over`` in ``_on_frame``, for pictures that are refused before they are compared."""
    late = [image_message(NOISE.on(GREY, float(number)), HEADER) for number in range(6)]
    for image in late:
        bench.show(image, age_s=0.6)
    assert bench.names == []
    for image in late:
        bench.show(image)
    assert set(bench.names) <= {"NONE"}
    assert bench.node.counts == {}


def test_where_the_hand_points_is_published_with_the_joystick() -> None:
    bench = RecognitionBench(hands=[show_sign("Forward", tilt=0.6)] * 20 + [show_sign("Stop")] * 10)
    joys = bench.record(GESTURE_JOY)
    bench.show(frames=20)
    points = pointing_in(joys[-1])
    assert points.held
    assert points.forward > 0
    assert points.left > 0.5, "clockwise in the picture is the person's left"
    assert not stick_in(joys[-1]).held
    bench.show(frames=10)
    assert pointing_in(joys[-1]) == RELEASED
    bench.run(1.0)
    assert joys[-1].buttons.tolist() == [0, 0, 0]


def test_while_it_is_deactivated_it_publishes_one_none_and_looks_at_nothing(bench: RecognitionBench) -> None:
    statuses = bench.record(DIAGNOSTICS)
    bench.show(frames=6)
    bench.signs.clear()
    assert bench.node.set_active(False)
    assert bench.names == ["NONE"]
    bench.show(frames=30)
    bench.run(1.0)
    assert bench.names == ["NONE"]
    assert statuses[-1].status[0].message == "deactivated: another program activates this node"
    assert bench.node.set_active(True)
    bench.signs.clear()
    bench.show(frames=6)
    assert bench.names == ["NONE"] * 3 + ["Forward"] * 3


def test_a_node_that_is_stuck_says_that_it_was_not_deactivated(bench: RecognitionBench) -> None:
    with bench.node._serving:
        assert not bench.node.set_active(False, timeout_s=0.01)
    assert bench.node.is_active


def test_two_cameras_on_one_topic_are_logged_and_one_on_each_is_not(caplog: pytest.LogCaptureFixture) -> None:
    bench = RecognitionBench()
    others: list[Any] = [bench.transport.advertise("front", IMAGE_COMPRESSED)]
    bench.run(10.0)
    assert not [record for record in caplog.records if "publishers" in record.message]
    others.append(bench.transport.advertise("intruder", IMAGE_RAW))
    bench.run(10.0)
    (line,) = [record.message for record in caplog.records if "publishers" in record.message]
    assert "/image_raw has 2 publishers (camera, intruder), and signs are recognised in the images of all" in line


def silences(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return what was logged about images that do not come; rospy, in other tests, turns on INFO for all."""
    return [message for message in caplog.messages if message.startswith("no image on")]


def test_a_topic_without_images_is_logged_once_until_one_comes(caplog: pytest.LogCaptureFixture) -> None:
    bench = RecognitionBench()
    bench.run(20.0)
    silence = "no image on /image_raw for 5 s, from camera"
    assert silences(caplog) == [silence]
    bench.show(frames=6)
    bench.run(4.5)
    assert silences(caplog) == [silence]
    bench.run(1.0)
    assert silences(caplog) == [silence] * 2
    RecognitionBench(SignsConfig(image_transport="compressed")).run(6.0)
    assert silences(caplog)[2:] == ["no image on /image_raw/compressed for 5 s, as no node publishes it"]


def test_a_node_that_is_deactivated_misses_no_images(caplog: pytest.LogCaptureFixture) -> None:
    bench = RecognitionBench()
    bench.node.set_active(False)
    bench.run(20.0)
    bench.node.set_active(True)
    bench.run(4.5)
    assert silences(caplog) == []
    bench.run(1.0)
    assert len(silences(caplog)) == 1
