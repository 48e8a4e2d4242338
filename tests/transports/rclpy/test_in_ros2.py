"""Runs the tests of the transport by rclpy where rclpy is, which is not in this environment."""

import subprocess

from tests.ros2.graph import NEEDS_ROS2, PYTHON

pytestmark = NEEDS_ROS2
TIMEOUT_S = 600.0


def test_the_transport_keeps_its_contract_where_rclpy_is() -> None:
    tests = "tests/transports/rclpy/in_ros2.py"
    command = [str(PYTHON), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", tests]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
