"""The relay that stands in for ``tc netem``: as frames in a list, and as a real link between two namespaces."""

import json
import statistics
import sys
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.distributed.network import DEVICE, WORKSTATION, Machine, NoNamespacesError, has_netem, run, two_machines
from tests.distributed.relay import Wire

TINY_S = 1e-9
ECHO = """
import socket, sys
plug = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
plug.bind((sys.argv[1], 7))
print("ready", flush=True)
while True:
    plug.sendto(*plug.recvfrom(2000))
"""
ASK = """
import json, socket, sys, time
plug = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
plug.settimeout(float(sys.argv[3]))
took_s = []
for number in range(int(sys.argv[2])):
    began_s = time.monotonic()
    plug.sendto(bytes([number]), (sys.argv[1], 7))
    try:
        while plug.recv(2000) != bytes([number]):
            pass
        took_s.append(time.monotonic() - began_s)
    except TimeoutError:
        pass
print(json.dumps(took_s))
"""


@given(
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 1)), max_size=40),
    st.floats(0, 0.1),
    st.floats(0, 0.2),
    st.randoms(use_true_random=False),
)
def test_every_frame_arrives_at_its_end_within_the_jitter(
    sent: list[tuple[float, int]], delay_s: float, jitter_s: float, random: Random
) -> None:
    wire = Wire(random.random)
    wire.shape(delay_s, jitter_s)
    for number, (at_s, end) in enumerate(sent):
        wire.put(bytes([number]), end, at_s)
    arrived = {}
    while (now_s := wire.next_s()) is not None:
        arrived.update({frame[0]: (end, now_s) for end, frame in wire.arrived(now_s)})
    assert len(arrived) == len(sent)
    for number, (at_s, end) in enumerate(sent):
        assert arrived[number][0] == end
        took_s = arrived[number][1] - at_s
        assert max(0.0, delay_s - jitter_s) - TINY_S <= took_s <= delay_s + jitter_s + TINY_S


def test_without_jitter_nothing_overtakes() -> None:
    wire = Wire()
    wire.shape(0.01)
    for number in range(100):
        wire.put(bytes([number]), 0, number * 1e-4)
    assert [frame[0] for _, frame in wire.arrived(1.0)] == list(range(100))


def test_the_given_share_is_lost() -> None:
    wire = Wire()
    wire.shape(loss=0.25)
    for _ in range(4000):
        wire.put(b"frame", 0, 0.0)
    assert 800 < wire.dropped < 1200
    assert len(list(wire.arrived(0.0))) == 4000 - wire.dropped


def test_a_cut_takes_what_is_under_way_too_and_a_full_queue_drops() -> None:
    wire = Wire()
    wire.shape(1.0)
    for _ in range(30_000):
        wire.put(b"frame", 0, 0.0)
    assert wire.dropped == 10_000
    wire.shape(loss=1.0)
    wire.put(b"frame", 1, 0.0)
    assert wire.dropped == 30_001
    assert wire.next_s() is None


def times_s(machine: Machine, count: int, patience_s: float = 10.0) -> list[float]:
    """Return how long each datagram took there and back; those that were lost are left out."""
    answer = machine.run(sys.executable, "-c", ASK, WORKSTATION, str(count), str(patience_s))
    return list(json.loads(answer))


@pytest.mark.netns
@pytest.mark.slow
def test_a_real_link_delays_loses_is_cut_and_leaves_nothing(tmp_path: Path) -> None:
    try:
        with two_machines(tmp_path) as (robot, workstation, link):
            names = [robot.namespace, workstation.namespace]
            assert link.kind == ("netem" if has_netem(robot) else "relay")
            echo = workstation.start(sys.executable, "-c", ECHO, WORKSTATION, log=tmp_path / "echo.log")
            link.shape(0.02, 0.005)
            there_and_back_s = times_s(robot, 40)
            assert len(there_and_back_s) == 40
            assert min(there_and_back_s) >= 0.03
            assert statistics.median(there_and_back_s) >= 0.035
            link.cut()
            assert times_s(robot, 3, 0.5) == []
            link.restore()
            assert len(times_s(robot, 40)) == 40
            link.shape(loss=0.3)
            assert 3 <= len(times_s(robot, 40, 0.5)) <= 37
            assert echo.running
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        pass
    except NoNamespacesError as why:
        pytest.skip(str(why))
    assert not set(names) & {line.split(" ")[0] for line in run("ip", "netns", "list").splitlines()}
    assert DEVICE not in run("ip", "link")
    assert not echo.running
