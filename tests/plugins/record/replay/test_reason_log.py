from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import SteppedClock
from handsteer.config import Config, ControlConfig, VirtualHandConfig
from handsteer.control.explain import Reason
from handsteer.graph import Graph
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    GESTURE_JOY,
    HAND_SIGN,
    JOY,
    STEERING_CMD_VEL,
    STOP,
    STOPPED,
    Bool,
    Header,
    String,
    Time,
    Topic,
    joy_of,
    twist,
)
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.status import ControlStatus
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.recorder import Recorder
from handsteer.plugins.record.replay.drive_facts import DriveFacts
from handsteer.plugins.record.replay.drive_reader import read_drive
from handsteer.plugins.record.replay.reason_log import Span, common, less, union
from handsteer.transports.encoding import encode
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import RELEASED, Stick
from tests.reasons import check, check_made

Message = tuple[float, Topic[Any], Any]


def found(path: Path, *parts: Iterable[Message]) -> list[tuple[float, float, str]]:
    """Write messages at their times, in seconds; return the times without a reason, to tenths of a second."""
    writer = McapWriter(path / "drive.mcap")
    for time_s, topic, message in sorted((each for part in parts for each in part), key=lambda each: each[0]):
        writer.write(topic, topic.name, encode(message), int((1_700_000_000 + time_s) * 1e9))
    writer.close()
    unexplained = read_drive(McapFile(path / "drive.mcap")).unexplained
    return [(round(each.begin_s, 1), round(each.end_s, 1), each.why) for each in unexplained]


def moves(begin_s: float, end_s: float, speed_mps: float = 0.3) -> list[Message]:
    """Return commands to drive, ten a second, and to stand before and after."""
    times = [n / 10 for n in range(60)]
    return [(at_s, CMD_VEL, twist(speed_mps * (begin_s <= at_s < end_s), 0.0)) for at_s in times]


def every(topic: Topic[Any], message: Any, begin_s: float, end_s: float) -> list[Message]:
    """Return a message that comes ten times a second."""
    return [(n / 10, topic, message) for n in range(60) if begin_s <= n / 10 < end_s]


def said(reason: Reason, source: Any, begin_s: float, end_s: float, mode: Any = "signs") -> list[Message]:
    """Return what the control says of itself."""
    status = ControlStatus(reason, source, rule=ControlConfig(mode=mode))
    return every(DIAGNOSTICS, write_status(status, "hand_sign_control", Time(0, 0)), begin_s, end_s)


def signs(sign: str, begin_s: float, end_s: float) -> list[Message]:
    return every(HAND_SIGN, String(data=sign), begin_s, end_s)


def sticks(topic: Topic[Any], begin_s: float, end_s: float, stick: Stick) -> list[Message]:
    return every(topic, joy_of(stick, Header(Time(0, 0), "")), begin_s, end_s)


def test_a_sign_that_is_shown_is_a_reason(tmp_path: Path) -> None:
    assert found(tmp_path, moves(1.0, 3.0), signs("Forward", 1.0, 3.0), signs("NONE", 3.0, 6.0)) == []


@pytest.mark.parametrize("sign", ["NONE", "Stop", None])
def test_motion_after_the_last_sign_is_found(tmp_path: Path, sign: str | None) -> None:
    ends_s = 2.3 if sign is None else 2.0  # without any sign, the last one counts until its timeout
    after = [] if sign is None else signs(sign, 2.0, 6.0)
    ((begin_s, end_s, why),) = found(tmp_path, moves(1.0, 4.0), signs("Forward", 1.0, 2.0), after)
    assert begin_s == pytest.approx(ends_s + 0.1, abs=0.11)
    assert (end_s, why) == (4.0, "no sign, no steering and no joystick was live")


def test_motion_without_any_input_is_found_and_ends_where_a_robot_brakes_by_itself(tmp_path: Path) -> None:
    ((begin_s, end_s, _),) = found(tmp_path, [(1.0, CMD_VEL, twist(0.0, 0.5))], every(STOP, Bool(data=False), 0.0, 6.0))
    assert (begin_s, end_s) == (1.0, 1.4)


def test_each_of_several_robots_is_looked_at(tmp_path: Path) -> None:
    second = Topic("/r2/robot_diff_drive_controller/cmd_vel", CMD_VEL.type)
    drives = [(at_s, second, message) for at_s, _, message in moves(4.0, 5.0)]
    ((begin_s, end_s, _),) = found(tmp_path, moves(1.0, 3.0), signs("Forward", 1.0, 3.0), drives)
    assert (begin_s, end_s) == (4.0, 5.0)


@pytest.mark.parametrize(
    ("topic", "on", "off"),
    [
        (STEERING_CMD_VEL, twist(0.3, 0.0), twist(0.0, 0.0)),
        (GESTURE_JOY, joy_of(Stick(held=True), Header(Time(0, 0), "")), joy_of(RELEASED, Header(Time(0, 0), ""))),
        (JOY, joy_of(Stick(held=True), Header(Time(0, 0), "")), joy_of(RELEASED, Header(Time(0, 0), ""))),
    ],
    ids=["steering", "joystick", "gamepad"],
)
def test_what_is_held_is_a_reason_until_it_is_released(tmp_path: Path, topic: Topic[Any], on: Any, off: Any) -> None:
    held = every(topic, on, 1.0, 3.0)
    ((begin_s, end_s, _),) = found(tmp_path, moves(1.0, 5.0), held, every(topic, off, 3.0, 6.0))
    assert (begin_s, end_s) == (3.1, 5.0)


@pytest.mark.parametrize(("mode", "explained"), [("signs", True), ("joystick", False)])
def test_signs_are_no_reason_in_the_mode_of_the_joystick(tmp_path: Path, mode: str, explained: bool) -> None:
    control = said(Reason("sign", "Forward"), "signs", 0.0, 6.0, mode)
    assert (found(tmp_path, moves(1.0, 3.0), signs("Forward", 0.5, 3.0), control) == []) is explained


@pytest.mark.parametrize("topic", [STOP, STOPPED])
def test_motion_while_it_is_stopped_is_found_whatever_is_shown(tmp_path: Path, topic: Topic[Bool]) -> None:
    stopped: list[Message] = [(2.0, topic, Bool(data=True)), (4.0, STOP, Bool(data=False))]
    ((begin_s, end_s, why),) = found(tmp_path, moves(1.0, 5.0), signs("Forward", 1.0, 5.0), stopped)
    assert (begin_s, end_s, why) == (2.1, 4.0, "it was stopped, until it is reset")


def test_motion_for_which_the_control_names_no_reason_is_found_though_a_sign_is_shown(tmp_path: Path) -> None:
    driving = said(Reason("sign", "Forward"), "signs", 0.0, 3.0)
    waits = said(Reason("disarmed", "no sign came"), "signs", 3.0, 6.0)
    ((begin_s, end_s, why),) = found(tmp_path, moves(1.0, 5.0), signs("Forward", 1.0, 5.0), driving, waits)
    assert begin_s == pytest.approx(3.1, abs=0.1)
    assert (end_s, why) == (5.0, "the control named no reason of its own")


def test_an_input_that_the_control_does_not_follow_is_no_reason(tmp_path: Path) -> None:
    control = said(Reason("steered"), "steering", 0.0, 6.0)
    ((begin_s, end_s, _),) = found(tmp_path, moves(1.0, 5.0), signs("Forward", 1.0, 5.0), control)
    assert (begin_s, end_s) == (1.0, 5.0)


def test_a_motion_between_two_statuses_needs_none(tmp_path: Path) -> None:
    control = said(Reason("stop_sign", "Stop"), "signs", 0.0, 6.0)
    assert found(tmp_path, moves(1.0, 1.1), signs("Forward", 1.0, 1.1), signs("Stop", 1.1, 6.0), control) == []


def edited(recording: Path, path: Path, leave_out: Callable[[str, float], bool]) -> DriveFacts:
    """Copy a recording without some messages, by topic and time since its beginning; return what it says."""
    writer, file = McapWriter(path), McapFile(recording)
    topics: dict[str, Topic[Any]] = {topic.name: topic for topic in (CMD_VEL, HAND_SIGN, DIAGNOSTICS, STOP)}
    for recorded in file.messages(set(topics)):
        if not leave_out(recorded.topic, recorded.time_s - file.began_s):
            writer.write(topics[recorded.topic], recorded.topic, recorded.raw, recorded.time_ns, recorded.number)
    writer.describe("handsteer", file.about)
    writer.close()
    return read_drive(McapFile(path))


def test_a_recording_from_which_the_signs_were_taken_has_no_reason_any_more(recording: Path, tmp_path: Path) -> None:
    assert edited(recording, tmp_path / "whole.mcap", lambda *_: False).unexplained == []
    facts = edited(recording, tmp_path / "edited.mcap", lambda topic, at_s: topic == HAND_SIGN.name and 3 < at_s < 4.5)
    (found,) = facts.unexplained
    assert found.begin_s == pytest.approx(3.45, abs=0.1)
    assert found.end_s == pytest.approx(4.4, abs=0.1)
    assert facts.totals()["motion_without_reason"] == [
        {"begin_s": round(found.begin_s, 3), "end_s": round(found.end_s, 3), "why": found.why}
    ]


def test_a_forged_command_in_a_recording_fails_the_check_of_every_test(recording: Path, tmp_path: Path) -> None:
    path, file = tmp_path / "forged.mcap", McapFile(recording)
    check(recording)
    writer = McapWriter(path)
    for recorded in file.messages({HAND_SIGN.name, CMD_VEL.name}):
        topic = HAND_SIGN if recorded.topic == HAND_SIGN.name else CMD_VEL
        writer.write(topic, topic.name, recorded.raw, recorded.time_ns, recorded.number)
    writer.write(CMD_VEL, CMD_VEL.name, encode(twist(0.2, 0.0)), int((file.began_s + 9.0) * 1e9))
    writer.write(HAND_SIGN, HAND_SIGN.name, encode(String(data="NONE")), int((file.began_s + 9.5) * 1e9))
    writer.close()
    with pytest.raises(AssertionError, match="motion without a live reason"):
        check(path)


def test_every_recording_that_a_test_makes_is_looked_through(tmp_path: Path) -> None:
    transport, clock = InProcessTransport(), SteppedClock()
    recorder = Recorder(tmp_path / "drive.mcap", transport, clock, (CMD_VEL,), {})
    commands = transport.advertise("hand_sign_control", CMD_VEL)
    commands.publish(twist(0.3, 0.0))
    clock.advance(1.0)
    commands.publish(twist(0.0, 0.0))
    recorder.close()
    with pytest.raises(AssertionError, match="motion without a live reason"):
        check_made()
    check_made()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["signs", "joystick"])
def test_a_drive_that_is_steered_stopped_and_reset_has_a_reason_for_each_motion(tmp_path: Path, mode: str) -> None:
    hand = VirtualHandConfig(script="Stop:1 Go:2" if mode == "joystick" else "Stop:1 Forward:2")
    config = Config.model_validate({"virtual_hand": hand.model_dump(), "control": {"mode": mode}})
    with Graph(config, SteppedClock()) as graph:
        graph.record(tmp_path / "drive.mcap")
        graph.run_stepped(2.5)
        for speed_mps in (0.0, 0.5):
            graph.steering.steer(speed_mps, 0.0)
            graph.run_stepped(1.0)
        graph.steering.halt()
        graph.run_stepped(1.0)
        graph.steering.reset()
        graph.run_stepped(4.0)
    facts = read_drive(McapFile(tmp_path / "drive.mcap"))
    assert facts.unexplained == []
    assert facts.sources["steering"] > 0.5
    assert facts.driving_s is not None
    assert facts.driving_s > 1.0


SPANS = st.lists(st.tuples(st.integers(0, 40), st.integers(1, 8)), max_size=8).map(
    lambda pairs: union((float(begin), float(begin + length)) for begin, length in pairs)
)


@given(SPANS, SPANS)
def test_spans_are_sets_of_moments(these: list[Span], others: list[Span]) -> None:
    def holds(spans: list[Span], at_s: float) -> bool:
        return any(begin <= at_s < end for begin, end in spans)

    for moment in range(100):
        at_s = moment / 2 + 0.25
        one, other = holds(these, at_s), holds(others, at_s)
        assert holds(less(these, others), at_s) == (one and not other)
        assert holds(common(these, others), at_s) == (one and other)
        assert holds(union([*these, *others]), at_s) == (one or other)
