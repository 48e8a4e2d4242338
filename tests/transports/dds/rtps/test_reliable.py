"""A writer and its readers, on a network that loses, repeats and shuffles what they say."""

import random

from hypothesis import given
from hypothesis import strategies as st

from handsteer.transports.dds.rtps.reliable import Reader, Writer
from handsteer.transports.dds.rtps.wire import AckNack, Data, Gap, Heartbeat, Submessage

WRITER = b"w" * 12 + b"\0\0\1\3"
READERS = tuple(bytes([number]) * 12 + b"\0\0\1\4" for number in range(3))
ENTITY = WRITER[-4:]
ROUNDS = 400


class Network:
    """One writer, some readers, and what is under way between them."""

    def __init__(self, *, keeps: bool, seed: int, depth: int = 1000) -> None:
        self.random = random.Random(seed)
        self.writer = Writer(ENTITY, keeps=keeps, depth=depth)
        self.readers = {guid: Reader(guid[-4:], wants_all=keeps) for guid in READERS}
        self.got: dict[bytes, list[bytes | None]] = {guid: [] for guid in READERS}
        self.flying: list[tuple[bytes, Submessage]] = []
        self.loses = 0.3

    def send(self, guid: bytes, parts: list[Submessage]) -> None:
        for part in parts:
            copies = self.random.choice([1, 1, 1, 2]) if self.random.random() >= self.loses else 0
            self.flying += [(guid, part)] * copies

    def match(self, guid: bytes) -> None:
        self.send(guid, self.readers[guid].match(WRITER))
        self.send(guid, self.writer.match(guid))

    def write(self, payload: bytes, guid: bytes | None) -> None:
        for reader, parts in self.writer.write(payload, reader=guid).items():
            self.send(reader, parts)

    def step(self) -> None:
        self.random.shuffle(self.flying)
        flying, self.flying = self.flying, []
        for guid, part in flying:
            self.deliver(guid, part)

    def deliver(self, guid: bytes, part: Submessage) -> None:
        reader = self.readers[guid]
        due: list[Data] = []
        match part:
            case AckNack():
                self.send(guid, self.writer.acknowledge(guid, part))
            case Data():
                due, answer = reader.take(WRITER, part)
                self.send(guid, answer)
            case Gap():
                due = reader.skip(WRITER, part)
            case Heartbeat():
                due, answer = reader.hear(WRITER, part)
                self.send(guid, answer)
        self.got[guid] += [data.payload for data in due]

    def settle(self) -> None:
        self.loses = 0.0
        for _ in range(ROUNDS):
            self.step()
            for guid, parts in self.writer.pending().items():
                self.send(guid, parts)
            for guid, reader in self.readers.items():
                for parts in reader.pending().values():
                    self.send(guid, parts)
            if not self.flying:
                return
        raise AssertionError("they never come to rest")


steps = st.lists(
    st.tuples(st.sampled_from(["match", "write", "write", "step", "step"]), st.integers(0, 3)), max_size=60
)


@given(steps, st.booleans(), st.integers(0, 2**32))
def test_each_reader_gets_what_is_for_it_in_order_and_once(
    moves: list[tuple[str, int]], keeps: bool, seed: int
) -> None:
    network = Network(keeps=keeps, seed=seed)
    matched: set[bytes] = set()
    wanted: dict[bytes, list[bytes]] = {guid: [] for guid in READERS}
    for count, (move, number) in enumerate(moves):
        target = READERS[number] if number < len(READERS) else None
        if move == "match" and target is not None:
            network.match(target)
            matched.add(target)
        elif move == "write":
            payload = b"%d" % count
            network.write(payload, target)
            for guid in READERS:
                if target in {None, guid} and (keeps or guid in matched):
                    wanted[guid].append(payload)
        else:
            network.step()
    network.settle()
    for guid in matched:
        assert network.got[guid] == wanted[guid]


@given(steps, st.integers(0, 2**32))
def test_what_is_confirmed_is_not_kept(moves: list[tuple[str, int]], seed: int) -> None:
    network = Network(keeps=False, seed=seed)
    for guid in READERS:
        network.match(guid)
    for count, (_, number) in enumerate(moves):
        network.write(b"%d" % count, READERS[number % len(READERS)])
        network.step()
    network.settle()
    assert network.writer.kept == 0
    assert network.writer.pending() == {}


def test_no_more_is_kept_than_the_depth_and_readers_do_not_wait_for_what_is_gone() -> None:
    network = Network(keeps=False, seed=1, depth=5)
    network.match(READERS[0])
    network.settle()
    network.loses = 1.0
    for count in range(50):
        network.write(b"%d" % count, READERS[0])
    assert network.writer.kept == 5
    network.settle()
    assert network.got[READERS[0]] == [b"45", b"46", b"47", b"48", b"49"]


def test_a_reader_that_leaves_takes_its_samples_with_it() -> None:
    network = Network(keeps=False, seed=1)
    network.match(READERS[0])
    network.write(b"x", READERS[0])
    network.writer.unmatch(READERS[0])
    assert network.writer.kept == 0
    assert network.writer.pending() == {}


@given(
    st.lists(
        st.one_of(
            st.builds(Data, st.just(b"\0\0\1\4"), st.just(ENTITY), st.integers(-5, 2**63), st.just(b"x" * 100)),
            st.builds(
                Heartbeat,
                *(st.just(b"\0\0\1\4"), st.just(ENTITY), st.integers(-5, 2**63), st.integers(-5, 2**63)),
                *(st.just(1), st.booleans()),
            ),
            st.builds(
                Gap,
                *(st.just(b"\0\0\1\4"), st.just(ENTITY), st.integers(-5, 2**63), st.integers(-5, 2**63), st.just(())),
            ),
        ),
        max_size=30,
    )
)
def test_a_writer_that_talks_nonsense_fills_no_memory(parts: list[Submessage]) -> None:
    reader = Reader(b"\0\0\1\4", wants_all=False)
    reader.match(WRITER)
    for part in parts:
        if isinstance(part, Data):
            reader.take(WRITER, part)
        elif isinstance(part, Heartbeat):
            reader.hear(WRITER, part)
        elif isinstance(part, Gap):
            reader.skip(WRITER, part)
    for answers in reader.pending().values():
        assert all(len(answer.missing) <= 256 for answer in answers if isinstance(answer, AckNack))
