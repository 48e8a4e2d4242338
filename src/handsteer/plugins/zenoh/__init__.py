"""ROS 2 over Zenoh, in the wire format of rmw_zenoh; experimental, as it has not met one yet.

It needs the extra ``handsteer[zenoh]``, but no ROS.

Imports the kernel, and of :mod:`~handsteer.plugins.ros2` all but reading, writing and finding.
"""
