"""The transport over DDS, compatible with ROS 2; needs the package cyclonedds."""
