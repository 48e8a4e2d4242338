"""What tests of the page share."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.plugins.page.served import Site
from tests.plugins.page.webcams import a_person


@pytest.fixture
def site() -> Iterator[Site]:
    """A page that is served, for this machine alone."""
    site = Site()
    try:
        yield site
    finally:
        site.close()


@pytest.fixture(scope="session")
def person(slideshow: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip that Chromium takes for a webcam: a person shows Stop and Forward in turn."""
    return a_person(slideshow, tmp_path_factory.mktemp("webcam") / "person.mjpeg")
