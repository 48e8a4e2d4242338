"""Fetches the landmark models, with the progress in a terminal."""

import sys
from pathlib import Path
from typing import Any

from tqdm import tqdm

from handsteer.cli.running import say
from handsteer.errors import ModelMissing
from handsteer.recognition.landmark_models import are_elsewhere, fetch_models, find_pair


def fetch() -> Path:
    """Return the folder of the landmark models, after fetching those that are missing.

    Raises:
        ModelError: They cannot be fetched or stored.
    """
    bar: tqdm[Any] | None = None

    def progress(done: int, total: int) -> None:
        nonlocal bar
        if bar is None:
            say(f"downloading the landmark models, once: {total / 1e6:.0f} MB")
            bar = tqdm(total=total, unit="B", unit_scale=True, disable=not sys.stderr.isatty())
        bar.update(done - bar.n)

    try:
        return fetch_models(progress)[0].parent
    finally:
        if bar is not None:
            bar.close()


def fetch_missing(model: str) -> None:
    """Fetch the models if those of ``landmarks.model`` are missing, unless HANDSTEER_MODELS names their folder.

    Raises:
        ModelError: They cannot be fetched or stored, or one is damaged.
    """
    try:
        find_pair(model)
    except ModelMissing:
        if are_elsewhere():
            raise
        fetch()
