"""ROS 2 over Zenoh, in the wire format of rmw_zenoh; needs the extra ``handsteer[zenoh]``, but no ROS."""
