"""What tests of the page share."""

from collections.abc import Iterator

import pytest

from tests.plugins.page.served import Site


@pytest.fixture
def site() -> Iterator[Site]:
    """A page that is served, for this machine alone."""
    site = Site()
    try:
        yield site
    finally:
        site.close()
