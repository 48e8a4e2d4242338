"""ROS 2 by its own library, rclpy, wherever that can be imported."""
