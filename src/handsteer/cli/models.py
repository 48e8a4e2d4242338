"""``handsteer models``: fetch the landmark models."""

from typing import Any

from tqdm import tqdm

from handsteer.recognition.landmark_models import fetch_models


def models() -> int:
    """Fetch the landmark models, once, into the user's data directory.

    Example: handsteer models

    On a machine without network, set HANDSTEER_MODELS to a folder that has them.
    """
    bar: tqdm[Any] | None = None

    def progress(done: int, total: int) -> None:
        nonlocal bar
        bar = bar or tqdm(total=total, unit="B", unit_scale=True, desc="landmark models")
        bar.update(done - bar.n)

    paths = fetch_models(progress)
    if bar is not None:
        bar.close()
    print(f"the landmark models are in {paths[0].parent}")
    return 0
