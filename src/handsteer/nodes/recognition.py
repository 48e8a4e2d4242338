"""The node ``hand_sign_recognition``, which publishes a sign for each frame."""

import logging
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from handsteer.clock import Clock
from handsteer.config import Config, JoystickConfig, SignsConfig
from handsteer.control.explain import Reason
from handsteer.errors import ConfigError, FrameError, ModelError, ProfileError
from handsteer.images import bgr_image, image_message, jpeg_picture, mirrored
from handsteer.messages import (
    GESTURE_JOY,
    HAND_SIGN,
    IMAGE_ANNOTATED,
    IMAGE_COMPRESSED,
    IMAGE_DRAWN,
    IMAGE_LANDMARKS,
    IMAGE_RAW,
    CompressedImage,
    Header,
    Image,
    Joy,
    String,
    Topic,
    joy_of,
)
from handsteer.nodes.base import Node
from handsteer.nodes.callbacks import Queue
from handsteer.nodes.status import RecognitionStatus
from handsteer.nodes.supervision import Look, Rivals, StopKeeper
from handsteer.nodes.timing import (
    CALM_S,
    TOO_SLOW,
    FrameAge,
    LatencyLog,
    PlayedTime,
    Recording,
    StallGuard,
    far_and_late,
)
from handsteer.pipeline import FramePipeline
from handsteer.recognition.drawing import annotate
from handsteer.recognition.hand import Hand
from handsteer.recognition.profile import profile_path
from handsteer.recognition.recognizer import Recognition, Recognizer, open_classifier
from handsteer.timeouts import PLAYED_S
from handsteer.transports.base import Received, Subscription, Transport
from handsteer.types import NONE, RELEASED, Handedness

_WATCH_PERIOD_S = 0.02
# Longer than FAULT_GAP_S, so that the control does not take these ``NONE`` for processed frames.
_SILENCE_PERIOD_S = 0.5
_DIAGNOSE_PERIOD_S = 0.1
_CHOOSE_PERIOD_S = 0.5

log = logging.getLogger(__name__)

M = TypeVar("M", Image, CompressedImage)

# Ten seconds of raw images of 640x480 at 30 a second, and minutes of JPEG.
_MOST_PLAYED_BYTES = 2**28
_REPORT_PLAYED_S = 5.0
_SLOWER = "the recording is played faster than this machine recognises: play it at a lower rate (-r 0.5)"

_CHANGED = "what is read in pictures was changed"
_CHANGED_MARGIN_S = 0.1

_BESIDE_PLAYER = "old frames do not count while a recording is played next to another publisher of the same topic"

_FREEZE_EXPLAINED_S = 3.0
_SILENCE_LOGGED_S = 5.0
"""A webcam that is opened takes up to a few seconds."""
# An older refusal no longer explains why there are no frames.
_REFUSAL_SHOWN_S = 10.0
_FROZEN = (
    "Only new pictures count, so that a camera that hangs cannot drive: start it again. To try a photo, publish it "
    "with noise that changes, as handsteer's own camera does with a folder of photos"
)


class HandSignRecognitionNode(Node):
    """Publishes one sign per frame, and ``NONE`` while no frames arrive.

    Args:
        recognizer: Recognises the signs.
        config: Maximum age of a frame, and which images to subscribe to.
        joystick: Parameters of the hand as a joystick, and of where it points; the defaults when None.
        points: Whether the pictures show where the hand points, instead of the hand as a joystick.
        image, compressed: Topics of the frames, and of the same as JPEG.
        sign, joy: Topics of the signs, and of the hand as a joystick and where it points.
        camera_changed: Topic on which it is published that another camera was chosen; none where it cannot be.

    Attributes:
        counts: Number of frames per confirmed sign.
        processing: Processing time of each frame.
        is_camera_far: Whether the frames are those of a browser on another machine, which late ones are explained with;
            may be set on any thread.
    """

    is_managed = True

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        recognizer: Recognizer,
        config: SignsConfig,
        *,
        joystick: JoystickConfig | None = None,
        points: bool = False,
        image: Topic[Image] = IMAGE_RAW,
        compressed: Topic[CompressedImage] = IMAGE_COMPRESSED,
        sign: Topic[String] = HAND_SIGN,
        joy: Topic[Joy] = GESTURE_JOY,
        camera_changed: Topic[String] | None = None,
    ) -> None:
        super().__init__("hand_sign_recognition", transport, clock)
        self.counts: dict[str, int] = {}
        self.processing = LatencyLog()
        self.is_camera_far = False
        self._pipeline = FramePipeline(recognizer, joystick)
        self._points = points
        self._config = config
        self._models = _versions_of(config)
        self._last_captured_s: float | None = None
        self._last_frame_s = clock.now()
        self._last_sign_s = clock.now()
        self._last_played_s = -math.inf
        self._last_hand_s: float | None = None
        self._age = FrameAge(config.max_frame_age, one_clock=transport.is_one_machine)
        self._stall_guard = StallGuard(config.max_frame_age, clock.now())
        self._recording, self._played = Recording(config.recorded), PlayedTime(config.max_frame_age)
        self._refused: str | None = None
        self._has_explained_freeze = self._has_logged_silence = False
        self._activated_s = clock.now()
        self._refused_s = -math.inf
        self._recognition: Recognition | None = None
        self._camera_since_s = self._changed_until_s = -math.inf
        StopKeeper(self)
        self._sign = self.publisher(sign)
        self._joy = self.publisher(joy)
        pictures = (IMAGE_ANNOTATED, IMAGE_LANDMARKS, IMAGE_DRAWN)
        self._pictures = tuple((topic, self.publisher(topic)) for topic in pictures)
        self._frames, self._jpegs = image, compressed
        wanted = config.image_transport
        self._compressed = wanted == "compressed" or (wanted == "auto" and transport.crosses_network)
        if camera_changed is not None:
            self.subscribe(camera_changed, self._on_other_camera)
        self._images = self._take_images()
        self._chooses = wanted == "auto"
        self._wants_compressed = False
        self.every(_CHOOSE_PERIOD_S, self._choose_images)
        cameras: dict[str, Look] = {
            transport.topic_name(topic): partial(self._cameras_on, topic) for topic in (image, compressed)
        }
        Rivals(self, [], cameras, _many_cameras)
        self._watchdog = self.every(_WATCH_PERIOD_S, self._watch)
        self.diagnose_every(_DIAGNOSE_PERIOD_S, self._report)

    def look_at_compressed(self) -> None:
        """Subscribe to the compressed images from now on: a recording has these, and its replay must see the same.

        May be called from any thread.
        """
        self._wants_compressed = True
        if not self._running and not self._compressed:
            self._change_images()

    def check(self, config: Config) -> None:
        """Raise ConfigError if the file of ``signs.model`` or ``signs.profile`` has changed and cannot be used."""
        if self._has_other_models(config.signs):
            try:
                open_classifier(config.signs)
            except ProfileError as error:
                raise ConfigError(f"signs.profile: {error}") from None
            except ModelError as error:
                raise ConfigError(f"signs.model: {error}") from None

    def on_reconfigure(self, config: Config) -> None:
        """Apply ``signs``, with its model and profile if a file was replaced or rewritten, and ``joystick``.

        After a change of ``signs``, nothing is published until the control has noticed a pause, so that it waits for
        neutral: a hand that is held still may now show a sign that it did not show before.
        """
        has_other_models = self._has_other_models(config.signs)
        if has_other_models or _read_by(config.signs) != _read_by(self._config):
            pause_s = max(config.control.sign_timeout, _SILENCE_PERIOD_S) + _CHANGED_MARGIN_S
            self._changed_until_s = self.clock.now() + pause_s
            self._forget()
        if has_other_models:
            versions = _versions_of(config.signs)
            self._pipeline.recognizer.use(open_classifier(config.signs))
            self._pipeline.forget_gestures()
            self._models = versions
        self._config = config.signs
        limit_s = config.signs.max_frame_age
        self._age.limit_s = self._played.limit_s = self._stall_guard.limit_s = limit_s
        self._pipeline.recognizer.reconfigure(config.signs)
        self._pipeline.reconfigure(config.joystick)
        self._points = config.control.points

    def _has_other_models(self, config: SignsConfig) -> bool:
        return any(
            # A file stays loaded after it is deleted.
            version != mine and not (version is not None and mine is not None and version == (mine[0], *_GONE))
            for version, mine in zip(_versions_of(config), self._models, strict=True)
        )

    def _on_other_camera(self, received: Received[String]) -> None:
        """Forget the hand, and what it showed to the camera before."""
        self._camera_since_s = self.clock.now() if received.captured_s is None else received.captured_s
        self._forget()

    def _on_frame(self, received: Received[M], picture_of: Callable[[M], NDArray[np.uint8]]) -> None:
        if not self.is_active:
            return
        began_s = self.clock.now()
        captured_s = received.captured_s if received.captured_s is not None else began_s
        self._stall_guard.note(began_s)
        if self._recording.follows(began_s, captured_s, by_player=received.by_player):
            self._on_played(self._picture(received, picture_of, began_s), received, began_s)
            return
        self._played.end()
        self._refused = self._why_old(began_s, captured_s, is_late=received.is_late)
        if self._refused is None and captured_s < self._camera_since_s:
            self._refused = "a picture of the camera before"
        elif self._refused is None and began_s < self._changed_until_s:
            self._refused = _CHANGED
        if self._refused is None and self._stall_guard.distrusts(began_s):
            self._refused = f"{TOO_SLOW}: pictures may have waited"
        image = self._picture(received, picture_of, began_s)
        if self._refused is None:
            self._look_at(image, received, began_s, self._since_last_frame(captured_s))
        else:
            self._pipeline.pass_over(mirrored(image) if self._config.swap_sides else image)
        if self._refused is not None:
            self._refused_s = began_s  # a stale or repeated frame does not count: the watchdog publishes NONE

    def _why_old(self, began_s: float, captured_s: float, *, is_late: bool) -> str | None:
        """Return why a frame is too old, in words; None if it is not. A late one says nothing of clocks."""
        refused = None if is_late else self._age.why_refused(began_s, captured_s, is_far=self.is_camera_far)
        if not (is_late or refused):
            return None
        hint = self._recording.hint(began_s)  # logged, too
        return _BESIDE_PLAYER if is_late else hint or refused

    def _picture(
        self, received: Received[M], picture_of: Callable[[M], NDArray[np.uint8]], began_s: float
    ) -> NDArray[np.uint8]:
        try:
            return picture_of(received.message)
        except FrameError as error:
            self._refused, self._refused_s = str(error), began_s
            raise  # to be logged

    def _on_played(self, image: NDArray[np.uint8], received: Received[M], began_s: float) -> None:
        """Process a frame of a recording: the result depends on the frames and their stamps alone."""
        since_last_s = self._played.since_last(received.message.header.stamp)
        if since_last_s is None:
            self._pipeline.begin_again()
            self._played.report()
        elif since_last_s > self._config.max_frame_age:
            self._forget()
        self._last_captured_s = None
        self._look_at(image, received, began_s, since_last_s or 0.0)
        is_new, seen = self._refused is None, self._recognition
        self._played.count(seen.sign if is_new and seen is not None else "not new")
        if self._played.note(since_last_s or 0.0, counts=is_new):
            self._publish_none(began_s)
        if self._refused is not None:
            self._refused_s = began_s
        self._last_sign_s = self._last_played_s = self.clock.now()

    def _look_at(self, image: NDArray[np.uint8], received: Received[M], began_s: float, since_last_s: float) -> None:
        image = mirrored(image) if self._config.swap_sides else image
        is_joystick_wanted, is_played = self._joy.has_subscribers, self._recording.is_followed
        sight = self._pipeline.step(
            image,
            since_last_s,
            recorded=is_played,
            as_joystick=is_joystick_wanted,
            why_too_late=lambda: None if is_played else self._why_too_late(began_s),
        )
        self._refused, recognition = sight.refused, sight.recognition
        self._explain_freeze()
        if recognition is not None and recognition.hand is not None:
            self._last_hand_s = began_s
        if self._refused is not None or recognition is None:
            return
        self._last_frame_s = self._last_sign_s = began_s
        self._watchdog.delay_until(began_s + min(CALM_S, self._config.max_frame_age))
        self._recognition = recognition
        self.counts[recognition.sign] = self.counts.get(recognition.sign, 0) + 1
        self._sign.publish(String(data=recognition.sign), received.captured_s)
        if is_joystick_wanted:
            header = received.message.header
            if is_played:  # it drives now
                header = Header(stamp=self.clock.stamp(began_s), frame_id=header.frame_id)
            message = joy_of(sight.stick, header, engages=sight.engages, pointing=sight.pointing)
            self._joy.publish(message, received.captured_s)
        self.processing.add(self.clock.now() - began_s)
        for topic, publisher in self._pictures:
            if publisher.has_subscribers:
                ground = np.zeros_like(image) if topic is IMAGE_DRAWN else image
                picture = annotate(ground, recognition, names_sign=topic is IMAGE_ANNOTATED)
                self._pipeline.draw(picture, points=self._points)
                publisher.publish(image_message(picture, received.message.header), received.captured_s)

    def _explain_freeze(self) -> None:
        if not self._has_explained_freeze and self._pipeline.frozen_s > _FREEZE_EXPLAINED_S:
            self._has_explained_freeze = True
            log.warning("%s: the same picture for %.0f s. %s", self._frames.name, _FREEZE_EXPLAINED_S, _FROZEN)

    def _why_too_late(self, began_s: float) -> str | None:
        """Return why a fresh frame has no sign: this process was stopped or stalled while it was processed."""
        came_s = max(0.0, self._age.age_s)
        age_s = came_s + self.clock.now() - began_s
        if age_s <= self._config.max_frame_age:
            return None
        if self.is_camera_far and came_s > age_s / 2:
            return far_and_late(came_s)
        return f"{TOO_SLOW}: a picture was {age_s:.1f} s old when its sign was known"

    def _take_images(self) -> Subscription:
        played: Queue[Any] = Queue(self._is_played, lambda image: int(image.data.size), _MOST_PLAYED_BYTES, _SLOWER)
        if self._compressed:
            return self.subscribe(self._jpegs, lambda received: self._on_frame(received, jpeg_picture), queue=played)
        return self.subscribe(self._frames, lambda received: self._on_frame(received, bgr_image), queue=played)

    def _is_played(self, received: Received[Any]) -> bool:
        """Return whether a frame that arrives is a recording's, which are processed each; of others, the newest is."""
        asks_age = self._config.recorded == "always" and received.captured_s is not None
        age_s = self.clock.now() - (received.captured_s or 0.0) if asks_age else 0.0
        return self._recording.means(age_s, by_player=received.by_player)

    def _choose_images(self) -> None:
        """Subscribe to the other kind of images if a camera has only that, or a recording asks for it."""
        if self._wants_compressed and not self._compressed:
            self._change_images()
        if self._wants_compressed or not self._chooses:
            return
        taken, other = (self._jpegs, self._frames) if self._compressed else (self._frames, self._jpegs)
        names = self.transport.publishers_of
        if names(taken) or not names(other):
            return
        self._change_images()
        here, there = (self.transport.topic_name(topic) for topic in (taken, other))
        log.info("no node publishes %s: images are taken from %s, of %s", here, there, ", ".join(names(other)))

    def _cameras_on(self, topic: Topic[Any]) -> list[str]:
        """Return the nodes that publish ``topic``; none if images are not taken from it."""
        return self.transport.publishers_of(topic) if (topic == self._jpegs) == self._compressed else []

    def _change_images(self) -> None:
        self._images.close()
        self._compressed = not self._compressed
        self._images = self._take_images()

    def _since_last_frame(self, captured_s: float) -> float:
        last_s = captured_s if self._last_captured_s is None else self._last_captured_s
        self._last_captured_s = captured_s
        return max(0.0, captured_s - last_s)

    def _watch(self) -> None:
        now = self.clock.now()
        self._stall_guard.note(now)
        has_played = now - self._last_played_s <= PLAYED_S
        if now - self._last_played_s > _REPORT_PLAYED_S:
            self._played.report()
        if self.is_active:
            self._log_silence(now)
        if not self.is_active or has_played or now - self._last_frame_s <= self._config.max_frame_age:
            return
        period_s = _SILENCE_PERIOD_S if self._recognition is None else self._config.max_frame_age
        if now - self._last_sign_s > period_s:
            self._last_sign_s = now
            self._publish_none(now)

    def _log_silence(self, now_s: float) -> None:
        last_s = max(self._last_frame_s, self._refused_s, self._last_played_s, self._activated_s)
        is_silent = now_s - last_s > _SILENCE_LOGGED_S
        if is_silent and not self._has_logged_silence:
            topic = self._jpegs if self._compressed else self._frames
            name, cameras = self.transport.topic_name(topic), self.transport.publishers_of(topic)
            who = f"from {', '.join(cameras)}" if cameras else "as no node publishes it"
            log.warning("no image on %s for %.0f s, %s", name, now_s - last_s, who)
        self._has_logged_silence = is_silent

    def _publish_none(self, now_s: float) -> None:
        self._forget()
        self._sign.publish(String(data=NONE))
        if self._joy.has_subscribers:
            self._joy.publish(joy_of(RELEASED, Header(stamp=self.clock.stamp(now_s), frame_id="")))

    def on_activate(self) -> None:
        """Begin with the next frame."""
        self._activated_s = self.clock.now()
        self._played.end()
        self._pipeline.begin_again()

    def on_deactivate(self) -> None:
        """Publish that no sign is seen."""
        self._publish_none(self.clock.now())

    def _forget(self) -> None:
        self._pipeline.forget()
        self._recognition = None

    def _report(self) -> RecognitionStatus:
        now, seen = self.clock.now(), self._recognition
        if not self.is_active:
            return RecognitionStatus(signs=self._pipeline.recognizer.signs, refused=Reason("inactive").explanation)
        if seen is None:
            refuses_now = self._refused is not None and now - self._refused_s <= self._config.max_frame_age
            no_frame_s = None if refuses_now else round(now - max(self._last_frame_s, self._refused_s), 1)
            is_recent = now - self._refused_s <= _REFUSAL_SHOWN_S
            signs, refused = self._pipeline.recognizer.signs, (self._refused or "") if is_recent else ""
            return RecognitionStatus(signs=signs, no_frame_s=no_frame_s, refused=refused)
        is_hand_lost = seen.hand is None and self._last_hand_s is not None
        return RecognitionStatus(
            sign=seen.sign,
            signs=self._pipeline.recognizer.signs,
            seen=seen.seen,
            confidence=round(seen.confidence, 2),
            confidences=tuple(round(each, 2) for each in self._pipeline.recognizer.confidences(seen)),
            min_confidence=self._config.min_confidence,
            progress=round(seen.progress, 2),
            engage_progress=round(self._pipeline.gesture.progress, 2),
            handedness=self._handedness(seen.hand) if seen.hand else "",
            sides_swapped=self._config.swap_sides,
            no_hand_s=round(now - (self._last_hand_s or 0.0), 1) if is_hand_lost else None,
            processing_ms=round(self.processing.percentile_ms(50), 1),
            processing_p99_ms=round(self.processing.percentile_ms(99), 1),
            recording=self._recording.is_followed,
            frame_age_ms=round(self._age.age_s * 1000),
            clock_ahead_ms=round(self._age.ahead_s * 1000),
        )

    def _handedness(self, hand: Hand) -> Handedness:
        if not self._config.swap_sides:
            return hand.handedness
        return "Left" if hand.handedness == "Right" else "Right"


def _many_cameras(topic: str, cameras: Sequence[str]) -> str:
    return (
        f"{topic} has {len(cameras)} publishers ({', '.join(cameras)}), and signs are recognised in the images of all "
        "in turn: end all but one, or give each a topic of its own by remapping"
    )


_GONE = (-1, -1)


def _read_by(config: SignsConfig) -> dict[str, Any]:
    """Return the parameters that can change while the node runs; others of a configuration need not be its own."""
    return config.model_dump(include=set(config.live))


def _versions_of(config: SignsConfig) -> list[tuple[Path, int, int] | None]:
    """Return the versions of the files of ``signs.model`` and ``signs.profile``."""
    return [_version_of(config.model), _version_of(config.profile and profile_path(config.profile))]


def _version_of(model: Path | None) -> tuple[Path, int, int] | None:
    """Return what identifies a version of a file: path, inode and modification time in ns; None if there is none."""
    if model is None:
        return None
    try:
        facts = model.expanduser().stat()
    except OSError:
        return (model, *_GONE)
    return (model, facts.st_ino, facts.st_mtime_ns)
