"""Both ends of a reliable connection of RTPS, as what follows from what comes (DDSI-RTPS 2.5, section 8.4).

Nothing here knows of sockets or of time: whoever calls sends what is returned, and repeats it for as long as the other
end has not confirmed it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from handsteer.transports.dds.rtps.wire import WIDEST_SET, AckNack, Data, Gap, Heartbeat, Parameters, Submessage

_AHEAD = WIDEST_SET
"""How far ahead of the next sample one is kept that has come too early."""


@dataclass
class _Reader:
    """What a writer knows of a reader."""

    entity: bytes
    start: int
    told: int
    acked: int
    heartbeats: int = 0


@dataclass(frozen=True)
class _Sample:
    data: Data
    reader: bytes | None


class Writer:
    """The sending end.

    Args:
        entity: Its own.
        keeps: Whether readers that come late get what was written before; volatile, otherwise.
        depth: How many samples are kept at most for those that have not confirmed them.
    """

    def __init__(self, entity: bytes, *, keeps: bool, depth: int) -> None:
        self.entity = entity
        self._keeps = keeps
        self._depth = depth
        self._last = 0
        self._samples: dict[int, _Sample] = {}
        self._readers: dict[bytes, _Reader] = {}

    @property
    def readers(self) -> tuple[bytes, ...]:
        """Identifiers of the readers that are known."""
        return tuple(self._readers)

    @property
    def kept(self) -> int:
        """How many samples are kept."""
        return len(self._samples)

    def match(self, guid: bytes) -> list[Submessage]:
        """Add the reader of this identifier; return what it gets at once."""
        if guid in self._readers:
            return []
        start = 0 if self._keeps else self._last
        reader = _Reader(guid[-4:], start, start, start + 1)
        self._readers[guid] = reader
        return [*self._news(guid, reader), self._heartbeat(reader)]

    def unmatch(self, guid: bytes) -> None:
        """Forget the reader of this identifier, and the samples that were for it alone."""
        self._readers.pop(guid, None)
        self._samples = {number: sample for number, sample in self._samples.items() if sample.reader != guid}

    def write(
        self, payload: bytes | None, inline: Parameters | None = None, reader: bytes | None = None
    ) -> dict[bytes, list[Submessage]]:
        """Write a sample, for all readers or for one; return what each of them gets."""
        self._last += 1
        data = Data(bytes(4), self.entity, self._last, payload, inline or Parameters())
        self._samples[self._last] = _Sample(data, reader)
        while len(self._samples) > self._depth:
            del self._samples[min(self._samples)]
        told = self._readers if reader is None else {reader: self._readers[reader]} if reader in self._readers else {}
        return {guid: [*self._news(guid, known), self._heartbeat(known)] for guid, known in told.items()}

    def acknowledge(self, guid: bytes, said: AckNack) -> list[Submessage]:
        """Note what the reader has; return what it asks for."""
        reader = self._readers.get(guid)
        if reader is None or not 0 <= said.base <= self._last + 1:
            return []
        reader.acked = max(reader.acked, said.base)
        self._forget_acknowledged()
        answer = self._again(guid, reader, [number for number in said.missing if 0 < number <= self._last])
        if answer or not said.final:
            answer.append(self._heartbeat(reader))
        return answer

    def pending(self) -> dict[bytes, list[Submessage]]:
        """Return what each reader gets that has not confirmed all that was for it."""
        return {
            guid: [self._heartbeat(reader)] for guid, reader in self._readers.items() if reader.acked <= reader.told
        }

    def _news(self, guid: bytes, reader: _Reader) -> list[Submessage]:
        numbers = range(reader.told + 1, self._last + 1)
        reader.told = self._last
        return self._again(guid, reader, numbers)

    def _again(self, guid: bytes, reader: _Reader, numbers: Iterable[int]) -> list[Submessage]:
        found: list[Submessage] = []
        gone: list[int] = []
        for number in numbers:
            sample = self._samples.get(number)
            if sample is not None and number > reader.start and sample.reader in {None, guid}:
                found.append(replace(sample.data, reader=reader.entity))
            else:
                gone.append(number)
        return [*self._gaps(reader, gone), *found]

    def _gaps(self, reader: _Reader, numbers: list[int]) -> list[Submessage]:
        gaps: list[Submessage] = []
        at = 0
        while at < len(numbers):
            end = at
            while end + 1 < len(numbers) and numbers[end + 1] == numbers[end] + 1:
                end += 1
            gaps.append(Gap(reader.entity, self.entity, numbers[at], numbers[end] + 1, ()))
            at = end + 1
        return gaps

    def _heartbeat(self, reader: _Reader) -> Heartbeat:
        reader.heartbeats += 1
        first = reader.start + 1
        return Heartbeat(reader.entity, self.entity, first, max(reader.told, first - 1), reader.heartbeats, final=False)

    def _forget_acknowledged(self) -> None:
        if self._keeps:
            return
        for number, sample in list(self._samples.items()):
            reader = self._readers.get(sample.reader or b"")
            if reader is not None and number < reader.acked:
                del self._samples[number]


@dataclass
class _Sender:
    """What a reader knows of a writer: ``waiting`` has the samples that came too early, None for one never to come."""

    next: int | None
    last: int = 0
    is_heard: bool = False
    waiting: dict[int, Data | None] = field(default_factory=dict)
    acks: int = 0


class Reader:
    """The receiving end: gives each writer's samples in their order, each once.

    Args:
        entity: Its own.
        wants_all: Whether it wants what was written before it came, too; volatile, otherwise.
    """

    def __init__(self, entity: bytes, *, wants_all: bool) -> None:
        self.entity = entity
        self._wants_all = wants_all
        self._writers: dict[bytes, _Sender] = {}

    @property
    def writers(self) -> tuple[bytes, ...]:
        """Identifiers of the writers that are known."""
        return tuple(self._writers)

    def match(self, guid: bytes) -> list[Submessage]:
        """Add the writer of this identifier; return what asks it to say what it has."""
        if guid in self._writers:
            return []
        writer = self._writers[guid] = _Sender(1 if self._wants_all else None)
        return [self._answer(guid, writer, final=False)]

    def unmatch(self, guid: bytes) -> None:
        """Forget the writer of this identifier."""
        self._writers.pop(guid, None)

    def take(self, guid: bytes, data: Data) -> tuple[list[Data], list[Submessage]]:
        """Take a sample; return those whose turn it is, and what asks for those that are missing."""
        writer = self._writers.get(guid)
        if writer is None or data.number < 1:
            return [], []
        if writer.next is None and data.number == 1:
            writer.next = 1  # nothing can have been before it
        base = writer.next if writer.next is not None else min([data.number, *writer.waiting])
        if base <= data.number < base + _AHEAD:
            writer.waiting.setdefault(data.number, data)
        return self._due(writer), [self._answer(guid, writer, final=False)] if writer.next is None else []

    def skip(self, guid: bytes, gap: Gap) -> list[Data]:
        """Wait no more for samples that will not come; return those whose turn it is."""
        writer = self._writers.get(guid)
        if writer is None or writer.next is None:
            return []
        if gap.start <= writer.next < gap.base:
            writer.next = gap.base
        highest = writer.next + _AHEAD
        for number in (*range(max(gap.start, writer.next), min(gap.base, highest)), *gap.numbers):
            if writer.next <= number < highest:
                writer.waiting[number] = None
        return self._due(writer)

    def hear(self, guid: bytes, said: Heartbeat) -> tuple[list[Data], list[Submessage]]:
        """Note what the writer has; return the samples whose turn it is, and what asks for those that are missing."""
        writer = self._writers.get(guid)
        if writer is None or said.first < 1 or said.last < said.first - 1:
            return [], []
        writer.next = max(writer.next or said.first, said.first)
        writer.last = said.last
        writer.is_heard = True
        due = self._due(writer)
        answer = self._answer(guid, writer, final=True)
        return due, [answer] if answer.missing or not said.final else []

    def pending(self) -> dict[bytes, list[Submessage]]:
        """Return what asks each writer again that has not said what it has, or not given all of it."""
        asked = {guid: writer for guid, writer in self._writers.items() if self._lacks(writer)}
        return {guid: [self._answer(guid, writer, final=False)] for guid, writer in asked.items()}

    def _lacks(self, writer: _Sender) -> bool:
        return not writer.is_heard or writer.next is None or writer.next <= writer.last

    def _due(self, writer: _Sender) -> list[Data]:
        if writer.next is None:
            return []
        for number in [number for number in writer.waiting if number < writer.next]:
            del writer.waiting[number]
        found = []
        while writer.next in writer.waiting:
            data = writer.waiting.pop(writer.next)
            writer.next += 1
            if data is not None:
                found.append(data)
        return found

    def _answer(self, guid: bytes, writer: _Sender, *, final: bool) -> AckNack:
        # Fast DDS begins with 0 itself, and takes it for the wish to hear at once of all that there is.
        base = (writer.next or 0) if writer.is_heard else 0
        end = min(writer.last, base + WIDEST_SET - 1) if writer.is_heard else -1
        missing = tuple(number for number in range(base, end + 1) if number not in writer.waiting)
        writer.acks += 1
        return AckNack(self.entity, guid[-4:], base, missing, writer.acks, final and not missing)
