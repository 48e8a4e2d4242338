"""The graph over ROS 1: rospy, imported only when this package is."""
