import sys
import threading
from collections.abc import Iterator

import pytest

from handsteer.messages import String
from handsteer.testing.transport_contract import TransportContract
from handsteer.transports.base import Received, Transport
from handsteer.transports.in_process import Fanout, InProcessTransport


class TestInProcess(TransportContract):
    @pytest.fixture
    def transport(self) -> Iterator[Transport]:
        transport = InProcessTransport()
        yield transport
        transport.close()


def test_a_subscriber_that_comes_while_the_last_one_leaves_is_kept() -> None:
    fanout: Fanout[String] = Fanout(latched=False, receive=lambda _send: lambda: None)
    is_over = threading.Event()

    def come_and_go() -> None:
        while not is_over.is_set():
            fanout.add(lambda _: None).close()

    others = [threading.Thread(target=come_and_go) for _ in range(2)]
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for other in others:
            other.start()
        for number in range(10_000):
            got: list[Received[String]] = []
            subscription = fanout.add(got.append)
            fanout.send(Received(String(data="Go")))
            subscription.close()
            assert got, number
    finally:
        is_over.set()
        sys.setswitchinterval(before_s)
