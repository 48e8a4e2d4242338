"""Two machines for the tests of this room, or the reason why there are none."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.distributed.graph import TwoMachines
from tests.distributed.network import NoNamespacesError, two_machines

Make = Callable[..., TwoMachines]


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[TwoMachines]:
    """The robot's machine and the workstation, with nothing on them yet, and a good link."""
    try:
        with two_machines(tmp_path) as (robot, workstation, link):
            both = TwoMachines(tmp_path, robot, workstation, link)
            try:
                yield both
            finally:
                both.stop()
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")
