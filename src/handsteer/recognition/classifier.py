"""The interface of sign classifiers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from handsteer.recognition.hand import Hand


@dataclass(frozen=True)
class SignGuess:
    """The sign of one hand in one frame.

    Attributes:
        sign: The likeliest sign, or ``NONE``.
        confidence: 0 to 1.
        likelihoods: The likelihood of each sign of the classifier, 0 to 1; may be empty.
    """

    sign: str
    confidence: float
    likelihoods: Mapping[str, float] = field(default_factory=dict, compare=False)


class Classifier(Protocol):
    """Recognises the sign from the landmarks of one hand; keeps no state between frames."""

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        ...

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows."""
        ...

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign`` with this ``likelihood``, 0 to 1."""
        ...
