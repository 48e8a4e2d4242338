"""What ROS 2 has whatever carries its messages: names, arguments, and how messages are encoded."""
