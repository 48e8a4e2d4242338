import pytest

from handsteer.nodes.reporters import split_reporter


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("my_camera", ("", "my_camera")),
        ("my_camera: my_camera", ("", "my_camera")),
        ("left_camera: my_camera", ("", "my_camera")),
        ("r1/my_camera: my_camera", ("r1", "my_camera")),
        ("site/r1/steering: dashboard", ("site/r1", "dashboard")),
    ],
)
def test_namespace_and_node(name: str, expected: tuple[str, str]) -> None:
    assert split_reporter(name) == expected
