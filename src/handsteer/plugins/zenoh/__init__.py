"""ROS 2 over Zenoh, in the wire format of rmw_zenoh; needs the extra ``handsteer[zenoh]``, but no ROS.

Imports :mod:`handsteer.plugins.ros2` beside the kernel: all of ROS 2 but reading, writing and finding.
"""
