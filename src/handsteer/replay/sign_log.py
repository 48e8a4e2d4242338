"""Follows the signs of a recording: when each was the confirmed one, and what single frames showed."""

from handsteer.replay.drive_facts import DriveFacts, SignSpan, SignTotal

_MOST_SPANS = 20_000
_MOST_NAMES = 100
_LONGEST_NAME = 60
_OTHERS = "other signs"
# As the control, for which there is no sign when none has come for 0.35 s.
_SIGN_HOLDS_S = 0.35


class SignLog:
    """Follows the signs of a recording; times are in seconds since it began.

    Args:
        facts: Gets spans, totals and confidences.

    Attributes:
        sign: The newest confirmed sign; empty before the first.
    """

    def __init__(self, facts: DriveFacts) -> None:
        self.sign = ""
        self._facts = facts
        self._span: SignSpan | None = None
        self._index: dict[str, int] = {}

    def note(self, sign: str, time_s: float) -> None:
        """Note the confirmed sign of a frame."""
        self.sign = sign[:_LONGEST_NAME]
        name = _known(self.sign, self._facts.signs)
        total = self._facts.signs.setdefault(name, SignTotal())
        total.frames += 1
        if self._span is not None:
            self._span.end_s = min(time_s, self._span.end_s + _SIGN_HOLDS_S)
        if self._span is None or self._span.sign != name or self._span.end_s < time_s:
            self.end()
            total.times += 1
            self._span = SignSpan(name, time_s, time_s)
            if len(self._facts.spans) < _MOST_SPANS:
                self._facts.spans.append(self._span)

    def note_confidence(self, time_s: float, seen: str, confidence: float) -> None:
        """Note what the newest frame alone shows."""
        name = _known(seen[:_LONGEST_NAME], self._index)
        index = self._index.setdefault(name, len(self._index))
        if index == len(self._facts.seen):
            self._facts.seen.append(name)
        self._facts.confidence.add(time_s, max(0.0, min(confidence, 1.0)), index)

    def end(self) -> None:
        """Close the last span."""
        if self._span is not None:
            self._facts.signs[self._span.sign].seconds += self._span.end_s - self._span.begin_s


def _known(name: str, names: dict[str, SignTotal] | dict[str, int]) -> str:
    """Return ``name``, or a common one if there are too many."""
    return name if name in names or len(names) < _MOST_NAMES else _OTHERS
