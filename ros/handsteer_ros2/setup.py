"""Installs the package, as colcon expects of ament_python."""

from pathlib import Path

from setuptools import setup

NAME = "handsteer_ros2"
NODES = ("camera", "recognition", "control", "robot", "steering")


def files(folder: str, pattern: str) -> list[str]:
    """Return the files of ``folder`` that match ``pattern``."""
    return sorted(str(path) for path in Path(folder).glob(pattern))


setup(
    name=NAME,
    version="0.2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", files("launch", "*.launch.py")),
        (f"share/{NAME}/config", files("config", "*.yaml")),
        (f"share/{NAME}/rviz", files("rviz", "*.rviz")),
        (f"share/{NAME}/urdf", files("urdf", "*.xacro")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="The handsteer authors",
    maintainer_email="handsteer@example.org",
    description="Drives a mobile robot by hand signs: handsteer's nodes as executables of ROS 2, and launch files.",
    license="Apache-2.0",
    entry_points={"console_scripts": [f"{node} = {NAME}.nodes:{node}" for node in NODES]},
)
