import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handsteer.audit import AuditEvent, write_event
from handsteer.clock import SteppedClock
from handsteer.config import Config, RobotConfig, VirtualHandConfig
from handsteer.errors import RecordingError
from handsteer.graph import Graph
from handsteer.messages import (
    AUDIT,
    CMD_VEL,
    DIAGNOSTICS,
    HAND_SIGN,
    IMAGE_COMPRESSED,
    ODOM,
    STOP,
    WORLD_MARKERS,
    Bool,
    Header,
    MarkerArray,
    String,
    Time,
    Topic,
    twist,
)
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.journal import journal_topic
from handsteer.nodes.status import RobotStatus
from handsteer.plugins.page.editing import rename
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.recorded import Recorded
from handsteer.plugins.record.replay import report_words as words
from handsteer.plugins.record.replay.drive_facts import DriveFacts
from handsteer.plugins.record.replay.drive_reader import read_drive
from handsteer.plugins.record.replay.stand_log import MOST_PICTURES
from handsteer.robots.world import load_world
from handsteer.transports.encoding import encode
from handsteer.types import CourseState

Message = tuple[float, Topic[Any], Any]


def facts_of(path: Path) -> DriveFacts:
    return read_drive(McapFile(path))


def written(path: Path, messages: Iterable[Message]) -> Path:
    """Write messages at their times, in seconds."""
    writer = McapWriter(path)
    for time_s, topic, message in messages:
        raw = message if isinstance(message, bytes) else encode(message)
        writer.write(topic, topic.name, raw, int((1_700_000_000 + time_s) * 1e9))
    writer.close()
    return path


def kept(recording: Path, path: Path, keep: Iterable[Topic[Any]]) -> Path:
    """Copy some topics of a recording."""
    writer = McapWriter(path)
    topics = {topic.name: topic for topic in keep}
    for recorded in McapFile(recording).messages(set(topics)):
        writer.write(topics[recorded.topic], recorded.topic, recorded.raw, recorded.time_ns, recorded.number)
    writer.close()
    return path


def drives(*, times: int, stop_s: float = 1.0) -> list[Message]:
    """Return commands that drive and stand in turn, two seconds each time."""
    steps = [(2.0 * n + part / 10, 0.3 if part / 10 < stop_s else 0.0) for n in range(times) for part in range(20)]
    return [(time_s, CMD_VEL, twist(velocity, 0.0)) for time_s, velocity in steps]


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a drive over a course, stopped by a Stop."""
    path = tmp_path_factory.mktemp("course") / "course.mcap"
    hand = VirtualHandConfig(script="Stop:1 Forward:3 Go:20")
    with Graph(Config(virtual_hand=hand, robot=RobotConfig(world="stop-line")), SteppedClock()) as graph:
        graph.record(path)
        graph.run_stepped(10.0)
        graph.steering.halt()
        graph.run_stepped(2.0)
    return path


def test_totals_of_a_drive(recording: Path) -> None:
    facts = facts_of(recording)
    totals = facts.totals()
    assert totals["duration_s"] == pytest.approx(8.0, abs=0.1)
    assert (totals["frames"], totals["commands"]) == (241, 242)
    assert (totals["camera"], totals["robot"], totals["world"]) == ("virtual hand", "sim", "obstacles")
    assert facts.size == (640, 480)
    assert totals["signs"]["Forward"] == {"times": 1, "frames": 60, "seconds": pytest.approx(2.0, abs=0.1)}
    assert sum(sign["seconds"] for sign in totals["signs"].values()) == pytest.approx(8.0, abs=0.1)
    assert totals["distance_m"] == pytest.approx(2.6, abs=0.2)
    assert totals["driving_s"] + totals["standing_s"] == totals["duration_s"]
    assert totals["driven_by_s"].keys() == {"signs"}
    assert (totals["bumps"], totals["stops"], totals["problems"]) == (0, 0, [])


def test_each_stop_has_its_reason_and_the_frame_that_led_to_it(recording: Path) -> None:
    first, second, last = facts_of(recording).stands
    assert [stand.sign for stand in (first, second)] == ["Stop", "Stop"]
    assert second.reason == "the Stop sign is shown"
    assert second.time_s == pytest.approx(6.2, abs=0.1)
    assert second.duration_s == pytest.approx(1.1, abs=0.2)
    assert second.has_led
    assert last.code == "ended"
    assert second.picture is not None
    picture = cv2.imdecode(np.frombuffer(second.picture, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (240, 320, 3)


def test_the_frame_is_the_one_whose_sign_stopped_it(recording: Path) -> None:
    second = facts_of(recording).stands[1]
    frames = [frame.message for frame in McapFile(recording).messages({IMAGE_COMPRESSED.name})]
    led = min(frames, key=lambda frame: abs(frame.header.stamp.sec + frame.header.stamp.nanosec / 1e9 - second.time_s))
    whole = cv2.imdecode(led.data, cv2.IMREAD_COLOR)
    assert second.picture is not None
    small = cv2.imdecode(np.frombuffer(second.picture, np.uint8), cv2.IMREAD_COLOR)
    assert whole is not None
    assert small is not None
    difference = cv2.absdiff(cv2.resize(whole, (320, 240), interpolation=cv2.INTER_AREA), small)
    assert float(np.mean(difference)) < 2.0


def test_stepped_time_has_no_latency(recording: Path) -> None:
    facts = facts_of(recording)
    assert facts.latency_ms(50) is None
    assert "stepped time" in facts.no_latency


def with_journal(path: Path, frame: Any, offset: str) -> Path:
    """Write a drive of three frames, whose commands follow 10, 20 and 30 ms after them, with this offset."""
    writer = McapWriter(path)
    writer.describe("handsteer", {"clock_offset_s": offset})

    def write(time_s: float, topic: Topic[Any], message: Any, number: int = 0) -> None:
        writer.write(topic, topic.name, encode(message), int((1_000_000 + time_s) * 1e9), number)

    for n, (sign, velocity) in enumerate([("Forward", 0.1), ("Forward", 0.2), ("Stop", 0.0)], 1):
        captured_s = n / 10
        stamp = Time(sec=1_000_000, nanosec=n * 100_000_000)
        write(captured_s + 0.001, IMAGE_COMPRESSED, replace(frame, header=Header(stamp=stamp, frame_id="")), n)
        write(captured_s + n / 100, CMD_VEL, twist(velocity, 0.0), n)
        entry = {"t": [captured_s], "got": [[HAND_SIGN.name, n, captured_s, False, False]], "gave": {CMD_VEL.name: 1}}
        write(captured_s + n / 100, journal_topic("hand_sign_control"), String(data=json.dumps(entry)))
        # The control publishes before the recorder gets the sign.
        write(captured_s + n / 100, HAND_SIGN, String(data=sign), n)
    writer.close()
    return path


def test_latencies_are_from_the_capture_of_a_frame_to_its_command(recording: Path, tmp_path: Path) -> None:
    frame = next(McapFile(recording).messages({IMAGE_COMPRESSED.name})).message
    facts = facts_of(with_journal(tmp_path / "drive.mcap", frame, "1000000.0"))
    assert facts.latencies_ms.table()[:, 1] == pytest.approx([10.0, 20.0, 30.0], abs=0.01)
    (stand,) = facts.stands
    assert (stand.sign, stand.reason, stand.has_led) == ("Stop", "the Stop sign is shown", True)


@pytest.mark.parametrize("offset", ["nan", "inf", "-1e300", "abc"])
def test_without_an_offset_of_the_clock_that_is_a_time_latencies_are_unknown(
    offset: str, recording: Path, tmp_path: Path
) -> None:
    frame = next(McapFile(recording).messages({IMAGE_COMPRESSED.name})).message
    facts = facts_of(with_journal(tmp_path / "drive.mcap", frame, offset))
    assert (facts.latency_ms(50), len(facts.stands)) == (None, 1)
    assert facts.no_latency == "its metadata has no valid clock_offset_s"
    assert f"{facts.no_latency}: latencies are unknown" in facts.problems


@pytest.mark.slow
def test_a_course_gives_gates_a_lap_and_a_map(course: Path) -> None:
    facts = facts_of(course)
    (lap,) = facts.laps
    assert lap.course.gates == 2
    assert lap.course.passed == 2
    assert lap.course.phase == "finished"
    assert facts.totals()["gates"] == 2
    assert facts.totals()["laps"][0]["score_s"] == pytest.approx(lap.course.time_s)
    kinds = [thing.kind for thing in facts.things]
    assert kinds.count("gate") == 2
    assert {"box", "disc"} <= set(kinds)
    path = facts.truth.table()
    assert path[-1, 1] > 4.5
    assert np.abs(path[:, 2]).max() < 0.2


@pytest.mark.slow
def test_a_stop_by_the_page_is_counted_and_is_a_reason(course: Path) -> None:
    facts = facts_of(course)
    assert facts.stops == 1
    stand = facts.stands[-1]
    assert stand.code == "stopped"
    assert "until it is reset" in stand.reason
    assert not stand.has_led
    assert stand.picture is not None


def test_a_recording_without_robot_pictures_and_journals_says_what_is_missing(recording: Path, tmp_path: Path) -> None:
    facts = facts_of(kept(recording, tmp_path / "signs.mcap", [HAND_SIGN, CMD_VEL]))
    assert facts.signs["Forward"].frames == 60
    assert len(facts.stands) == 3
    assert {stand.picture for stand in facts.stands} == {None}
    assert facts.driving_s == pytest.approx(6.0, abs=1.0)
    assert facts.distance_m is None
    problems = "; ".join(facts.problems)
    assert all(what in problems for what in ("no pictures", "no odometry", "no journal"))


def test_without_journals_a_stop_has_the_newest_frame(recording: Path, tmp_path: Path) -> None:
    facts = facts_of(kept(recording, tmp_path / "graph.mcap", [HAND_SIGN, CMD_VEL, IMAGE_COMPRESSED, DIAGNOSTICS]))
    stand = facts.stands[1]
    assert stand.picture is not None
    assert not stand.has_led
    assert stand.reason == "the Stop sign is shown"


def test_a_recording_that_was_cut_off_is_read_up_to_there(recording: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[: recording.stat().st_size * 2 // 3])
    facts = facts_of(cut)
    assert 100 < facts.frames < 241
    assert any("cut off" in problem for problem in facts.problems)


def test_nothing_to_report_is_an_error(recording: Path, tmp_path: Path) -> None:
    McapWriter(tmp_path / "empty.mcap").close()
    with pytest.raises(RecordingError, match=r"empty\.mcap contains no messages: there is nothing to report"):
        facts_of(tmp_path / "empty.mcap")
    written(tmp_path / "other.mcap", [(0.0, Topic("/chatter", String), String(data="hello"))])
    with pytest.raises(RecordingError, match="1 messages, but none of a camera"):
        facts_of(tmp_path / "other.mcap")


def test_damaged_messages_are_left_out_and_counted(tmp_path: Path) -> None:
    good = drives(times=2)
    bad: list[Message] = [
        (0.5, HAND_SIGN, b"\0\1\0\0\xff\xff\xff\xff"),
        (0.6, ODOM, b""),
        (0.7, CMD_VEL, twist(float("nan"), 0.0)),
        (0.8, DIAGNOSTICS, b"\0\1\0\0" + b"\xff" * 40),
        (1e7, CMD_VEL, twist(1.0, 0.0)),
    ]
    facts = facts_of(written(tmp_path / "drive.mcap", [*good, *bad]))
    assert facts.commands == len(good)
    assert facts.duration_s < 5.0
    assert "5 messages are damaged, and were left out" in facts.problems


@pytest.mark.parametrize("time_s", [0.5, 1.5], ids=["read at the end", "read in between"])
def test_damaged_markers_are_left_out_and_counted(time_s: float, tmp_path: Path) -> None:
    good = [*drives(times=2), (0.0, WORLD_MARKERS, MarkerArray(markers=[]))]
    bad = (time_s, WORLD_MARKERS, b"\0\1\0\0\xff")
    facts = facts_of(written(tmp_path / "drive.mcap", sorted([*good, bad], key=lambda message: message[0])))
    assert facts.commands == 40
    assert "1 messages are damaged, and were left out" in facts.problems


def test_lost_messages_are_counted(recording: Path, tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "drive.mcap")
    writer.describe("handsteer", McapFile(recording).about)
    for recorded in McapFile(recording).messages({HAND_SIGN.name}):
        if recorded.number not in (10, 11, 200):
            writer.write(HAND_SIGN, HAND_SIGN.name, recorded.raw, recorded.time_ns, recorded.number)
    writer.close()
    assert any(problem.startswith("3 messages are missing") for problem in facts_of(tmp_path / "drive.mcap").problems)


def test_commands_that_cease_are_a_stop(tmp_path: Path) -> None:
    commands = [(n / 10, CMD_VEL, twist(0.3, 0.0)) for n in range(10)]
    signs = [(n / 10, HAND_SIGN, String(data="Go")) for n in range(30)]
    facts = facts_of(written(tmp_path / "drive.mcap", sorted([*commands, *signs], key=lambda message: message[0])))
    (stand,) = facts.stands
    assert stand.reason == "no command came for 0.5 s"
    assert stand.time_s == pytest.approx(1.4)


def test_reversing_through_zero_is_no_stop(tmp_path: Path) -> None:
    velocities = [0.02, 0.01, 0.0, -0.01, -0.02]
    commands = [(n / 30, CMD_VEL, twist(velocity, 0.0)) for n, velocity in enumerate(velocities)]
    signs = [(n / 30 - 0.001, HAND_SIGN, String(data="Backward")) for n in range(5)]
    facts = facts_of(written(tmp_path / "drive.mcap", sorted([*commands, *signs], key=lambda message: message[0])))
    assert (facts.stands, facts.stand_count) == ([], 0)


def test_many_stops_keep_few_pictures(recording: Path, tmp_path: Path) -> None:
    frame: Recorded = next(McapFile(recording).messages({IMAGE_COMPRESSED.name}))
    frames: list[Message] = [(2.0 * n + 0.95, IMAGE_COMPRESSED, frame.raw) for n in range(100)]
    messages = sorted([*frames, *drives(times=100)], key=lambda message: message[0])
    facts = facts_of(written(tmp_path / "drive.mcap", messages))
    with_picture = [index for index, stand in enumerate(facts.stands) if stand.picture is not None]
    assert facts.stand_count == len(facts.stands) == 100
    assert MOST_PICTURES / 2 <= len(with_picture) <= MOST_PICTURES
    assert with_picture[-1] > 90


def test_laps_and_bumps_of_several_tries(tmp_path: Path) -> None:
    states = [
        *(
            CourseState(3),
            CourseState(3, 1, time_s=2.0, phase="running"),
            CourseState(3, 2, time_s=4.0, phase="running"),
        ),
        *(
            CourseState(3),
            CourseState(3, 1, time_s=1.0, phase="running"),
            CourseState(3, 3, frozenset({1}), 1, 5.0, "finished"),
        ),
    ]
    collisions = [0, 0, 2, 0, 0, 1]
    reports: list[Message] = []
    for n, (course, bumps) in enumerate(zip(states, collisions, strict=True)):
        status = RobotStatus(collisions=bumps, path_length_m=float(n % 3), course=course)
        reports.append((float(n), DIAGNOSTICS, write_status(status, "robot", Time(sec=n, nanosec=0))))
    facts = facts_of(written(tmp_path / "drive.mcap", reports))
    assert [lap.course.passed for lap in facts.laps] == [2, 2]
    assert [lap.course.phase for lap in facts.laps] == ["running", "finished"]
    assert facts.laps[1].course.score_s == 5.0 + 2.0 + 10.0
    assert len(facts.bumps) == 3
    assert facts.distance_m == 4.0


def reported(path: Path, statuses: Iterable[RobotStatus]) -> DriveFacts:
    """Return the facts of a recording with a status each second."""
    return facts_of(
        written(
            path,
            [
                (float(n), DIAGNOSTICS, write_status(status, "robot", Time(sec=n, nanosec=0)))
                for n, status in enumerate(statuses)
            ],
        )
    )


def test_a_lap_from_before_the_recording_is_none_of_it_or_says_so(tmp_path: Path) -> None:
    finished = [CourseState(3, 3, time_s=31.5, phase="finished")] * 3
    assert reported(tmp_path / "over.mcap", [RobotStatus(course=course) for course in finished]).laps == []
    running = [CourseState(3, 2, time_s=14.0 + n, phase="running") for n in range(3)]
    facts = reported(tmp_path / "running.mcap", [RobotStatus(course=course) for course in running])
    assert [(lap.began_s, lap.course.time_s) for lap in facts.laps] == [(-14.0, 16.0)]
    (laps,) = (total for total in words.totals(facts) if total.name == "laps")
    assert laps.more.endswith("0:16.0, begun 14.0 s before the recording")


def test_the_worlds_are_those_that_it_drove_in(tmp_path: Path) -> None:
    names = ("slalom", "slalom", "My course", "slalom")
    facts = reported(tmp_path / "drive.mcap", [RobotStatus(world=name) for name in names])
    assert facts.totals()["world"] == "slalom, then My course, then slalom"


@pytest.mark.slow
def test_a_world_that_was_loaded_before_the_recording_is_named(tmp_path: Path) -> None:
    with Graph(Config(), SteppedClock()) as graph:
        loaded = graph.robot.surroundings.enter(rename(load_world("slalom"), "Mine"))
        graph.run_stepped(0.5)
        loaded.result(0)
        graph.record(tmp_path / "drive.mcap")
        graph.run_stepped(1.0)
    facts = facts_of(tmp_path / "drive.mcap")
    assert (facts.worlds, facts.laps) == (["Mine"], [])


def test_a_stop_that_is_set_twice_counts_once(tmp_path: Path) -> None:
    presses: list[Message] = [(n, STOP, Bool(data=is_set)) for n, is_set in enumerate([True, True, False, True])]
    assert facts_of(written(tmp_path / "drive.mcap", presses)).stops == 2


def test_the_audit_is_listed_without_what_is_listed_as_stops(tmp_path: Path) -> None:
    events = [
        AuditEvent("seat_taken", "viewer 1", "took the seat"),
        AuditEvent("stands", "hand_sign_control", "stands: no sign is seen"),
        AuditEvent("setting_changed", "viewer 1", "changed control.max_linear from 1 to 0.2"),
    ]
    messages: list[Message] = [
        (float(n), AUDIT, write_event(event, Time(sec=n, nanosec=0))) for n, event in enumerate(events)
    ]
    told = facts_of(written(tmp_path / "drive.mcap", messages)).events
    assert [(event.time_s, event.who) for event in told] == [(0.0, "viewer 1"), (2.0, "viewer 1")]
    assert told[1].sentence == "changed control.max_linear from 1 to 0.2"
