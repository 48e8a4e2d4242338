"""The transport over DDS, compatible with ROS 2; needs the package cyclonedds.

Imports the kernel, and of :mod:`~handsteer.plugins.ros2` all but reading, writing and finding.
"""
