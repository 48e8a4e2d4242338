"""What the verbs share: options that come from the configuration, and how to speak to people."""

import gc
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from handsteer import config

Flag = Annotated[bool, Parameter(negative="")]
Parameters = Annotated[config.Config | None, Parameter(name="*", group="Every parameter (also in a --config file)")]
ConfigFile = Annotated[Path | None, Parameter(name="--config")]


def settings(
    file: Path | None,
    given: config.Config | None,
    shorthand: dict[str, Any] | None = None,
    base: dict[str, Any] | None = None,
    service: dict[str, Any] | None = None,
) -> config.Config:
    """Return the parameters.

    They come from the defaults, then ``base``, the file, a graph's parameter ``service``, the shorthand options, and
    the options by full name.
    """
    short = {
        section: {name: value for name, value in values.items() if value is not None}
        for section, values in (shorthand or {}).items()
    }
    full = given.model_dump(exclude_unset=True) if given else {}
    return config.load(file, base or {}, service or {}, short, full)


def say(message: str) -> None:
    """Tell people something, apart from the output."""
    print(f"handsteer: {message}", file=sys.stderr, flush=True)


def keep_what_is_loaded() -> None:
    """Let the garbage collector leave alone what was loaded until now; looking at all of it holds up every thread."""
    gc.collect()
    gc.freeze()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Ignore Ctrl-C and SIGTERM in this block: whoever presses Ctrl-C twice must not keep a robot from standing."""
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
