from collections.abc import Callable
from typing import Any

import pytest

from handsteer.clock import RealClock
from handsteer.messages import CMD_VEL, HAND_SIGN, STOP, Bool, Topic
from handsteer.plugins.ros2.base_transport import Other, Profile, Ros2Transport, Take, WireTransport, Writer
from handsteer.plugins.ros2.names import NodeName
from handsteer.transports.base import Received
from handsteer.transports.encoding import encode
from tests.processes import eventually


class Wire(Ros2Transport):
    """A middleware whose readers are here."""

    def __init__(self) -> None:
        super().__init__("/me", RealClock())
        self.readers: dict[tuple[str, bool], Take] = {}
        self.of_kept: list[Take] = []
        self.has_keepers = False

    def _open_writer(self, name: str, topic: Topic[Any]) -> Writer | None:
        return None

    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: Take) -> Callable[[], None]:
        if profile.latched:
            assert profile.reliable
            self.of_kept.append(take)
            return self.of_kept.clear
        key = (name, profile.reliable)
        self.readers[key] = take

        def close() -> None:
            del self.readers[key]

        return close

    def _subscribed_types(self, topic: Topic[Any]) -> set[str]:
        return set()

    def _has_keepers(self, topic: Topic[Any]) -> bool:
        return self.has_keepers


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


def reader_of_kept(wire: Wire, heard: list[bool]) -> Take:
    """Return what takes the messages that others have kept on ``/stop``; ``heard`` gets what is passed on."""
    wire.subscribe("control", STOP, lambda received: heard.append(received.message.data))
    wire.has_keepers = True
    wire.check()
    [take] = wire.of_kept
    return take


def test_what_is_kept_is_read_only_from_publishers_that_keep_it() -> None:
    wire = Wire()
    subscription = wire.subscribe("control", STOP, lambda _: None)
    wire.check()
    assert not wire.of_kept
    wire.has_keepers = True

    def reads() -> bool:
        wire.check()
        return bool(wire.of_kept)

    eventually(reads)
    wire.check()
    assert len(wire.of_kept) == 1
    subscription.close()
    assert not wire.of_kept


@pytest.mark.parametrize("sent_s", [5.0, None])
def test_a_stop_that_was_kept_stops_and_a_kept_reset_resets_nothing(sent_s: float | None) -> None:
    """The guard: ``_KeptStops``."""
    wire, heard = Wire(), list[bool]()
    take = reader_of_kept(wire, heard)
    take(encode(Bool(data=False)), b"one", sent_s)
    assert heard == []
    take(encode(Bool(data=True)), b"one", sent_s)
    assert heard == [True]
    for sender, later_s in ((b"other", 6.0), (b"one", 4.0), (b"one", None)):
        take(encode(Bool(data=False)), sender, later_s)
    take(b"\0\1", b"one", 7.0)
    assert heard == [True]


def test_a_sender_that_has_kept_both_has_reset_its_own_stop() -> None:
    wire, heard = Wire(), list[bool]()
    take = reader_of_kept(wire, heard)
    for is_set, sent_s in ((True, 5.0), (False, 6.0)):
        take(encode(Bool(data=is_set)), b"one", sent_s)
        wire.readers["/stop", True](encode(Bool(data=is_set)), b"one", sent_s)
    assert heard == [True, False]


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
