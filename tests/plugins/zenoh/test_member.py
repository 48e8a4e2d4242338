"""What a session of Zenoh learns of the other nodes."""

import threading
from collections.abc import Iterator

import pytest

from tests.processes import eventually, free_port

pytest.importorskip("zenoh")

import zenoh

from handsteer.plugins.zenoh.member import Neighbours

CHANGES = 1000


@pytest.fixture
def pair() -> Iterator[tuple[zenoh.Session, zenoh.Session]]:
    """Two sessions that are connected to each other only."""
    endpoint, sessions = f"tcp/127.0.0.1:{free_port()}", []
    for place in ("listen", "connect"):
        config = zenoh.Config()
        config.insert_json5("scouting/multicast/enabled", "false")
        if place == "connect":
            config.insert_json5("listen/endpoints", "[]")
        config.insert_json5(f"{place}/endpoints", f'["{endpoint}"]')
        sessions.append(zenoh.open(config))
    yield sessions[0], sessions[1]
    for session in sessions:
        session.close()


def test_changes_that_are_not_read_yet_hold_up_no_messages(
    pair: tuple[zenoh.Session, zenoh.Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guard: the ring in ``Neighbours``. A node that ends while much changes has to hear that it may."""
    ours, theirs = pair
    begun, go_on, heard = threading.Event(), threading.Event(), threading.Event()

    def note(_neighbours: Neighbours, _sample: zenoh.Sample) -> None:
        begun.set()
        go_on.wait()

    monkeypatch.setattr(Neighbours, "_note", note)
    neighbours = Neighbours(ours, 7)
    ours.declare_subscriber("last", lambda _: heard.set())
    for number in range(CHANGES):
        what = f"MP/%/%/n{number}/%stopped/std_msgs::msg::dds_::Bool_/RIHS01_0/::,1:,:,:,,"
        theirs.liveliness().declare_token(f"@ros2_lv/7/{number:x}/0/1/{what}").undeclare()

    def is_heard() -> bool:
        theirs.put("last", b"")
        return begun.is_set() and heard.is_set()

    try:
        eventually(is_heard, 20.0)
    finally:
        go_on.set()
    neighbours.close()
