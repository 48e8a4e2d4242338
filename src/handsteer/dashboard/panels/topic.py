"""Which topic steering by hand goes to."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.panels.elements import box, button, switch, text
from handsteer.dashboard.state import PageState
from handsteer.errors import TransportError
from handsteer.messages import STEERING_CMD_VEL

_LONGEST = 200


class TopicBox:
    """The topic's name, and what it means that it is this one.

    Args:
        choose: Is called with another name, and raises TransportError when that cannot be; None where there is no
            choice.
    """

    def __init__(self, choose: Callable[[str], None] | None) -> None:
        self._choose = choose
        self._shown = ""
        with box("topic"):
            self._name = ui.input("topic", value=STEERING_CMD_VEL.name).props(f"dense outlined maxlength={_LONGEST}")
            self._name.props("spellcheck=false autocapitalize=off")
            if choose is None:
                self._name.props("readonly")
            else:
                self._name.on("keydown.enter", self._use)
                button("Use", 'aria-label="Steer on this topic"').on("click", self._use)
        self._words = text("topic-words", "")
        self._trouble = text("trouble", "").props('role="alert"')

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        topic = state.viewers.topic
        shown = topic or STEERING_CMD_VEL.name
        if shown == self._shown:
            return
        self._shown = shown
        self._name.set_value(shown)
        self._words.set_text(
            f"Past the control: signs may drive meanwhile. Stop holds here too. {STEERING_CMD_VEL.name} goes back."
            if topic
            else "Goes through the control, before the signs."
        )
        switch(self._words, "direct", on=bool(topic))

    def _use(self) -> None:
        if self._choose is None:
            return
        try:
            self._choose(str(self._name.value)[:_LONGEST].strip())
        except TransportError as error:
            self._trouble.set_text(str(error))
        else:
            self._trouble.set_text("")
