import pytest

from handsteer.errors import DashboardError
from handsteer.transports.addresses import host_for_others, is_loopback, listen

OPTIONS = ("--where", "--which")


@pytest.mark.parametrize(
    ("host", "alone"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("a.b", False)],
)
def test_what_only_this_machine_can_reach(host: str, alone: bool) -> None:
    assert is_loopback(host) is alone


def test_a_port_in_use() -> None:
    with listen("127.0.0.1", 0, 65536, options=OPTIONS, error=DashboardError) as first:
        port = first.getsockname()[1]
        with pytest.raises(DashboardError, match=rf"^port {port} on 127\.0\.0\.1 is in use: .* --which N"):
            listen("127.0.0.1", port, 65536, options=OPTIONS, error=DashboardError)


@pytest.mark.parametrize("host", ["203.0.113.7", "no such host"])
def test_an_address_of_another_machine(host: str) -> None:
    with pytest.raises(DashboardError, match=f"^--where {host} is not an address of this machine"):
        listen(host, 0, 65536, options=OPTIONS, error=DashboardError)


@pytest.mark.parametrize(
    ("host", "shown"), [("127.0.0.1", "127.0.0.1"), ("::1", "[::1]"), ("robot.local", "robot.local")]
)
def test_an_address_as_others_write_it(host: str, shown: str) -> None:
    assert host_for_others(host) == shown


def test_all_addresses_stand_for_one_that_others_can_use() -> None:
    assert host_for_others("0.0.0.0") not in {"0.0.0.0", ""}
