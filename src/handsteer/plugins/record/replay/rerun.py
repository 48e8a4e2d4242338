"""Runs recognition and control again, from a recording with journals, and finds each result that differs.

Each node gets what it got in the recording, at the same readings of its clock; recognition runs first, then the control
with the signs that result. With the same version, parameters and models, all results are the same bit for bit.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Literal

from pydantic import ValidationError

from handsteer.config import Config
from handsteer.errors import RecordingError, quoted
from handsteer.making import cmd_vel_topic, make_control, make_recognition
from handsteer.messages import CAMERA_CHANGED, CMD_VEL, GESTURE_JOY, HAND_SIGN, IMAGE_COMPRESSED
from handsteer.nodes.base import Node
from handsteer.nodes.journal import JOURNALS
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.plugins.record.replay.journals import Got, ReplayClock, ReplayTransport, Spin, clock_offset, read_spins
from handsteer.transports.base import Received
from handsteer.transports.encoding import encode

Source = Literal["frames", "signs"]

RECOGNITION, CONTROL = "hand_sign_recognition", "hand_sign_control"
_OUTPUTS = {RECOGNITION: (HAND_SIGN.name, GESTURE_JOY.name), CONTROL: (CMD_VEL.name,)}
# How much later than published a message may be processed before it counts as one that the recording lacks.
_EXTRA_AFTER_S = 0.005


@dataclass(frozen=True)
class Result:
    """What a node published in one spin.

    Attributes:
        node: Name of the node.
        time_s: When the spin ended, in seconds since the epoch of the recording's stamps.
        recorded: The recorded messages, as CDR, by topic.
        replayed: The messages of the replay.
        messages: The same, with the capture time of each.
        frame: The frame that was processed; None if there was none.
    """

    node: str
    time_s: float
    recorded: dict[str, list[bytes]]
    replayed: dict[str, list[bytes]]
    messages: dict[str, list[tuple[Any, float | None]]]
    frame: Recorded | None = None

    @property
    def differs(self) -> bool:
        """Whether any message differs."""
        return self.recorded != self.replayed


@dataclass(frozen=True)
class _Sent:
    """A message that recognition has published in the replay.

    Attributes:
        message: The message.
        captured_s: Capture time of the frame that led to it.
        is_as_recorded: Whether as many messages of the topic were recorded in that spin.
        time_s: When that spin ended.
    """

    message: Any
    captured_s: float | None
    is_as_recorded: bool
    time_s: float


class _Outputs:
    """The results of recognition, message by message, for the control.

    Args:
        first: Number of the first recorded message of each topic.
    """

    def __init__(self, first: dict[str, int]) -> None:
        self.sent: dict[str, list[_Sent]] = {}
        self._first = first
        self._recorded: dict[str, list[tuple[int, int]]] = {}
        self._begins: dict[str, list[int]] = {}
        self._spins = 0

    def add(self, result: Result) -> None:
        for topic in _OUTPUTS[RECOGNITION]:
            sent = self.sent.setdefault(topic, [])
            self._begins.setdefault(topic, []).append(len(sent))
            count = len(result.recorded.get(topic, ()))
            messages = result.messages.get(topic, [])
            same = count == len(messages)
            sent += [_Sent(message, captured_s, same, result.time_s) for message, captured_s in messages]
            self._recorded.setdefault(topic, []).extend((self._spins, position) for position in range(count))
        self._spins += 1

    def lacks(self, topic: str, number: int) -> bool:
        """Return whether the recorded message of this number is later than all that recognition has published."""
        return number - self._first.get(topic, 1) >= len(self._recorded.get(topic, []))

    def end_of(self, topic: str, number: int) -> int:
        """Return how many messages of the replay go until the recorded one of this number, that included."""
        recorded, begins = self._recorded.get(topic, []), self._begins.get(topic, [])
        index = number - self._first.get(topic, 1)
        if not 0 <= index < len(recorded):
            return 0
        spin, position = recorded[index]
        end = begins[spin + 1] if spin + 1 < len(begins) else len(self.sent[topic])
        is_same = all(each.is_as_recorded for each in self.sent[topic][begins[spin] : end])
        return begins[spin] + position + 1 if is_same and begins[spin] + position < end else end


def rerun(file: Recording, config: Config, source: Source = "frames") -> Iterator[Result]:
    """Yield the results of the recorded run's spins, first all of recognition, then all of the control.

    Args:
        file: A recording with journals.
        config: The parameters of the nodes.
        source: ``frames`` runs recognition and control, ``signs`` the control alone, with the recorded signs.

    Raises:
        RecordingError: The recording has no journals, or they are damaged.
        ModelError: A model is missing or broken.
    """
    outputs: _Outputs | None = None
    if source == "frames":
        outputs = _Outputs({topic: _first_number(file, topic) for topic in _OUTPUTS[RECOGNITION]})
        looks_at_jpegs = config.model_copy(
            update={"signs": config.signs.model_copy(update={"image_transport": "compressed"})}
        )
        for result in _rerun(
            file,
            RECOGNITION,
            lambda *wires: make_recognition(looks_at_jpegs, *wires, camera_changed=CAMERA_CHANGED),
            None,
        ):
            outputs.add(result)
            yield result
    is_simulated = config.robot.kind == "sim"
    yield from _rerun(
        file,
        CONTROL,
        lambda *wires: make_control(
            config, *wires, simulated=is_simulated, cmd_vel=cmd_vel_topic(config), camera_changed=CAMERA_CHANGED
        ),
        outputs,
    )


def has_journals(file: Recording) -> bool:
    """Return whether :func:`rerun` can run it again; otherwise ``rerun_by_time`` can."""
    return JOURNALS in file.about


def recorded_config(file: Recording) -> Config:
    """Return the parameters of the recorded run.

    Raises:
        RecordingError: The recording does not contain them, or they do not fit this version.
    """
    if "config" not in file.about:
        raise RecordingError(f"{file.path} was not recorded by handsteer: it contains no parameters")
    try:
        return Config.model_validate_json(file.about["config"])
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise RecordingError(f"{file.path}: the recorded parameter {where} does not fit: {first['msg']}") from None


def _first_number(file: Recording, topic: str) -> int:
    return next((recorded.number for recorded in file.messages({topic})), 1)


def _rerun(
    file: Recording, name: str, make: Callable[[ReplayTransport, ReplayClock], Node], outputs: _Outputs | None
) -> Iterator[Result]:
    clock, transport = ReplayClock(_clock_offset(file)), ReplayTransport()
    spins = read_spins(file, name)
    recorded = _RecordedOutputs(file, _OUTPUTS[name])
    first = next(spins, None)
    if first is None:
        why = file.problem or "it was not recorded by `handsteer run`"
        raise RecordingError(f"{file.path} has no journal of {name}: {why}")
    clock.set(first.readings)
    transport.answers.update(first.saw)
    node = make(transport, clock)
    transport.take()
    feed = _Feed(outputs) if outputs is not None else None
    for spin in spins:
        if feed is not None and feed.lacks(spin):
            return  # it was cut off in the spin of recognition that published what the control has got here
        clock.set(spin.readings)
        transport.answers.update(spin.saw)
        if spin.is_stop:
            node.stop()
        else:
            if spin.config is not None:
                node.reconfigure(_config(file, spin.config))
            for topic, received in feed.received(spin) if feed else _received(spin.got):
                transport.deliver(topic, received)
            node.spin_once()
        frames = [got.recorded for got in spin.got if got.topic == IMAGE_COMPRESSED.name]
        yield _result(name, spin, recorded, transport, frames[-1] if frames else None)


def _result(
    name: str, spin: Spin, recorded: "_RecordedOutputs", transport: ReplayTransport, frame: Recorded | None
) -> Result:
    messages: dict[str, list[tuple[Any, float | None]]] = {}
    for topic, message, captured_s in transport.take():
        if topic in _OUTPUTS[name]:
            messages.setdefault(topic, []).append((message, captured_s))
    replayed = {topic: [encode(message) for message, _ in pairs] for topic, pairs in messages.items()}
    return Result(name, spin.time_s, recorded.take(spin.gave), replayed, messages, frame)


class _RecordedOutputs:
    """The recorded messages of a node's topics, in order."""

    def __init__(self, file: Recording, topics: tuple[str, ...]) -> None:
        self._streams = {topic: file.messages({topic}) for topic in topics}

    def take(self, gave: dict[str, int]) -> dict[str, list[bytes]]:
        """Return the next messages: so many of each topic."""
        taken: dict[str, list[bytes]] = {}
        for topic, stream in self._streams.items():
            if count := gave.get(topic, 0):
                found = [recorded.raw for recorded in islice(stream, count)]
                taken[topic] = found + [b""] * (count - len(found))
        return taken


class _Feed:
    """Passes the control the signs of the replay in place of the recorded ones.

    Where the replay published as many as were recorded, these are passed at the same moments; a message that the
    recording lacks is passed at the first spin after it.
    """

    def __init__(self, outputs: _Outputs) -> None:
        self._outputs = outputs
        self._passed = dict.fromkeys(_OUTPUTS[RECOGNITION], 0)

    def lacks(self, spin: Spin) -> bool:
        """Return whether recognition has not published what was processed in ``spin``."""
        return any(got.topic in self._passed and self._outputs.lacks(got.topic, got.number) for got in spin.got)

    def received(self, spin: Spin) -> Iterator[tuple[str, Received[Any]]]:
        yield from _received([got for got in spin.got if got.topic not in self._passed])
        for topic, passed in self._passed.items():
            numbers = [got.number for got in spin.got if got.topic == topic]
            sent = self._outputs.sent.get(topic, [])
            until = max([passed, *(self._outputs.end_of(topic, number) for number in numbers)])
            while until < len(sent) and self._is_extra(sent[until], spin):
                until += 1
            for each in sent[passed:until]:
                yield topic, Received(each.message, each.captured_s, number=max(numbers, default=0))
            self._passed[topic] = until

    @staticmethod
    def _is_extra(sent: _Sent, spin: Spin) -> bool:
        return not sent.is_as_recorded and sent.time_s + _EXTRA_AFTER_S < spin.time_s


def _received(gots: list[Got]) -> Iterator[tuple[str, Received[Any]]]:
    for got in gots:
        if got.recorded is not None:
            message = got.recorded.message
            yield got.topic, Received(message, got.captured_s, got.is_late, got.by_player, got.number)


def _config(file: Recording, values: dict[str, Any]) -> Config:
    try:
        return Config.model_validate(values)
    except ValidationError:
        raise RecordingError(f"{file.path}: parameters that were changed do not fit this version") from None


def _clock_offset(file: Recording) -> float:
    name = "clock_offset_s"
    offset_s = clock_offset(file.about) if name in file.about else 0.0
    if offset_s is None:
        raise RecordingError(f"{file.path}: {name}: {quoted(file.about[name])} is not a valid time in seconds")
    return offset_s
