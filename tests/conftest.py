"""What tests share: where the real photos and clips are."""

from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Photos, clips and landmark rows of real people; kept beside the repository, never in it."""
    if not DATA.is_dir():
        pytest.skip(f"the real photos and clips are not there: {DATA}")
    return DATA


@pytest.fixture(scope="session")
def slideshow(data_dir: Path) -> Path:
    """A labelled slide show of people showing signs, 12 frames a second."""
    return data_dir / "videos" / "slideshow_emre_MIT_640x480.mp4"
