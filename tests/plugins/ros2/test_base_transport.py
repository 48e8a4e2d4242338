from collections.abc import Callable
from typing import Any

from handsteer.clock import RealClock
from handsteer.messages import HAND_SIGN, STOP, Bool, Topic
from handsteer.plugins.ros2.base_transport import Profile, Ros2Transport, Take, Writer
from handsteer.transports.base import Received
from handsteer.transports.encoding import encode


class Wire(Ros2Transport):
    """A middleware whose readers are here."""

    def __init__(self) -> None:
        super().__init__("/me", RealClock())
        self.readers: dict[tuple[str, bool], Take] = {}

    def _open_writer(self, name: str, topic: Topic[Any]) -> Writer | None:
        return None

    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: Take) -> Callable[[], None]:
        key = (name, profile.reliable)
        self.readers[key] = take

        def close() -> None:
            del self.readers[key]

        return close

    def _subscribed_types(self, topic: Topic[Any]) -> set[str]:
        return set()


def test_a_stop_is_received_from_publishers_of_every_reliability() -> None:
    wire = Wire()
    heard: list[Received[Bool]] = []
    subscription = wire.subscribe("control", STOP, heard.append)
    wire.subscribe("control", HAND_SIGN, lambda _: None)
    assert set(wire.readers) == {("/stop", True), ("/stop", False), ("/gesture/hand_sign", True)}
    for is_reliable in (True, False):
        wire.readers["/stop", is_reliable](encode(Bool(data=True)), b"", 1.0)
    assert [each.message.data for each in heard] == [True]
    wire.readers["/stop", False](encode(Bool(data=False)), b"", 2.0)
    assert [each.message.data for each in heard] == [True, False]
    subscription.close()
    assert set(wire.readers) == {("/gesture/hand_sign", True)}
