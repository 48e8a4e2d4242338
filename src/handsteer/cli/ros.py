"""``handsteer ros``: where the ROS packages are."""

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]


def ros() -> int:
    """Print the folder of the ROS packages: the course's for ROS 1, and handsteer_ros2.

    Example: . "$(handsteer ros)/setup.sh"
    """
    installed = _PACKAGE / "ros"
    print(installed if installed.is_dir() else _PACKAGE.parents[1] / "ros")  # the latter in a checkout
    return 0
