"""Runs recognition and control again from a recording without journals, such as one made of a graph by others.

The nodes run on a stepped clock and get each message at the time at which it was recorded. Frames that were skipped in
the recorded run are processed here, and times differ by what the messages took to the recorder. So a recorded result
counts as the same if it holds in the replay at some time within :data:`TOLERANCE_S`.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from handsteer.clock import SteppedClock
from handsteer.config import Config
from handsteer.errors import RecordingError
from handsteer.making import cmd_vel_topic, make_control, make_recognition
from handsteer.messages import (
    HAND_SIGN,
    IMAGE_COMPRESSED,
    IMAGE_RAW,
    JOY,
    ODOM,
    SCAN,
    STEERING_CMD_VEL,
    STOP,
    Topic,
    twist_in,
    type_name,
)
from handsteer.nodes.base import Node
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.plugins.record.replay.rerun import CONTROL, RECOGNITION, Result, Source
from handsteer.transports.base import Publisher, Received
from handsteer.transports.encoding import encode
from handsteer.transports.in_process import InProcessTransport

TOLERANCE_S = 0.15
"""A camera's slow period, and the way of a message to the recorder."""

_LONGEST_GAP_S = 10.0
_PICTURES = (IMAGE_COMPRESSED, IMAGE_RAW)
_INPUTS = (STEERING_CMD_VEL, STOP, JOY, ODOM, SCAN)


@dataclass
class _Trace:
    """The replayed messages of a topic, by time."""

    times_s: list[float] = field(default_factory=list)
    raws: list[bytes] = field(default_factory=list)

    def add(self, time_s: float, message: Any) -> None:
        self.times_s.append(time_s)
        self.raws.append(encode(message))

    def around(self, time_s: float) -> list[bytes]:
        """Return what holds within the tolerance of ``time_s``, oldest first."""
        first = max(0, bisect_right(self.times_s, time_s - TOLERANCE_S) - 1)
        return self.raws[first : bisect_left(self.times_s, time_s + TOLERANCE_S)]


def rerun_by_time(recording: Recording, config: Config, source: Source = "frames") -> Iterator[Result]:
    """Yield each recorded sign and command with the replayed one.

    Args:
        recording: Has pictures, or signs for ``source="signs"``.
        config: The parameters of the nodes.
        source: ``frames`` runs recognition and control, ``signs`` the control alone, with the recorded signs.

    Raises:
        RecordingError: It contains neither.
        ModelError: A model is missing or broken.
    """
    cmd_vel = cmd_vel_topic(config)
    pictures = _picture_topic(recording)
    traces = _run(recording, config, source, cmd_vel, pictures)
    frame: Recorded | None = None
    for recorded in recording.messages({*traces, pictures}):
        if recorded.topic == pictures:
            frame = recorded
            yield Result(RECOGNITION, recorded.time_s, {}, {}, {}, recorded)
            continue
        replayed = traces[recorded.topic].around(recorded.time_s)
        is_sign = recorded.topic == HAND_SIGN.name
        raw = recorded.raw if is_sign else _twist_of(recorded)
        nearest = [raw] if raw in replayed else replayed[-1:]
        yield Result(
            RECOGNITION if is_sign else CONTROL,
            recorded.time_s,
            {recorded.topic: [raw]},
            {recorded.topic: nearest},
            {},
            frame if is_sign else None,
        )


def _twist_of(recorded: Recorded) -> bytes:
    """Return a recorded command without the time stamp that some robots want, as the replayed one is."""
    try:
        return encode(twist_in(recorded.message))
    except RecordingError:
        return recorded.raw


def _picture_topic(recording: Recording) -> str:
    kinds = {topic.name: type_name(topic.type) for topic in _PICTURES}
    found = {recorded.topic for recorded in recording.messages(set(kinds)) if recorded.type == kinds[recorded.topic]}
    return next((topic.name for topic in _PICTURES if topic.name in found), "")


def _run(
    recording: Recording, config: Config, source: Source, cmd_vel: Topic[Any], picture_topic: str
) -> dict[str, _Trace]:
    """Run the nodes; return what they published on the compared topics."""
    clock, transport = SteppedClock(recording.began_s), InProcessTransport()
    control = make_control(config, transport, clock, simulated=config.robot.kind == "sim", cmd_vel=cmd_vel)
    nodes: list[Node] = [control]
    inputs: dict[str, Topic[Any]] = {topic.name: topic for topic in _INPUTS}
    compared = [cmd_vel]
    if source == "frames":
        pictures = {topic.name: topic for topic in _PICTURES}
        kept = pictures.get(picture_topic)
        if kept is None:
            raise RecordingError(f"{recording.path} contains no pictures on {' or '.join(pictures)}")
        inputs[kept.name] = kept
        transport_of_images = "compressed" if kept is IMAGE_COMPRESSED else "raw"
        signs = config.signs.model_copy(update={"image_transport": transport_of_images})
        nodes.insert(0, make_recognition(config.model_copy(update={"signs": signs}), transport, clock))
        compared.append(HAND_SIGN)
    else:
        inputs[HAND_SIGN.name] = HAND_SIGN
    traces = {topic.name: _Trace() for topic in compared}
    for topic in compared:
        _follow(transport, topic, traces[topic.name], clock)
    publishers: dict[str, Publisher[Any]] = {}
    count = 0
    for recorded in recording.messages(set(inputs)):
        _advance(nodes, clock, recorded.time_s)
        topic = inputs[recorded.topic]
        if recorded.type != type_name(topic.type):
            continue
        try:
            message = recorded.message
        except RecordingError:
            continue
        if recorded.topic not in publishers:
            publishers[recorded.topic] = transport.advertise("recording", topic)
        captured_s = clock.now() if topic in (*_PICTURES, HAND_SIGN) else None
        publishers[recorded.topic].publish(message, captured_s)
        _spin(nodes)
        count += 1
    for node in nodes:
        node.stop()
    if not count:
        raise RecordingError(f"{recording.path} contains nothing that recognition or control would get")
    return traces


def _follow(transport: InProcessTransport, topic: Topic[Any], trace: _Trace, clock: SteppedClock) -> None:
    def deliver(received: Received[Any]) -> None:
        trace.add(clock.now(), received.message)

    transport.subscribe("replay", topic, deliver)


def _advance(nodes: list[Node], clock: SteppedClock, until_s: float) -> None:
    """Run the timers of ``nodes`` that are due before ``until_s``, then set the clock to that.

    In a longer gap nothing happens after the first seconds, and it may last for years by a wrong clock.
    """
    busy_until_s = min(until_s, clock.now() + _LONGEST_GAP_S)
    while (due_s := min(node.next_due_s or until_s for node in nodes)) < busy_until_s:
        clock.advance_to(due_s)
        _spin(nodes)
    clock.advance_to(until_s)


def _spin(nodes: list[Node]) -> None:
    while any([node.spin_once() for node in nodes]):
        pass
