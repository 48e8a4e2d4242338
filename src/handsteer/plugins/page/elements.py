"""Basic elements of pages."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nicegui import ui

STATIC = Path(__file__).parent / "static"
"""Scripts and styles of the pages."""

_LONGEST_WORDS = 200


@contextmanager
def card(title: str, classes: str) -> Iterator[ui.element]:
    """Put the elements created within into a card with a heading; yield the card."""
    with ui.element("section").classes(f"card {classes}") as element:
        tag("h2", "", title)
        yield element


def box(classes: str) -> ui.element:
    """Return an empty ``div``."""
    return ui.element("div").classes(classes)


def text(classes: str, words: str) -> ui.label:
    """Return a ``div`` with ``words``."""
    return ui.label(words).classes(classes)


def tag(name: str, classes: str, words: str) -> ui.label:
    """Return an element of the tag ``name`` with ``words``."""
    label = ui.label(words).classes(classes)
    label.tag = name
    return label


def identifier(classes: str, words: str) -> ui.label:
    """Return a ``div`` with a name, such as a topic's or a file's, which is the same in all languages."""
    return text(classes, words).props("translate=no")


def button(words: str, on_click: Callable[[], object] | None = None, label: str = "") -> ui.element:
    """Return a button with ``words``, and an ``aria-label`` for screen readers if they need more."""
    with ui.element("button").classes("text-button").props('type="button"') as element:
        ui.label(words).style("display: inline")
    if label:
        element.props(f'aria-label="{label}"')
    return element.on("click", on_click) if on_click else element


def sentence(words: str) -> str:
    """Return ``words`` with a capital at the start."""
    return words[:1].upper() + words[1:]


def switch(element: ui.element, name: str, *, on: bool) -> None:
    """Add the class ``name`` to ``element``, or remove it."""
    element.classes(add=name if on else "", remove="" if on else name)


def set_property(element: ui.element, name: str, value: object) -> None:
    """Set a property of ``element``.

    Setting it by ``props`` sends it to the browser, which then draws the whole page, even if it is the same as before.
    """
    if element.props.get(name) != value:
        element.props[name] = value


def read_words(sent: object) -> str:
    """Return the sentence that a browser sent, for its own page; empty if it is invalid."""
    words = sent.get("words") if isinstance(sent, dict) else None
    return words[:_LONGEST_WORDS] if isinstance(words, str) else ""
