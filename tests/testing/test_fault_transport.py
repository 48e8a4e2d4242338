from collections.abc import Iterator
from typing import Any

import pytest

from handsteer.clock import RealClock
from handsteer.messages import CMD_VEL, HAND_SIGN, String, Topic, twist
from handsteer.testing.fault_transport import CUT, FROZEN, FaultTransport, LinkFault
from handsteer.testing.transport_contract import TransportContract, eventually
from handsteer.transports.base import Received, Transport
from handsteer.transports.in_process import InProcessTransport
from tests.nodes.stepping import Bench

WORDS = Topic("/words", String, depth=10)


class TestHealthy(TransportContract):
    @pytest.fixture
    def transport(self) -> Iterator[Transport]:
        transport = FaultTransport(InProcessTransport(), RealClock())
        yield transport
        transport.close()


class Talk(Bench):
    """One who says numbers ten times a second, and one who listens."""

    def __init__(self, topic: Topic[String] = WORDS, **options: bool) -> None:
        super().__init__()
        self.faults = FaultTransport(self.transport, self.clock, seed=3, **options)
        self.nodes = [self.faults.wire]
        self.speaker = self.faults.advertise("speaker", topic)
        self.other = self.faults.advertise("other", topic)
        self.heard: list[tuple[float, int]] = []
        self.captured: list[float | None] = []
        self._number = 0
        self.faults.subscribe("listener", topic, self._on_word)

    def _on_word(self, received: Received[Any]) -> None:
        self.heard.append((round(self.clock.now(), 3), int(received.message.data)))
        self.captured.append(received.captured_s)

    def say(self, count: int) -> list[int]:
        """Say so many numbers; return those that were heard meanwhile."""
        before = len(self.heard)
        for _ in range(count):
            self.speaker.publish(String(data=str(self._number)), self.clock.now())
            self._number += 1
            self.run(0.1)
        return [number for _, number in self.heard[before:]]


def test_without_a_fault_all_comes_at_once() -> None:
    talk = Talk()
    assert talk.say(5) == [0, 1, 2, 3, 4]
    assert [at_s for at_s, _ in talk.heard] == [0.0, 0.1, 0.2, 0.3, 0.4]


def test_a_cut_link_brings_nothing_then_or_later() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, CUT)
    assert talk.say(5) == []
    talk.faults.heal(WORDS)
    assert talk.say(2) == [5, 6]


def test_a_share_is_lost_the_same_each_time() -> None:
    lost = []
    for _ in range(2):
        talk = Talk()
        talk.faults.spoil("/words", LinkFault(drop=0.5))
        lost.append(talk.say(100))
    assert lost[0] == lost[1]
    assert 30 < len(lost[0]) < 70


def test_a_delay_is_kept_also_after_the_fault() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, LinkFault(delay_s=0.25))
    assert talk.say(4) == [0, 1]
    talk.faults.heal(WORDS)
    assert talk.say(4) == [4, 2, 5, 3, 6, 7]
    assert talk.heard[:2] == [(0.25, 0), (0.35, 1)]


def test_jitter_delays_each_by_another_time_and_keeps_the_order() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, LinkFault(jitter_s=0.5))
    talk.say(100)
    talk.run(1.0)
    assert [number for _, number in talk.heard] == list(range(100))
    late_s = [round(at_s - number * 0.1, 3) for at_s, number in talk.heard]
    assert 0.0 <= min(late_s) < max(late_s) <= 0.5
    assert len(set(late_s)) > 50


def test_messages_come_twice() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, LinkFault(duplicate=1.0))
    assert talk.say(3) == [0, 0, 1, 1, 2, 2]


def test_messages_come_after_the_next_one() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, LinkFault(reorder=0.5))
    numbers = talk.say(100)
    assert numbers != sorted(numbers)
    talk.faults.heal(WORDS)
    talk.run(0.0)
    assert sorted(number for _, number in talk.heard) == list(range(100))


def test_what_was_frozen_comes_all_at_once_and_in_its_order() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, FROZEN)
    assert talk.say(5) == []
    talk.faults.heal(WORDS)
    talk.run(0.0)
    assert talk.heard == [(0.5, number) for number in range(5)]


def test_of_one_sender_alone() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, CUT, sender="other")
    talk.other.publish(String(data="77"))
    assert talk.say(2) == [0, 1]


def test_other_topics_are_as_before() -> None:
    talk = Talk()
    talk.faults.spoil(WORDS, CUT)
    twists = talk.record(CMD_VEL)
    talk.faults.advertise("control", CMD_VEL).publish(twist(0.1, 0.0))
    assert len(twists) == 1


@pytest.mark.parametrize(("guards", "heard"), [(True, [4]), (False, [0, 1, 2, 3, 4])])
def test_late_signs_and_commands_are_refused_as_over_dds_unless_that_is_switched_off(
    guards: bool, heard: list[int]
) -> None:
    talk = Talk(HAND_SIGN, guards=guards)
    talk.speaker.publish(String(data="99"))  # the quickest
    talk.heard.clear()
    talk.faults.spoil(HAND_SIGN, FROZEN)
    talk.say(4)
    talk.run(0.4)
    talk.say(1)
    talk.faults.heal(HAND_SIGN)
    talk.run(0.0)
    assert [number for _, number in talk.heard] == heard


@pytest.mark.parametrize("carries", [True, False])
def test_capture_times_come_along_unless_that_is_switched_off(carries: bool) -> None:
    talk = Talk(carries_capture_times=carries)
    talk.say(1)
    assert talk.captured == [0.0 if carries else None]


def test_in_real_time_the_wire_delivers_on_its_own_thread() -> None:
    clock = RealClock()
    transport = FaultTransport(InProcessTransport(), clock)
    heard: list[str] = []
    transport.subscribe("listener", WORDS, lambda received: heard.append(received.message.data))
    transport.spoil(WORDS, LinkFault(delay_s=0.05))
    transport.wire.start()
    transport.advertise("speaker", WORDS).publish(String(data="hello"))
    assert heard == []
    assert eventually(lambda: heard == ["hello"])
    transport.wire.stop()
    transport.close()
