from collections.abc import Iterator

import pytest

from handsteer.transports.base import Transport
from handsteer.transports.in_process import InProcessTransport
from tests.contracts.transport_contract import TransportContract


class TestInProcess(TransportContract):
    @pytest.fixture
    def transport(self) -> Iterator[Transport]:
        transport = InProcessTransport()
        yield transport
        transport.close()
