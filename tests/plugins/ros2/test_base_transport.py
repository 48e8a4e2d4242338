from collections.abc import Callable
from typing import Any

from handsteer.clock import RealClock
from handsteer.messages import CMD_VEL, HAND_SIGN, STOP, Bool, Topic
from handsteer.plugins.ros2.base_transport import Other, Profile, Ros2Transport, Take, WireTransport, Writer
from handsteer.transports.base import Received
from handsteer.transports.encoding import NodeName, encode


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


class WireWithOthers(Wire, WireTransport):
    """A middleware in whose graph another node publishes."""

    def __init__(self, *others: Other) -> None:
        WireTransport.__init__(self, NodeName("me"), RealClock())
        self.others = list(others)

    def _others(self, name: str) -> list[Other]:
        return self.others

    def _open_service(self, name: str, kind: str, respond: Callable[[bytes], bytes]) -> Callable[[], None]:
        raise NotImplementedError


def test_publishers_of_another_type_are_not_those_of_a_topic() -> None:
    others = [Other(f"/{kind}", f"geometry_msgs/msg/{kind}", True) for kind in ("Twist", "TwistStamped", "Pose")]
    wire = WireWithOthers(*others, Other("/robot", "geometry_msgs/msg/Twist", False))
    assert wire.publishers_of(CMD_VEL) == ["/Twist", "/TwistStamped"]
    assert wire.publishers_of(HAND_SIGN) == []
