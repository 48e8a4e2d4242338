"""handsteer's nodes as executables of ROS 2."""
