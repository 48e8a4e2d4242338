"""ROS 2 over Zenoh, in the wire format of rmw_zenoh: by the extra ``handsteer[zenoh]``, with no ROS installed."""
