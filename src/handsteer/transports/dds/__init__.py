"""The graph over DDS, as ROS 2 has it; needs the package cyclonedds."""
