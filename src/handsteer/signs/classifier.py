"""What every sign classifier offers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from handsteer.landmarks.hand import Hand


@dataclass(frozen=True)
class SignGuess:
    """What one hand in one frame shows.

    Attributes:
        sign: The likeliest sign, or ``NONE``.
        confidence: 0 to 1, how sure that is.
        likelihoods: How likely each sign is that the classifier knows, 0 to 1; empty when it does not say.
    """

    sign: str
    confidence: float
    likelihoods: Mapping[str, float] = field(default_factory=dict, compare=False)


class Classifier(Protocol):
    """Tells the sign from the landmarks of one hand; keeps nothing from one frame to the next."""

    @property
    def signs(self) -> tuple[str, ...]:
        """The signs that it can tell, without ``NONE``."""
        ...

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows."""
        ...

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of one of its signs that is as likely as ``likelihood``, 0 to 1."""
        ...
