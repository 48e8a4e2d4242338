"""From a frame to the confirmed sign: landmarks, classifier, hands at rest, hand selector and debouncer in a row."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer import doors
from handsteer.config import Config, SignsConfig, checked
from handsteer.recognition.custom_signs import CustomClassifier, load_custom_model
from handsteer.recognition.filters import Debouncer, Evidence, HandPosition, HandSelector, OpinionTimes
from handsteer.recognition.hand import Classifier, Hand, Landmarker, SignGuess
from handsteer.recognition.landmark_models import find_hand_models, find_model, is_grey
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.profile import ProfiledClassifier, load_profile, profile_path
from handsteer.recognition.resting import MODEL as PEOPLE_MODEL
from handsteer.recognition.resting import RestingHands
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, ShippedClassifier, load_model
from handsteer.types import GO, NONE, STOP, describe_seen

_NOTHING = SignGuess(NONE, 0.0)
_AT_REST = SignGuess(NONE, 0.0)


def open_landmarker(config: Config) -> Landmarker:
    """Return the hand landmarker.

    Raises:
        ModelError: A landmark model is missing or broken.
    """
    return MediaPipeLandmarker(config.landmarks)


def open_classifier(config: SignsConfig) -> Classifier:
    """Return the classifier of the shipped signs, as the person of the profile shows them, and of the taught signs.

    Raises:
        ModelError: A sign model or the profile is missing or broken.
        PluginError: The classifier is a plug-in that cannot be loaded.
    """
    if config.classifier != "shipped":
        known = doors.CLASSIFIERS.open(config.classifier, config)
    else:
        shipped = ShippedClassifier(load_model())
        profile = load_profile(profile_path(config.profile)) if config.profile else None
        known = shipped if profile is None else ProfiledClassifier(shipped, profile)
    return CustomClassifier(known, load_custom_model(config.model.expanduser())) if config.model else known


def model_files(config: Config) -> tuple[Path, ...]:
    """Return the files that ``config`` names: of palms, landmarks, people, shipped and taught signs, and the profile.

    Raises:
        ModelError: A landmark model is missing or broken.
    """
    taught = () if config.signs.model is None else (config.signs.model.expanduser(),)
    own = () if config.signs.profile is None else (profile_path(config.signs.profile),)
    people = (find_model(PEOPLE_MODEL),) if config.landmarks.reject_resting else ()
    return (*filter(None, find_hand_models(config.landmarks.model)), *people, DEFAULT_MODEL, *taught, *own)


@dataclass(frozen=True)
class Recognition:
    """The recognition of one frame.

    Attributes:
        sign: The confirmed sign, which drives.
        seen: The sign in this frame alone.
        confidence: Of ``seen``, 0 to 1.
        progress: Progress of confirming ``seen``, 0 to 1.
        hand: The active hand; None if there is none.
        likelihoods: The likelihood of each known sign for that hand, 0 to 1; empty without a hand.
    """

    sign: str
    seen: str
    confidence: float
    progress: float
    hand: Hand | None
    likelihoods: Mapping[str, float] = field(default_factory=dict, compare=False)

    @property
    def reason(self) -> str:
        """A sentence that describes what is seen."""
        return describe_seen(self.sign, self.seen, is_hand_in_view=self.hand is not None)


class Recognizer:
    """Recognises signs: in a stream of frames by :meth:`step`, in one picture by :meth:`recognize`.

    Args:
        config: The configuration; the defaults if None.
        landmarker: Finds the hands; opened from ``config.landmarks`` if None.
        classifier: Recognises the sign of a hand; opened from ``config.signs`` if None.

    Raises:
        ConfigError: ``config`` is something else, such as a dictionary.
        ModelError: A landmark model or the sign model is missing or broken.
    """

    def __init__(
        self,
        config: Config | None = None,
        *,
        landmarker: Landmarker | None = None,
        classifier: Classifier | None = None,
    ) -> None:
        config = checked(config)
        self._landmarker = landmarker or open_landmarker(config)
        self._classifier = classifier or open_classifier(config.signs)
        self._filter = Debouncer(config.signs)
        self._selector = HandSelector(config.signs)
        self._evidence = Evidence()
        self._resting = RestingHands(config.landmarks.threads) if config.landmarks.reject_resting else None
        self._opinions = OpinionTimes()
        self._config = config.signs

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        return self._classifier.signs

    def confidences(self, recognition: Recognition) -> tuple[float, ...]:
        """Return the confidence of each of :attr:`signs` in ``recognition``, 0 to 1; empty without a hand."""
        if recognition.hand is None:
            return ()
        chances, confidence = recognition.likelihoods, self._classifier.confidence
        return tuple(confidence(sign, chances.get(sign, 0.0)) for sign in self.signs)

    def recognize(self, image: NDArray[np.uint8] | str | Path) -> Recognition:
        """Return the recognition of one picture alone; resets the stream before and after.

        Its ``sign`` is that of the picture, without confirmation. A picture with other proportions than the camera saw,
        such as a photo that was squashed to a square, may give ``NONE``: hands are searched for as they look.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored; or the path of a photo, jpg or png.

        Raises:
            FrameError: The image has another shape or type.
            CameraUnreadable: The photo cannot be read or decoded.
        """
        if isinstance(image, str | Path):
            from handsteer.cameras.files import read_photo  # noqa: PLC0415 - a stream of frames does not need it

            image = read_photo(Path(image))
        self.reset()
        recognition = self._step(image, 0.0, alone=True)
        self.reset()
        return replace(recognition, sign=recognition.seen)

    def step(self, image: NDArray[np.uint8], dt_s: float) -> Recognition:
        """Process the next frame.

        Args:
            image: (height, width, 3) uint8, BGR, not mirrored.
            dt_s: Seconds since the last frame was captured, >= 0.

        Raises:
            FrameError: The image has another shape or type.
        """
        return self._step(image, dt_s)

    def _step(self, image: NDArray[np.uint8], dt_s: float, *, alone: bool = False) -> Recognition:
        """Process a frame, ``alone`` or as the next of a stream."""
        # A hand whose sign is being confirmed is effectively selected.
        search = self._selector.wants_search() and self._filter.candidate == NONE
        found = self._landmarker.detect(image, search=search, dt_s=dt_s)
        classified = [self._classifier.classify(hand) for hand in found]
        if self._signs(classified) <= {NONE}:
            # The landmark model may not have followed a finger. A sign, Stop above all, does not wait for that.
            found, before = [self._landmarker.look_again(image, hand) for hand in found], found
            classified = [
                guess if hand is earlier else self._classifier.classify(hand)
                for hand, earlier, guess in zip(found, before, classified, strict=True)
            ]
        hands = list(found)
        self._opinions.wait(dt_s)
        if self._signs(classified) <= {NONE, GO} and (alone or self._opinions.are_due):
            # A lost finger leaves what looks like a fist.
            self._ask_second_opinion(image, hands, classified)
        guesses = [self._seen(guess) for guess in classified]
        if self._resting is not None:
            self._resting.next_frame(dt_s)
            guesses = self._raised(self._resting, image, hands, guesses, alone=alone, dt_s=dt_s)
        chosen = self._selector.choose(hands, guesses, dt_s)
        hand, guess = (hands[chosen], guesses[chosen]) if chosen is not None else (None, _NOTHING)
        likelihoods = {} if chosen is None or guess is _AT_REST else classified[chosen].likelihoods
        since_s = self._filter.candidate_s + dt_s
        if guess is _AT_REST:
            self._evidence.reset()
        else:
            self._evidence.add(HandPosition.of_palm(hand) if hand else None, likelihoods, dt_s)
            guess = self._bridged(guess, since_s)
        still = self._evidence.is_still(min(since_s, self._config.confirm_time))
        sign = self._filter.step(guess.sign, dt_s, still=still)
        if chosen is not None and guess.sign == sign != NONE:
            self._selector.confirm()
            self._landmarker.follow_only(found[chosen])
        return Recognition(sign, guess.sign, guess.confidence, self._filter.progress, hand, likelihoods)

    def reconfigure(self, config: SignsConfig) -> None:
        """Change confidences and times; the active hand and the confirmed sign stay."""
        self._config = config
        self._filter.reconfigure(config)
        self._selector.reconfigure(config)

    def use(self, classifier: Classifier) -> None:
        """Use ``classifier`` from the next frame on; every sign must be confirmed again."""
        self._classifier = classifier
        self.reset()

    def reset(self) -> None:
        """Reset the stream: no active hand, no confirmed sign."""
        self._landmarker.reset()
        self._filter.reset()
        self._selector.reset()
        self._evidence.reset()
        self._opinions = OpinionTimes()
        if self._resting is not None:
            self._resting.reset()

    def _ask_second_opinion(self, image: NDArray[np.uint8], hands: list[Hand], classified: list[SignGuess]) -> None:
        """Replace those of ``hands`` that point by a second opinion, and what they show.

        Only a finger or a thumb is lost, so nothing else counts. The hand has to point mirrored as well; not in a
        picture without colours, in which most fingers are lost, unless a fist is seen.
        """
        ask = self._landmarker.second_opinion
        for index, hand in enumerate(hands):
            seen = ask(image, hand)
            if seen is None:
                continue
            guess = self._classifier.classify(seen)
            sign = self._seen(guess).sign
            points = sign not in (NONE, STOP, GO)
            if points and not (self._seen(classified[index]).sign == NONE and is_grey(image)):
                other = ask(image, hand, mirrored=True) or hand
                points = self._seen(self._classifier.classify(other)).sign == sign
            if points:
                hands[index], classified[index] = seen, guess
            self._opinions.note(has_changed=points)

    def _raised(
        self,
        resting: RestingHands,
        image: NDArray[np.uint8],
        hands: Sequence[Hand],
        guesses: Sequence[SignGuess],
        *,
        alone: bool,
        dt_s: float,
    ) -> list[SignGuess]:
        """Return ``guesses`` without the signs of hands at rest; people are searched for when a sign is about to count.

        A ``Stop`` does not wait for that, and counts at rest too, unless another hand shows a sign.
        """
        several = sum(guess.sign != NONE for guess in guesses) > 1
        raised = []
        for hand, guess in zip(hands, guesses, strict=True):
            search = alone or several or self._filter.is_due(guess.sign, dt_s)
            asked = guess.sign != NONE and (several or guess.sign != STOP)
            drives = guess.sign == self._filter.sign
            is_resting = asked and resting.is_resting(image, hand, search=search, drives=drives)
            raised.append(_AT_REST if is_resting else guess)
        return raised

    def _bridged(self, guess: SignGuess, since_s: float) -> SignGuess:
        """Return the candidate instead of a ``NONE`` guess, if its mean likelihood so far is above its threshold."""
        candidate = self._filter.candidate
        if guess.sign != NONE or candidate == NONE:
            return guess
        likelihood = self._evidence.likelihood(candidate, since_s)
        confidence = self._classifier.confidence(candidate, likelihood)
        return SignGuess(candidate, confidence) if confidence >= self._config.min_confidence else guess

    def _signs(self, classified: Sequence[SignGuess]) -> set[str]:
        return {self._seen(guess).sign for guess in classified}

    def _seen(self, guess: SignGuess) -> SignGuess:
        """Return ``guess`` if above its threshold, else ``NONE``; the confirmed sign has a lower threshold."""
        least = self._config.release_confidence if guess.sign == self._filter.sign else self._config.min_confidence
        return guess if guess.confidence >= min(least, self._config.min_confidence) else _NOTHING
