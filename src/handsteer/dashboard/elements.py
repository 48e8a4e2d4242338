"""The basic elements of panels."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nicegui import ui

STATIC = Path(__file__).parent / "static"
"""Scripts and styles of the pages."""

UNKNOWN = "--"
"""Shown for an unknown value."""


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


def button(words: str, props: str) -> ui.element:
    """Return a button with ``words``; ``props`` may set an ``aria-label`` for screen readers."""
    with ui.element("button").classes("text-button").props(f'type="button" {props}') as element:
        ui.label(words).style("display: inline")
    return element


def switch(element: ui.element, name: str, *, on: bool) -> None:
    """Add the class ``name`` to ``element``, or remove it."""
    element.classes(add=name if on else "", remove="" if on else name)
