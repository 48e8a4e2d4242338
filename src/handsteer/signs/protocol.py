"""What every sign classifier offers."""

from dataclasses import dataclass
from typing import Protocol

from handsteer.landmarks.protocol import Hand


@dataclass(frozen=True)
class SignGuess:
    """What one hand in one frame shows.

    Attributes:
        sign: The likeliest sign, or ``NONE``.
        confidence: 0 to 1, how sure that is.
    """

    sign: str
    confidence: float


class Classifier(Protocol):
    """Tells the sign from the landmarks of one hand; keeps nothing from one frame to the next."""

    @property
    def signs(self) -> tuple[str, ...]:
        """The signs that it can tell, without ``NONE``."""
        ...

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows."""
        ...
