import socket
import sys

import pytest

from handsteer.plugins.doctor.ros2 import domains_in_use, places_left, taken_ports

PARTICIPANTS = 33


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells")
def test_taken_ports() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
        assert port in taken_ports()


def test_domains_by_the_ports_of_their_participants() -> None:
    second_in_42 = {7400 + 250 * 42 + 12, 7400 + 250 * 42 + 13}
    multicast_in_7 = {7400 + 250 * 7, 7400 + 250 * 7 + 1}
    anybodys = {7410, 50_000}
    assert domains_in_use(second_in_42 | multicast_in_7 | anybodys, PARTICIPANTS) == [7, 42]


def test_places_left() -> None:
    assert places_left(0, set(), PARTICIPANTS) == PARTICIPANTS
    assert places_left(0, {7410, 7411, 7413}, PARTICIPANTS) == PARTICIPANTS - 2
    assert places_left(1, {7660 + 2 * number for number in range(PARTICIPANTS)}, PARTICIPANTS) == 0
