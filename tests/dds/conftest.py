"""DDS domains with a plain DDS program in them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.dds.graph import DdsGraph


@pytest.fixture(scope="module")
def dds_domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DdsGraph]:
    """A domain for the tests of a module."""
    with DdsGraph(tmp_path_factory.mktemp("dds")) as graph:
        yield graph


@pytest.fixture
def dds(dds_domain: DdsGraph) -> Iterator[DdsGraph]:
    """The module's domain for one test."""
    with dds_domain.test():
        yield dds_domain


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[DdsGraph]:
    """A domain of the test's own."""
    with DdsGraph(tmp_path) as graph:
        yield graph
