"""The node ``dashboard_lesson``: passes the camera's frames to a lesson, and runs its training."""

import logging
import threading
from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.clock import Clock
from handsteer.config import Config, SignsConfig
from handsteer.dashboard.lesson import Lesson, LessonState
from handsteer.errors import TrainingError
from handsteer.images import bgr_image, encode_jpeg
from handsteer.messages import IMAGE_RAW, Image
from handsteer.nodes.base import Node
from handsteer.recognition.custom_signs import CustomClassifier, CustomModel
from handsteer.recognition.hand import Classifier, Hand, Landmarker, SignGuess
from handsteer.recognition.recognizer import Recognizer, draw_hand
from handsteer.training.custom.background import BackgroundTraining
from handsteer.training.custom.collect import largest
from handsteer.training.custom.dataset import Dataset
from handsteer.transports.base import Received, Transport
from handsteer.types import NONE

log = logging.getLogger(__name__)

_WATCH_PERIOD_S: Final = 0.2
_NO_FRAME_S: Final = 1.0
_UNATTENDED_S: Final = 1.0
_LONGEST_STEP_S: Final = 0.5
_THUMBNAIL_HEIGHT: Final = 120
_NOTHING: Final = SignGuess(NONE, 0.0)

OpenModels = Callable[[], tuple[Landmarker, Classifier]]


class LessonNode(Node):
    """Runs one lesson; thread-safe.

    Hands are detected a second time, in addition to the recognition, only while takes are collected or tried.

    Args:
        transport: Carries the messages.
        clock: The graph's clock.
        lesson: Used only by this node from here on.
        known: The takes of earlier lessons, which are trained on too.
        open_models: Opens the landmarker and the classifier of the shipped signs; called on this node's thread.
        signs: Returns the current parameters of recognition.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        lesson: Lesson,
        known: Dataset,
        open_models: OpenModels,
        signs: Callable[[], SignsConfig],
    ) -> None:
        super().__init__("dashboard_lesson", transport, clock)
        self._lesson = lesson
        self._known = known
        self._open_models, self._signs = open_models, signs
        self._lock = threading.RLock()
        self._training: BackgroundTraining | None = None
        self._models: tuple[Landmarker, Classifier] | None = None
        self._trying: tuple[CustomModel, Recognizer] | None = None
        self._picture: tuple[NDArray[np.uint8], Hand, float] | None = None
        self._last_s: float | None = None
        self._last_frame_s = self._attended_s = clock.now()
        self.subscribe(IMAGE_RAW, self._on_image)
        self.every(_WATCH_PERIOD_S, self._watch)

    @property
    def state(self) -> LessonState:
        """The state of the lesson."""
        return self._lesson.state

    def attend(self) -> None:
        """Report that the teaching viewer's page is open; without this for a second, no takes are collected."""
        self._attended_s = self.clock.now()

    def record(self) -> None:
        """Start the countdown to the missing takes."""
        with self._lock:
            self._lesson.record()

    def pause(self) -> None:
        """Drop the current take, and stop collecting."""
        with self._lock:
            self._lesson.pause()

    def delete(self, number: int) -> None:
        """Delete a take."""
        with self._lock:
            self._lesson.delete(number)

    def train(self) -> None:
        """Train on the takes of this and earlier lessons, on a separate thread and in a separate process."""
        with self._lock:
            if not self._lesson.begin_training():
                return
            training = BackgroundTraining(self._known.with_takes([each.take for each in self.state.takes]))
            self._training = training
        threading.Thread(target=self._learn, args=(training,), name="lesson_training", daemon=True).start()

    def go_back(self) -> None:
        """Collect further takes; cancels a running training and drops the taught model."""
        with self._lock:
            self._cancel()
            self._lesson.go_back()

    def on_stop(self) -> None:
        """End the training."""
        with self._lock:
            self._cancel()

    def _cancel(self) -> None:
        training, self._training = self._training, None
        if training is not None:
            training.cancel()

    def _learn(self, training: BackgroundTraining) -> None:
        def progress(done: int, of: int) -> None:
            with self._lock:
                if self._training is training:
                    self._lesson.advance(done, of)

        error, result = "", None
        try:
            result = training.run(progress)
        except TrainingError as problem:
            error = str(problem)
        except Exception:
            log.exception("the training of %s failed", self._lesson.facts.label)
            error = "the training failed; the log says why"
        with self._lock:
            if self._training is not training:
                return  # it was cancelled
            self._training = None
            if result is not None:
                self._lesson.learn(*result)
            else:
                self._lesson.go_back(error)

    def _on_image(self, received: Received[Image]) -> None:
        now = self.clock.now()
        self._last_frame_s = now
        captured_s = received.captured_s if received.captured_s is not None else now
        step_s = 0.0 if self._last_s is None else min(max(0.0, captured_s - self._last_s), _LONGEST_STEP_S)
        self._last_s = captured_s
        state = self.state
        if state.step == "train":
            return
        if self._models is None:
            self._models = self._open_models()
        image = bgr_image(received.message)
        if state.step == "collect":
            self._collect(image, step_s, *self._models)
        elif state.model is not None:
            self._try(state.model, image, step_s, *self._models)

    def _collect(self, image: NDArray[np.uint8], step_s: float, landmarker: Landmarker, shipped: Classifier) -> None:
        hand = largest(landmarker.detect(image))
        guess = shipped.classify(hand) if hand is not None else _NOTHING
        with self._lock:
            status = self._lesson.see(hand, guess, step_s)
            if status.finished is not None and self._picture is not None:
                self._lesson.add(status.finished, thumbnail(*self._picture[:2]))
            if status.finished is not None or status.phase != "recording":
                self._picture = None
            elif hand is not None:
                self._choose_picture(image, hand, status.left_s)

    def _choose_picture(self, image: NDArray[np.uint8], hand: Hand, left_s: float) -> None:
        """Store the frame in the middle of the take; at its start the hand is still moving."""
        take_s = left_s if self._picture is None else self._picture[2]
        if self._picture is None or left_s >= take_s / 2:
            self._picture = image, hand, take_s

    def _try(
        self,
        model: CustomModel,
        image: NDArray[np.uint8],
        step_s: float,
        landmarker: Landmarker,
        shipped: Classifier,
    ) -> None:
        if self._trying is None or self._trying[0] is not model:
            landmarker.reset()
            classifier, config = CustomClassifier(shipped, model), Config(signs=self._signs())
            self._trying = model, Recognizer(config, landmarker=landmarker, classifier=classifier)
        seen = self._trying[1].step(image, step_s)
        with self._lock:
            self._lesson.try_out(seen)

    def _watch(self) -> None:
        now = self.clock.now()
        with self._lock:
            if now - self._attended_s > _UNATTENDED_S and self.state.recording:
                self._lesson.pause()
            if now - self._last_frame_s > _NO_FRAME_S:
                self._lesson.lose_frames()


def thumbnail(image: NDArray[np.uint8], hand: Hand) -> bytes:
    """Return a small, mirrored JPEG file of ``image``, (height, width, 3) uint8, BGR, with the skeleton of ``hand``."""
    height, width = image.shape[:2]
    size = (max(1, round(width * _THUMBNAIL_HEIGHT / height)), _THUMBNAIL_HEIGHT)
    small = np.asarray(cv2.resize(draw_hand(image, hand), size, interpolation=cv2.INTER_AREA), np.uint8)
    return encode_jpeg(small, 75).tobytes()
