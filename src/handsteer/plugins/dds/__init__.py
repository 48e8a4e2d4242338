"""The transport over DDS, compatible with ROS 2; needs the package cyclonedds.

Imports :mod:`handsteer.plugins.ros2` beside the kernel: all of ROS 2 but reading, writing and finding.
"""
