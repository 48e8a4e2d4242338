import pytest

from handsteer.plugins.page.camera import is_far


@pytest.mark.parametrize(
    ("client", "server", "expected"),
    [
        ("127.0.0.1", "127.0.0.1", False),
        ("::1", "::1", False),
        ("192.0.2.7", "192.0.2.7", False),  # this machine, by its own address
        ("192.0.2.9", "192.0.2.7", True),
    ],
)
def test_a_browser_is_far_unless_it_is_on_this_machine(client: str, server: str, expected: bool) -> None:
    assert is_far({"client": (client, 50000), "server": (server, 8080)}) is expected
