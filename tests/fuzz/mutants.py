"""A seeded mutator over a corpus, and what must hold of everything that reads what comes from anywhere."""

import os
import random
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import pytest

from handsteer.errors import HandsteerError

CASES = int(os.environ.get("HANDSTEER_FUZZ_CASES", "1000"))
"""Of each reader: 1,000 in ``make test``, 100,000 in ``make fuzz``."""

SLOWEST_S = 5.0
"""No case may take longer; most take less than a millisecond, but the machines that run the tests are shared."""

LARGEST_GROWTH_MB = 600
"""The process may have grown so much at the end: a tenth of what one bad file cost."""

_ODD = (
    b"\x00", b"\xff", b"\xff\xd8", b"\xff\xd9", b"9" * 70, b"[" * 40, b"{" * 40, b"&a ", b"*a", b"<<: ", b"!!float ",
    b"!!timestamp ", b"1e999", b"-1e999", b".nan", b"\xf0\x9f\x98\x80", b"\r\n", b"\x1b[2J", b"\\u0000", b"null", b": ",
    b"- ", b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\x00\x00\x00\x80", b"../", b"%s%n", b"NaN", b"1:1:1", b"0x",
)  # fmt: skip


def mutants(corpus: Sequence[bytes], cases: int = CASES, seed: int = 0) -> Iterator[bytes]:
    """Yield the corpus, then changes of it: bytes flipped, cut, doubled, joined, and odd words put in."""
    yield from corpus
    chance = random.Random(seed)
    for _ in range(cases - len(corpus)):
        data = bytearray(chance.choice(corpus))
        for _ in range(chance.choice((1, 1, 2, 3, 8))):
            _change(data, chance, corpus)
        yield bytes(data)


def _change(data: bytearray, chance: random.Random, corpus: Sequence[bytes]) -> None:
    at = chance.randrange(len(data) + 1)
    to = min(len(data), at + chance.choice((1, 2, 4, 16, 256)))
    match chance.randrange(6):
        case 0 if data:
            data[at % len(data)] = chance.randrange(256)
        case 1:
            del data[at:to]
        case 2:
            data[at:at] = data[at:to] * chance.choice((1, 2, 50))
        case 3:
            data[at:at] = chance.choice(_ODD)
        case 4:
            data[at:to] = chance.choice(_ODD)
        case _:
            other = chance.choice(corpus)
            begin = chance.randrange(len(other) + 1)
            data[at:to] = other[begin : begin + chance.choice((4, 64, 1024))]


def hold(read: Callable[[bytes], object], inputs: Iterator[bytes]) -> int:
    """Read all ``inputs``; fail where one gives anything but a value or an error of ours in a line of some length.

    Returns:
        How many were refused.
    """
    refused = 0
    before_mb = _most_mb()
    for number, data in enumerate(inputs):
        began_s = time.perf_counter()
        try:
            read(data)
        except HandsteerError as error:
            refused += 1
            if "\n" in str(error) or len(str(error)) > 2000:
                pytest.fail(f"case {number}: not one short line: {str(error)[:300]!r}; {data[:300]!r}")
        except Exception as error:
            pytest.fail(f"case {number}: {type(error).__name__}: {error}; {data[:300]!r} of {len(data)} bytes")
        took_s = time.perf_counter() - began_s
        if took_s > SLOWEST_S:
            pytest.fail(f"case {number} took {took_s:.1f} s: {data[:300]!r} of {len(data)} bytes")
    grown_mb = _most_mb() - before_mb
    assert grown_mb < LARGEST_GROWTH_MB, f"grew by {grown_mb:.0f} MB"
    return refused


def _most_mb() -> float:
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (1e6 if sys.platform == "darwin" else 1e3)
