"""The transport of ROS 2's own library, rclpy, if it can be imported."""
