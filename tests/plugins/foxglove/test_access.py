import pytest

from handsteer.plugins.foxglove.access import Access

FREE = Access.to("127.0.0.1")


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "https://app.foxglove.dev",
        "https://foxglove.dev",
        "http://localhost:8080",
        "http://127.0.0.1:3000",
        "http://[::1]:3000",
        "file://",
        "app://foxglove",
    ],
)
def test_programs_and_pages_that_may_connect_without_a_token(origin: str | None) -> None:
    assert FREE.refusal("/", {} if origin is None else {"Origin": origin}) is None


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "http://app.foxglove.dev",
        "https://app.foxglove.dev.evil.example",
        "https://evilfoxglove.dev",
        "https://localhost.evil.example",
        "https://[",
        "null",
        "",
        "nonsense",
    ],
)
def test_pages_that_may_not(origin: str) -> None:
    assert "--foxglove.token always" in str(FREE.refusal("/", {"Origin": origin}))


def test_other_machines_need_the_token_by_default() -> None:
    assert FREE.token is None
    for access in (Access.to("0.0.0.0"), Access.to("robot.local"), Access.to("localhost", "always")):
        assert access.token
        assert access.refusal("/", {}) is not None
        assert access.refusal(f"/?token={access.token}", {}) is None
        assert access.refusal("/", {"Authorization": f"bearer {access.token}"}) is None
        assert access.refusal(f"/?token={access.token}", {"Authorization": "Bearer other"}) is not None
    assert Access.to("0.0.0.0").token != Access.to("0.0.0.0").token


@pytest.mark.parametrize("path", ["", "//[", "/?token", "/?token=%00", "/?token=\udcff", "?" + "&" * 5000])
def test_whatever_is_asked_for_is_refused(path: str) -> None:
    assert Access("secret").refusal(path, {}) is not None
