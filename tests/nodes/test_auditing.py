from collections import Counter

import pytest

from handsteer.audit import AuditEvent, read_event
from handsteer.clock import SteppedClock
from handsteer.config import ControlConfig
from handsteer.messages import AUDIT, STOP, Bool, Log
from handsteer.nodes.auditing import HOLD_S, Auditor
from handsteer.nodes.status import CameraStatus
from handsteer.transports.in_process import InProcessTransport
from tests.nodes.test_control import ControlBench


def events(messages: list[Log]) -> list[AuditEvent]:
    read = [read_event(message) for message in messages]
    assert None not in read
    return [event for event in read if event is not None]


def codes(messages: list[Log]) -> list[str]:
    return [message.function for message in messages]


class Listener:
    def __init__(self) -> None:
        self.messages: list[Log] = []
        transport, clock = InProcessTransport(), SteppedClock()
        transport.subscribe("listener", AUDIT, lambda received: self.messages.append(received.message))
        self.auditor = Auditor(transport, "camera", clock)

    def look(self, value: object, at_s: float) -> None:
        self.auditor.look("lamp", value, at_s, lambda: self.auditor.event("stands", f"lamp {value}"), first="off")


def test_transitions_are_told_and_nothing_else() -> None:
    listener = Listener()
    for tick in range(100):
        listener.look("on" if 20 <= tick < 60 else "off", tick * 0.1)
    assert [(each.msg, each.stamp.sec) for each in listener.messages] == [("lamp on", 2), ("lamp off", 6)]


def test_what_flaps_is_told_at_a_limited_rate_and_its_last_value_always() -> None:
    listener = Listener()
    for tick in range(1001):  # ten seconds, a hundred changes a second
        listener.look("on" if tick % 2 else "off", tick * 0.01)
    for tick in range(1001, 1100):
        listener.look("on", tick * 0.01)
    assert 10 / HOLD_S * 0.4 < len(listener.messages) <= 10 / HOLD_S + 1
    assert listener.messages[-1].msg == "lamp on"


def test_a_change_that_was_held_back_keeps_its_own_time() -> None:
    listener = Listener()
    listener.look("on", 1.0)
    listener.look("off", 1.1)
    listener.look("off", 1.6)
    stamps = [each.stamp.sec + each.stamp.nanosec / 1e9 for each in listener.messages]
    assert stamps == pytest.approx([1.0, 1.1])


def test_an_event_that_is_repeated_at_once_is_told_once() -> None:
    listener = Listener()
    pressed = AuditEvent("stop_pressed", "viewer 1", "pressed Stop")
    for at_s in (1.0, 1.1, 1.2, 2.0):
        listener.auditor.say(pressed, at_s)
    listener.auditor.say(AuditEvent("stop_pressed", "viewer 2", "pressed Stop"), 2.1)
    assert [each.name for each in listener.messages] == ["viewer 1", "viewer 1", "viewer 2"]


def test_a_fault_of_a_node_is_told_when_it_begins_and_ends() -> None:
    listener = Listener()
    for state, at_s in (("delivers", 0.0), ("frozen", 1.0), ("frozen", 2.0), ("delivers", 3.0)):
        listener.auditor.look_at_status(CameraStatus("webcam 0", state), at_s)  # type: ignore[arg-type]
    assert [(each.function, each.level) for each in listener.messages] == [("fault", 40), ("fault_ended", 20)]
    assert listener.messages[0].msg.startswith("webcam 0: frozen")


def test_a_camera_that_is_only_starting_has_no_fault_but_one_that_never_comes_has() -> None:
    listener = Listener()
    for at_s in (0.0, 1.0, 2.0):
        listener.auditor.look_at_status(CameraStatus("webcam 0", "lost", problem="gone"), at_s)
    assert listener.messages == []
    listener.auditor.look_at_status(CameraStatus("webcam 0", "lost", problem="gone"), 3.5)
    assert codes(listener.messages) == ["fault"]


def test_the_control_tells_why_the_robot_drives_and_stands() -> None:
    bench = ControlBench()
    audit = bench.record(AUDIT)
    bench.show(*["Stop"] * 20, *["Forward"] * 30)
    bench.run(2.0)
    motions = [(event.code, event.about) for event in events(audit) if event.code in ("drives", "stands")]
    assert motions[0][0] == "stands"
    assert ("drives", "sign") in motions
    assert motions[-1] == ("stands", "no_input")
    assert len(audit) < 12


@pytest.mark.parametrize("shown", ["Forward", "NONE"])
def test_the_control_tells_that_it_ends_while_the_robot_drives(shown: str) -> None:
    bench = ControlBench()
    audit = bench.record(AUDIT)
    bench.show(*[shown] * 30)
    bench.control.stop()
    is_told = [event.about for event in events(audit) if event.code == "stands"][-1] == "ended"
    assert is_told == (shown == "Forward")


def test_the_control_tells_who_stops_and_resets_it() -> None:
    bench = ControlBench()
    audit = bench.record(AUDIT)
    stop = bench.transport.advertise("red_button", STOP)
    for value in (True, False):
        stop.publish(Bool(data=value))
        bench.run(1.0)
    told = [event for event in events(audit) if event.code in ("stopped", "reset")]
    assert [event.code for event in told] == ["stopped", "reset"]
    assert all("red_button" in event.sentence for event in told)
    assert {event.who for event in told} == {"hand_sign_control"}


def test_the_control_tells_arming_engaging_and_the_source() -> None:
    bench = ControlBench(ControlConfig(engage="on", engage_by="hold"), arming=True, engage=True)
    audit = bench.record(AUDIT)
    bench.show(*["NONE"] * 30, *["Stop"] * 60, *["Forward"] * 30)
    told = Counter(codes(audit))
    assert {"disarmed", "disengaged"} <= told.keys()
    assert max(told.values()) < 6


def test_a_stall_is_a_fault() -> None:
    bench = ControlBench()
    audit = bench.record(AUDIT)
    bench.show("Forward", "Forward")
    bench.clock.advance_to(bench.clock.now() + 5.0)
    bench.run(0.2)
    (fault,) = [event for event in events(audit) if event.code == "fault"]
    assert fault.about == "stalled"
