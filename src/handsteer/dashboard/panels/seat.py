"""Who of the viewers drives."""

from collections.abc import Callable
from typing import ClassVar

from handsteer.dashboard.panels.elements import box, button, switch, text
from handsteer.dashboard.seat import Place, Role


class SeatPanel:
    """Whether this viewer drives, and the way to the driver's seat.

    Args:
        ask: Is called to ask for it.
        answer: Is called with True to hand it over, with False to keep it.
    """

    _WORDS: ClassVar[dict[Role, str]] = {"driver": "you drive", "watcher": "you watch", "free": "nobody drives"}

    def __init__(self, ask: Callable[[], None], answer: Callable[[bool], None]) -> None:
        with box("seat"):
            self._question = text("question", "")
            self._words = text("role chip", "")
            self._ask = button("Ask to drive", "").on("click", ask)
            self._yes = button("Hand over", "").on("click", lambda: answer(True))
            self._no = button("Keep", "").on("click", lambda: answer(False))

    def update(self, place: Place) -> None:
        """Show what the seat is for this viewer."""
        is_driver = place.role == "driver"
        asks = f"Somebody asks to drive; unanswered, they do in {place.left_s:.0f} s"
        waits = f"You drive in {place.left_s:.0f} s, or sooner"
        self._question.set_text((asks if is_driver else waits) if place.asked else "")
        self._words.set_text(self._WORDS[place.role])
        switch(self._ask, "hidden", on=is_driver or place.asked)
        for answer in (self._yes, self._no):
            switch(answer, "hidden", on=not (is_driver and place.asked))
