"""The node ``dashboard_lesson``: passes the camera's frames to a lesson, and runs its training."""

import logging
import threading
from collections.abc import Callable
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from handsteer.clock import Clock
from handsteer.errors import TrainingError
from handsteer.images import bgr_image, mirrored
from handsteer.messages import IMAGE_RAW, Image
from handsteer.nodes.base import Node
from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lesson_state import LessonState
from handsteer.plugins.teach.background import BackgroundTraining
from handsteer.plugins.teach.collect import largest
from handsteer.recognition.custom_signs import CustomClassifier, CustomModel
from handsteer.recognition.hand import Classifier, Landmarker, SignGuess
from handsteer.transports.base import Received, Transport
from handsteer.types import NONE

T = TypeVar("T")
log = logging.getLogger(__name__)

_WATCH_PERIOD_S: Final = 0.2
_NO_FRAME_S: Final = 1.0
# Longer: a picture may take as long on a slow machine, and then the take is good.
_LOST_S: Final = 3.0
_UNATTENDED_S: Final = 1.0
_LONGEST_STEP_S: Final = 0.5
_NOTHING: Final = SignGuess(NONE, 0.0)

OpenModels = Callable[[], tuple[Landmarker, Classifier]]


class LessonNode(Node):
    """Runs one lesson; thread-safe.

    Hands are detected a second time, in addition to the recognition, only during a lesson.

    Args:
        lesson: Used only by this node from here on.
        open_models: Opens the landmarker and the classifier of the shipped signs; called on this node's thread.
        swaps_sides: Returns whether frames are mirrored before recognition now.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        lesson: Lesson,
        open_models: OpenModels,
        swaps_sides: Callable[[], bool],
    ) -> None:
        super().__init__("dashboard_lesson", transport, clock)
        self._lesson = lesson
        self._open_models = open_models
        self._swaps_sides = swaps_sides
        self._was_swapped: bool | None = None
        self._lock = threading.RLock()
        self._training: BackgroundTraining | None = None
        self._models: tuple[Landmarker, Classifier] | None = None
        self._classifier: tuple[CustomModel | None, Classifier] | None = None
        self._last_s: float | None = None
        self._last_frame_s = self._attended_s = clock.now()
        self.subscribe(IMAGE_RAW, self._on_image)
        self.every(_WATCH_PERIOD_S, self._watch)

    @property
    def state(self) -> LessonState:
        """The state of the lesson."""
        return self._lesson.state

    def attend(self) -> None:
        """Report that the teaching viewer's page is open; without this for a second, no takes are recorded."""
        self._attended_s = self.clock.now()

    def do(self, action: Callable[[Lesson], T]) -> T:
        """Return the result of ``action`` with the lesson, which must not be slow."""
        with self._lock:
            return action(self._lesson)

    def train(self) -> None:
        """Train on all takes, on a separate thread and in a separate process."""
        with self._lock:
            dataset = self._lesson.begin_training()
            if dataset is None:
                return
            training = self._training = BackgroundTraining(dataset)
        threading.Thread(target=self._learn, args=(training,), name="lesson_training", daemon=True).start()

    def cancel(self) -> None:
        """Cancel a running training."""
        with self._lock:
            self._cancel()
            self._lesson.end_training()

    def on_stop(self) -> None:
        """End the training."""
        with self._lock:
            self._cancel()

    def _cancel(self) -> None:
        training, self._training = self._training, None
        if training is not None:
            training.cancel()

    def _learn(self, training: BackgroundTraining) -> None:
        begun_s, first_s = self.clock.now(), 0.0

        def progress(done: int, of: int) -> None:
            nonlocal first_s
            if done == 1:
                first_s = self.clock.now()
            # The steps take equally long; what precedes the first does not count among them.
            left_s = (self.clock.now() - first_s) / (done - 1) * (of - done) if done > 1 else None
            with self._lock:
                if self._training is training:
                    self._lesson.advance(done, of, left_s)

        error, result = "", None
        try:
            result = training.run(progress)
        except TrainingError as problem:
            error = f"Nothing could be learnt: {problem}."
        except Exception:
            log.exception("the training failed")
            error = "The training failed; the log says why."
        with self._lock:
            if self._training is not training:
                return  # it was cancelled
            self._training = None
            if result is not None:
                self._lesson.learn(*result, took_s=self.clock.now() - begun_s)
            else:
                self._lesson.end_training(error)

    def _on_image(self, received: Received[Image]) -> None:
        now = self.clock.now()
        self._last_frame_s = now
        captured_s = received.captured_s if received.captured_s is not None else now
        step_s = 0.0 if self._last_s is None else min(max(0.0, captured_s - self._last_s), _LONGEST_STEP_S)
        self._last_s = captured_s
        state = self.state
        if state.is_training:
            return
        if self._models is None:
            self._models = self._open_models()
        landmarker, shipped = self._models
        if self._classifier is None or self._classifier[0] is not state.model:
            self._classifier = state.model, CustomClassifier(shipped, state.model) if state.model else shipped
        classifier = self._classifier[1]
        hand = largest(landmarker.detect(self._as_recognised(bgr_image(received.message), landmarker)))
        guess = classifier.classify(hand) if hand is not None else _NOTHING
        confidences = {sign: classifier.confidence(sign, chance) for sign, chance in guess.likelihoods.items()}
        with self._lock:
            self._lesson.see(hand, guess, confidences, step_s)
        # After the detection, which can take long on a slow machine: the camera is not lost then.
        self._last_frame_s = self.clock.now()

    def _as_recognised(self, image: NDArray[np.uint8], landmarker: Landmarker) -> NDArray[np.uint8]:
        """Return ``image`` as the recognition gets it, so that it finds in it what is taught."""
        is_swapped = self._swaps_sides()
        if self._was_swapped not in (None, is_swapped):
            # The hands of a take would be mirror images of each other.
            landmarker.reset()
            with self._lock:
                self._lesson.pause()
        self._was_swapped = is_swapped
        return mirrored(image) if is_swapped else image

    def _watch(self) -> None:
        now = self.clock.now()
        with self._lock:
            # Another person may be in view when the page, or the picture, is back.
            is_alone = now - self._attended_s > _UNATTENDED_S or now - self._last_frame_s > _LOST_S
            if is_alone and self.state.recorded is not None:
                self._lesson.pause()
            if now - self._last_frame_s > _NO_FRAME_S:
                self._lesson.lose_frames()
