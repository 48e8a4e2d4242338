"""Which transport is taken, and what is said where its library is missing."""

import sys

import pytest

from handsteer.errors import TransportError
from handsteer.transports import join


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    for library in request.param:
        monkeypatch.setitem(sys.modules, library, None)


@pytest.mark.parametrize("without", [["rclpy"]], indirect=True)
def test_without_rclpy_it_says_what_to_source(without: None) -> None:
    with pytest.raises(TransportError, match=r"needs rclpy, which this Python \(3\.\d+\) does not find: source ROS 2"):
        join("ros2", "tests", [])


@pytest.mark.parametrize("without", [["rclpy", "cyclonedds"]], indirect=True)
def test_where_nothing_speaks_ros2_auto_says_so(without: None) -> None:
    with pytest.raises(TransportError, match=r"^there is no ROS 2 here, .*neither rclpy .*nor the package cyclonedds"):
        join("auto", "tests", [])


@pytest.mark.parametrize("without", [["rclpy"]], indirect=True)
def test_auto_takes_cyclone_dds_where_there_is_no_rclpy(without: None) -> None:
    pytest.importorskip("cyclonedds")
    with pytest.raises(
        TransportError, match="'nonsense' is not a valid argument of ROS 2"
    ):  # as DDS says it, before it joins
        join("auto", "tests", ["nonsense"])
    assert "handsteer.plugins.dds.transport" in sys.modules
